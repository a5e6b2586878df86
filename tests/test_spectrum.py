import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.comparison.noise import gaussian
from meshlab_specsmooth.geometry.surface import mean_edge_length
from tests.meshes import rough, sheet, torus, torus_eigenvalue, torus_graph, wave


@pytest.mark.parametrize("mesh", [rough(torus(20, 12)), rough(torus(60, 40)), rough(sheet(60, 40))])
def test_modes_and_energies_add_up(mesh):
    V, F = mesh
    result = mss.spectrum(V, F)
    assert result.method == ("exact" if len(V) <= 1000 else "chebyshev")
    assert result.modes.sum() == pytest.approx(len(V), rel=1e-9)
    assert (np.diff(result.eigenvalue) >= 0).all()
    if result.method == "exact":
        energy = ((V - V.mean(axis=0)) ** 2).sum()
        assert result.coordinate_power.sum() == pytest.approx(energy)  # every vertex of the torus has six neighbors


@pytest.mark.parametrize(("nx", "ny"), [(18, 12), (60, 40)])
def test_a_wave_has_its_energy_at_its_eigenvalue(nx, ny):
    V = np.stack([wave(2, 1, nx, ny), wave(nx // 3, ny // 3, nx, ny), np.zeros(nx * ny)], axis=1)
    result = mss.spectrum(V, torus_graph(nx, ny))
    low, high = torus_eigenvalue(2, 1, nx, ny), torus_eigenvalue(nx // 3, ny // 3, nx, ny)
    for eigenvalue in (low, high):
        near = abs(np.sqrt(result.eigenvalue) - np.sqrt(eigenvalue)) < 0.15
        energy = (V[:, 0] ** 2).sum()
        assert result.coordinate_power[near].sum() == pytest.approx(energy, rel=0.05)
        assert result.differential_power[near].sum() == pytest.approx(eigenvalue**2 * energy, rel=0.15)
    waves = result.wavelength[np.isfinite(result.wavelength)]
    assert (np.diff(waves) <= 0).all()


@pytest.mark.parametrize("level", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("size", [(30, 20), (120, 80)])
def test_the_noise_floor_is_the_noise(level, size):
    clean = mss.Surface(*torus(*size))
    noisy = gaussian(clean, level, seed=3)
    floor = mss.spectrum(noisy, clean.faces).noise_floor / mean_edge_length(clean)
    assert floor == pytest.approx(level, rel=0.15)


def test_the_spectrum_scales_with_the_mesh():
    V, F = rough(torus(40, 30))
    one, large = mss.spectrum(V, F, bands=16), mss.spectrum(1e6 * V + 1e6, F, bands=16)
    assert len(one.eigenvalue) == 16
    assert large.noise_floor == pytest.approx(1e6 * one.noise_floor)
    assert large.coordinate_power == pytest.approx(1e12 * one.coordinate_power, rel=1e-6, abs=1e-3)
    assert large.modes == pytest.approx(one.modes)


def test_what_has_no_spectrum_is_refused():
    with pytest.raises(mss.InvalidParameter, match="bands is 1; it must be an integer from 2 to 4096"):
        mss.spectrum(*torus(), bands=1)
    with pytest.raises(mss.InvalidParameter, match="a mesh without edges has no spectrum"):
        mss.spectrum([[0, 0, 0]], [[0, 0, 0]])
    with pytest.raises(mss.InvalidParameter, match="laplacian is 'x'"):
        mss.spectrum(*torus(), laplacian="x")


def test_a_mesh_of_one_point_has_no_spectrum():
    _, F = torus(40, 30)
    with pytest.raises(mss.InvalidParameter, match="a mesh without edges has no spectrum"):
        mss.spectrum(np.ones((1200, 3)), F)
