"""Staircases: surfaces of binary masks are recognized, and smoothed as far as their voxels allow."""

import numpy as np
import pymeshlab
import pytest
from scipy.spatial.transform import Rotation

import meshlab_specsmooth as mss
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.noise.voxels import find_voxels
from tests.meshes import rough, sheet, torus

pyvista = pytest.importorskip("pyvista")

TURN = Rotation.random(random_state=3).as_matrix()


def volume(radii, spacing):
    """A grid about the origin, off its lattice, with the depth of each point in an ellipsoid."""
    radii, spacing = np.broadcast_to(radii, 3).astype(float), np.broadcast_to(spacing, 3).astype(float)
    counts = 2 * np.ceil(radii / spacing).astype(int) + 5
    grid = pyvista.ImageData(dimensions=counts, spacing=spacing, origin=-spacing * (counts - 1) / 2 + 0.21 * spacing)
    grid["depth"] = 1 - np.sqrt(((grid.points / radii) ** 2).sum(axis=1))
    return grid


def contour(grid, values, level):
    grid["values"] = values
    surface = grid.contour([level], scalars="values", method="flying_edges").triangulate().clean()
    return np.asarray(surface.points, dtype=float), surface.regular_faces.astype(np.int64)


def mask(radii, spacing=1.0):
    """Marching cubes on the mask of an ellipsoid."""
    grid = volume(radii, spacing)
    return contour(grid, (grid["depth"] > 0).astype(float), 0.5)


def blocks(radius):
    """The faces of the voxels of a ball, as triangles."""
    grid = volume(radius, 1.0)
    grid["inside"] = (grid["depth"] > 0).astype(float)
    surface = grid.points_to_cells().threshold(0.5, scalars="inside").extract_surface(algorithm="dataset_surface")
    surface = surface.triangulate().clean()
    return np.asarray(surface.points, dtype=float), surface.regular_faces.astype(np.int64)


def angle(V, F, radii):
    """Mean angle between the faces and the ellipsoid, in degrees."""
    n = V[F].mean(axis=1) / np.broadcast_to(radii, 3) ** 2
    f = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    cosine = (n * f).sum(axis=1) / np.linalg.norm(n, axis=1) / np.maximum(np.linalg.norm(f, axis=1), 1e-300)
    return np.degrees(np.arccos(np.clip(np.abs(cosine), 0, 1))).mean()


@pytest.mark.parametrize(
    ("radii", "spacing"), [(6.3, 1.0), (14.2, 1.0), ((14, 10, 12), 1.0), ((15, 13, 16), (1, 1, 3)), ((9, 12, 8), 0.7)]
)
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_the_voxels_of_a_mask_are_found(radii, spacing, turned, kind):
    V, F = mask(radii, spacing)
    if turned:
        V = 2.5 * V @ TURN + [30, 0, 50]
    found = find_voxels(V.astype(kind).astype(float), F)
    expected = np.sort(np.broadcast_to(spacing, 3) * (2.5 if turned else 1.0))
    assert np.sort(found.spacing) == pytest.approx(expected, rel=1e-4)
    if turned:
        assert np.abs(found.axes @ TURN.T).max(axis=1) == pytest.approx(1, abs=1e-3)


def test_the_voxels_of_their_faces_are_found():
    V, F = blocks(9.3)
    for X in (V, 3 * V @ TURN):
        assert find_voxels(X, F).spacing == pytest.approx(np.full(3, 1.0 if X is V else 3.0), rel=1e-6)


def box(side):
    """A cube with a grid on each face: on a lattice, and not a staircase."""
    cube = pyvista.ImageData(dimensions=np.full(3, side + 1)).extract_surface(algorithm="dataset_surface")
    surface = cube.triangulate().clean()
    return np.asarray(surface.points, dtype=float), surface.regular_faces.astype(np.int64)


def test_other_surfaces_have_none():
    grid = volume(14.2, 1.0)
    V, F = mask(14.2)
    for other in (
        box(20),
        sheet(20, 20),
        torus(40, 30),
        contour(grid, grid["depth"], 0.0),  # gray values put vertices where the surface is
        (V + 0.05 * np.random.default_rng(0).standard_normal(V.shape), F),
        (np.zeros_like(V), F),
    ):
        assert find_voxels(np.asarray(other[0], dtype=float), np.asarray(other[1])) is None


@pytest.mark.parametrize("run", [mss.smooth, mss.denoise])
@pytest.mark.parametrize(
    ("radii", "spacing", "at_most"),
    [(10.2, 1.0, 2.8), (18.3, 1.0, 1.8), (22.1, 1.0, 1.4), ((23, 19, 24), (1, 1, 3), 3.5)],
)
def test_terraces_go(run, radii, spacing, at_most):
    V, F = mask(radii, spacing)
    given, result = angle(V, F, radii), run(V, F)
    assert given > 15
    assert angle(result.vertices, F, radii) < at_most
    assert result.noise.kind == "staircase"
    assert np.sort(result.noise.spacing) == pytest.approx(np.sort(np.broadcast_to(spacing, 3)))
    assert "as far as the voxels allow; staircase of voxels of" in result.summary
    moved = np.abs(result.vertices - V) / (np.broadcast_to(spacing, 3) / 2)
    assert np.quantile(moved.max(axis=1), 0.99) < 1.4
    # how far the vertices are off is bounded, not measured
    assert result.noise.resolution == result.noise.level > 0.2


def test_blocks_become_round():
    V, F = blocks(15.3)
    assert angle(V, F, 15.3) > 40
    assert angle(mss.denoise(V, F).vertices, F, 15.3) < 2.6


def test_it_does_not_matter_how_a_mask_is_turned_and_scaled():
    V, F = mask(14.2)
    result, turned = mss.smooth(V, F), mss.smooth(0.01 * V @ TURN, F)
    assert 100 * turned.vertices @ TURN.T == pytest.approx(result.vertices, abs=0.03)


def test_a_spacing_that_is_given_is_used():
    V, F = mask((23, 19, 24), (1, 1, 3))
    V = V + 0.02 * np.random.default_rng(0).standard_normal(V.shape)  # not on a lattice any more
    for run in (mss.smooth, mss.denoise):
        assert run(V, F).noise.kind != "staircase"
        result = run(V, F, spacing=(1, 1, 3))
        assert result.noise.kind == "staircase"
        assert angle(result.vertices, F, (23, 19, 24)) < 3.5


@pytest.mark.parametrize("spacing", [0, -1, np.inf, "wide", (1, 2), (1, 1, 0), [[1, 1, 1]]])
def test_a_spacing_that_is_none_is_refused(spacing):
    for run in (mss.smooth, mss.denoise):
        with pytest.raises(InvalidParameter, match="spacing"):
            run(*torus(40, 30), spacing=spacing)


def test_a_spacing_beside_a_weight_is_refused():
    with pytest.raises(InvalidParameter, match="give one of them"):
        mss.smooth(*torus(40, 30), spacing=1, barycenter_weight=1)


def test_the_filters_take_a_spacing_and_a_distance_of_slices():
    V, F = mask((12, 10, 12), (1, 1, 3))
    V = V + 0.02 * np.random.default_rng(0).standard_normal(V.shape)
    for name, run in (("smoothing", mss.smooth), ("denoising", mss.denoise)):
        ms = pymeshlab.MeshSet(verbose=False)
        ms.add_mesh(pymeshlab.Mesh(V, F))
        apply = getattr(mss, f"apply_coord_spectral_{name}")
        apply(ms, spacing=1.0, slice_spacing=3.0)
        expected = run(V, F, spacing=(1, 1, 3)).vertices
        assert ms.current_mesh().vertex_matrix() == pytest.approx(expected, abs=1e-9)
        with pytest.raises(InvalidParameter, match="slice_spacing is 3 without a spacing"):
            apply(ms, slice_spacing=3.0)


def test_noise_on_a_plane_is_no_staircase():
    assert mss.estimate_noise(*rough(sheet(40, 40), 0.2)).spacing == ()
