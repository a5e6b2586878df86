"""No vertex moves further than it may, and its neighbors follow."""

import numpy as np
import pymeshlab
import pytest
from scipy import optimize

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import face_vectors, mean_edge_length
from meshlab_specsmooth.meshlab import filters, meshset
from tests.meshes import noisy, torus

TRUTH = torus(50, 25)
ROUGH = noisy(TRUTH, 0.3)
EDGE = mean_edge_length(mss.Surface(*TRUTH))
FILTERS = {
    "smooth": mss.smooth,
    "weights": lambda *mesh, **given: mss.smooth(*mesh, barycenter_weight=np.linspace(0.1, 0.5, 1250), **given),
    "low_pass": lambda *mesh, **given: mss.low_pass(*mesh, wavelength=8 * EDGE, **given),
    "enhance": lambda *mesh, **given: mss.enhance(*mesh, gain=8, **given),
    "denoise": mss.denoise,
    "edge_aware": lambda *mesh, **given: mss.smooth_edge_aware(
        *mesh, strength=0.5, range_sigma=0.35, iterations=3, barycenter_weight=0.35, **given
    ),
}


def lengths(X):
    return np.linalg.norm(X, axis=1)


def angles(V):
    """Root mean square angle of the faces' normals to the truth's, in degrees."""
    n, m = (face_vectors(mss.Surface(X, TRUTH[1])) for X in (V, TRUTH[0]))
    cosines = (n * m).sum(axis=1) / lengths(n) / lengths(m)
    return np.sqrt((np.degrees(np.arccos(cosines.clip(-1, 1))) ** 2).mean())


@pytest.mark.parametrize("name", FILTERS)
def test_no_vertex_moves_further(name):
    free = FILTERS[name](*ROUGH)
    moved = lengths(free.vertices - ROUGH[0])
    limit = float(np.quantile(moved, 0.8))
    mask = np.arange(1250) % 50 > 3
    held = FILTERS[name](*ROUGH, max_displacement=limit)
    assert free.limited == 0
    reached = lengths(held.vertices - ROUGH[0])
    assert reached.max() <= limit * (1 + 1e-9)
    assert held.limited == (reached >= limit * 0.999).sum() > 50
    assert f"{held.limited} of 1250 vertices are held at the max_displacement of {limit:.4g}" in held.warning
    # a limit that nothing reaches changes no bit
    assert np.array_equal(FILTERS[name](*ROUGH, max_displacement=2 * moved.max()).vertices, free.vertices)
    part = FILTERS[name](*ROUGH, max_displacement=limit / 2, mask=mask)
    assert np.array_equal(part.vertices[~mask], ROUGH[0][~mask])


@pytest.mark.parametrize(("name", "factor"), [("smooth", 0.98), ("denoise", 0.95)])
def test_neighbors_follow_what_is_held(name, factor):
    free = FILTERS[name](*ROUGH).vertices - ROUGH[0]
    limit = np.quantile(lengths(free), 0.9)
    cut_off = ROUGH[0] + free * np.minimum(1, limit / lengths(free))[:, None]
    held = FILTERS[name](*ROUGH, max_displacement=limit).vertices
    assert angles(held) < factor * angles(cut_off)


def test_the_least_energy_is_that_of_a_general_solver():
    mesh = noisy(torus(5, 4), 0.3)
    setting = mss.Smoothing(low_pass=mss.Ideal(modes=4), barycenter_weight=0.5, tolerance=1e-8)
    Y = mss.smooth(*mesh, setting).vertices
    limit = float(np.quantile(lengths(Y - mesh[0]), 0.5))
    ops = mss.assemble(*mesh)
    L = ops.L @ np.eye(20)
    C = np.zeros((len(mesh[1]), 20))
    np.add.at(C, (np.arange(len(mesh[1]))[:, None], mesh[1]), 1 / 3)
    A = L.T @ L + 0.25 * C.T @ C

    def energy(x):
        d = x.reshape(20, 3) - Y
        return (d * (A @ d)).sum(), 2 * (A @ d).ravel()

    ball = optimize.NonlinearConstraint(lambda x: ((x.reshape(20, 3) - mesh[0]) ** 2).sum(axis=1), -np.inf, limit**2)
    best = optimize.minimize(energy, mesh[0].ravel(), jac=True, constraints=[ball], method="SLSQP")
    region = mss.Region(max_displacement=limit)
    held = mss.smooth(*mesh, setting, region=region).vertices
    assert energy(held.ravel())[0] == pytest.approx(best.fun, rel=2e-3)


def test_a_percentage_is_of_the_diagonal():
    diagonal = np.linalg.norm(np.ptp(ROUGH[0], axis=0))
    by_length = mss.smooth(*ROUGH, barycenter_weight=0.3, max_displacement=0.002 * diagonal)
    by_percent = mss.smooth(*ROUGH, barycenter_weight=0.3, max_displacement="0.2 %")
    assert np.allclose(by_length.vertices, by_percent.vertices, rtol=0, atol=1e-12)
    assert mss.Region(max_displacement="0.2 %") == mss.Region(max_displacement="0.2%")
    ms = meshset.new(*ROUGH)
    report = filters.apply_coord_spectral_smoothing(
        ms, barycenter_weight=0.3, max_displacement=pymeshlab.PercentageValue(0.2)
    )
    assert report["limited"] == by_percent.limited
    for bad in (0, -1.0, "0%", "2", "-1%", "x%", np.inf):
        with pytest.raises(mss.InvalidParameter, match="max_displacement is"):
            mss.smooth(*ROUGH, max_displacement=bad)
