import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import boundary_vertices, edges, is_closed, mean_edge_length, signed_volume
from tests.meshes import TETRAHEDRON, TRIANGLE, sheet, torus

V, F = TRIANGLE


def with_entry(array, index, value):
    changed = np.array(array, dtype=float if isinstance(value, float) else None)
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("vertices", "faces", "array", "index", "words"),
    [
        (with_entry(V, (1, 2), np.nan), F, "vertices", 1, "not finite"),
        (with_entry(V, (2, 0), np.inf), F, "vertices", 2, "not finite"),
        (V[:, :2], F, "vertices", None, r"shape \(3, 2\)"),
        (V.ravel(), F, "vertices", None, r"shape \(9,\)"),
        ([[0, 0, 0], [1, 0]], F, "vertices", None, "rows of 3 coordinates"),
        (V.astype(complex), F, "vertices", None, "complex128"),
        (V > 0, F, "vertices", None, "bool"),
        (V.astype(str), F, "vertices", None, "real numbers"),
        ([], F, "vertices", None, "empty"),
        (np.empty((0, 3)), F, "vertices", None, "empty"),
        (V, [[0, 1, 2], [0, 1, 3]], "faces", 1, r"vertex 3 of a mesh with 3 vertices \(0 to 2\)"),
        (V, [[0, 1, -1]], "faces", 0, "vertex -1"),
        (V, F.astype(float), "faces", None, r"faces.astype\(int\)"),
        (V, F[:, :2], "faces", None, r"shape \(1, 2\)"),
        (V, [], "faces", None, "empty"),
        (V, np.empty((0, 3), dtype=int), "faces", None, "reconstruct a surface"),
        (V, [[0, 1, 2**40]], "faces", 0, "vertex 1099511627776"),
    ],
)
def test_the_gate_names_the_array_the_row_and_the_remedy(vertices, faces, array, index, words):
    with pytest.raises(mss.InvalidSurface, match=words) as caught:
        mss.Surface(vertices, faces)
    assert (caught.value.array, caught.value.index) == (array, index)
    assert str(caught.value).startswith(array)
    assert "; " in str(caught.value)  # the remedy follows


@pytest.mark.parametrize("faces", [F.astype(np.uint8), F.astype(np.int16), F.tolist(), np.asfortranarray(F)])
def test_all_kinds_of_integers_and_orders_are_accepted(faces):
    surface = mss.Surface(np.asfortranarray(V).astype(np.float32), faces)
    assert np.array_equal(surface.faces, F)
    assert np.array_equal(surface.vertices, V)
    assert surface.vertices.flags["C_CONTIGUOUS"]


def test_a_surface_is_frozen_and_shares_nothing_with_its_input():
    vertices = V.copy()
    surface = mss.Surface(vertices, F)
    vertices[0] = 7
    assert surface.vertices[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        surface.vertices[0] = 1
    with pytest.raises(AttributeError):
        surface.vertices = vertices


def test_edges_of_a_tetrahedron_are_all_pairs_each_with_two_faces():
    ends, count = edges(mss.Surface(*TETRAHEDRON))
    assert ends.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert (count == 2).all()


def test_edges_leave_out_the_sides_that_join_a_vertex_to_itself():
    ends, count = edges(mss.Surface(V, [[0, 0, 1], [2, 2, 2]]))
    assert ends.tolist() == [[0, 1]]
    assert count.tolist() == [2]


def test_lengths_of_a_right_triangle():
    assert mean_edge_length(mss.Surface(V, F)) == pytest.approx((3 + 4 + 5) / 3)
    assert mean_edge_length(mss.Surface(V, [[1, 1, 1]])) == 0


def test_the_boundary_of_a_sheet_is_its_rim():
    nx, ny = 6, 5
    rim = np.ones((nx, ny), dtype=bool)
    rim[1:-1, 1:-1] = False
    assert np.array_equal(boundary_vertices(mss.Surface(*sheet(nx, ny))), rim.ravel())
    assert not boundary_vertices(mss.Surface(*torus())).any()


def test_volume_and_closedness():
    assert signed_volume(mss.Surface(*TETRAHEDRON)) == pytest.approx(1 / 6)
    assert signed_volume(mss.Surface(TETRAHEDRON[0] + 1000, TETRAHEDRON[1][:, ::-1])) == pytest.approx(-1 / 6)
    assert is_closed(mss.Surface(*TETRAHEDRON))
    assert not is_closed(mss.Surface(*TRIANGLE))
    assert not is_closed(mss.Surface(V, [[1, 1, 1]]))
