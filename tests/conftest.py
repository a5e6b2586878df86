import os

import numpy as np
import pymeshlab
import pytest

from tests.meshes import rough, sheet, torus


@pytest.fixture
def untraced(monkeypatch):
    """For processes that a test starts and interrupts, kills, or leaves no disk to write on.

    Coverage's lock is not made for interrupts, and they might hang on it; and it writes files, too.
    """
    for name in [name for name in os.environ if name.startswith("COVERAGE_")]:
        monkeypatch.delenv(name)


@pytest.fixture(autouse=True)
def _processes_of_tests_without_coverage(request):
    """Where coverage stands still for a test (``no_cover``), it does so in the processes that the test starts, too.

    Tracing doubles the time of a test; those that run what others have covered go without. What the report says of
    the lines is then at most too little.
    """
    if request.node.get_closest_marker("no_cover"):
        request.getfixturevalue("untraced")


@pytest.fixture
def laden():
    """A MeshSet in which the current mesh carries all that a mesh can, between two others."""
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*torus(6, 5)), "before")
    V, F = rough(sheet(7, 6))
    n, m = len(V), len(F)
    rng = np.random.default_rng(5)
    ms.add_mesh(
        pymeshlab.Mesh(
            V,
            F,
            v_color_matrix=rng.random((n, 4)),
            f_color_matrix=rng.random((m, 4)),
            v_scalar_array=rng.random(n),
            f_scalar_array=rng.random(m),
            v_tex_coords_matrix=rng.random((n, 2)),
            w_tex_coords_matrix=rng.random((3 * m, 2)),
        ),
        "laden",
    )
    ms.add_mesh(pymeshlab.Mesh(*torus(5, 5)), "after")
    ms.set_current_mesh(1)
    ms.compute_curvature_principal_directions_per_vertex()
    ms.set_mesh_visibility(0, False)
    ms.compute_selection_by_condition_per_vertex(condselect="x > 2")
    ms.compute_selection_by_condition_per_face(condselect="fi < 20")
    ms.compute_matrix_from_translation_rotation_scale(translationx=3, rotationz=30, scalex=2, freeze=False)
    ms.apply_coord_taubin_smoothing(lambda_=0.25, stepsmoothnum=1)
    mesh = ms.current_mesh()
    mesh.add_vertex_custom_scalar_attribute(rng.random(n), "heat")
    mesh.add_vertex_custom_scalar_attribute(rng.random(n), "no identifier!")
    mesh.add_face_custom_scalar_attribute(rng.random(m), "heat")
    mesh.add_vertex_custom_point_attribute(rng.random((n, 3)), "flow")
    return ms
