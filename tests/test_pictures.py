import sys

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.reports.pictures import Panel, close_up, front, picture
from tests.meshes import rough, torus

pyvista = pytest.importorskip("pyvista")


def test_a_picture_shows_each_surface_in_its_place(tmp_path):
    clean = mss.Surface(*torus(30, 20))
    noisy = mss.Surface(*rough(torus(30, 20), 0.4))
    view = front(clean)
    path = tmp_path / "picture.png"
    picture(path, [Panel("clean", clean), Panel("noisy", noisy)], [view, close_up(view, clean.vertices[0], 0.3)])
    image = pyvista.read(path)
    pixels = np.asarray(image.active_scalars).reshape(*image.dimensions[:2][::-1], -1).astype(float)
    height, width = pixels.shape[:2]
    assert width == 720
    top = pixels[height // 2 :]  # VTK's rows start at the bottom
    left, right = top[:, :360], top[:, 360:]

    def shading(half):
        """How much neighboring pixels of the surface differ; the white background left out."""
        surface = (half < 250).all(axis=2)
        inside = surface[:, 1:] & surface[:, :-1]
        return np.abs(np.diff(half.mean(axis=2), axis=1))[inside].mean(), surface.mean()

    (clean_shading, clean_area), (noisy_shading, noisy_area) = shading(left), shading(right)
    assert 0.15 < clean_area < 0.7
    assert noisy_area == pytest.approx(clean_area, rel=0.35)
    assert noisy_shading > 1.5 * clean_shading  # flat shaded: the noise shows
    assert [file.name for file in tmp_path.iterdir()] == ["picture.png"]


def test_a_folder_in_the_place_of_the_picture_is_an_error_and_leaves_nothing(tmp_path):
    surface = mss.Surface(*torus(8, 6))
    (tmp_path / "p.png").mkdir()
    with pytest.raises(mss.FileError, match="p.png: is a folder"):
        picture(tmp_path / "p.png", [Panel("", surface)], [front(surface)])
    with pytest.raises(mss.FileError, match="there is no folder"):
        picture(tmp_path / "none" / "p.png", [Panel("", surface)], [front(surface)])
    assert [file.name for file in tmp_path.rglob("*")] == ["p.png"]


def test_without_the_renderer_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(mss.MissingExtra, match=r"pip install 'meshlab-specsmooth\[report\]'"):
        picture(tmp_path / "p.png", [], [])
    assert list(tmp_path.iterdir()) == []
