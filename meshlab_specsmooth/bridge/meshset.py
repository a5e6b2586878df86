"""Arrays out of a MeshSet, and new coordinates back into it, with nothing else changed."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pymeshlab

from meshlab_specsmooth.errors import MeshSetError
from meshlab_specsmooth.surface import Floats

# One morphing pass is exact for small moves and two for wild ones, where v + (t - v) rounds; a third never was needed.
MOST_MORPHING_PASSES = 3


def new(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> pymeshlab.MeshSet:
    """A MeshSet with one mesh."""
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(np.asarray(vertices, dtype=np.float64), np.asarray(faces)))
    return ms


def pull(ms: pymeshlab.MeshSet) -> tuple[Floats, npt.NDArray[np.int32]]:
    """Vertices and faces of the current mesh, in its untransformed coordinates, as MeshLab's filters see them."""
    mesh = ms.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def push(ms: pymeshlab.MeshSet, vertices: Floats) -> None:
    """Give the current mesh new coordinates, to the bit.

    The mesh is morphed onto a temporary one, as only filters change a mesh inside a MeshSet. Everything that hangs on
    the mesh stays, and so do the current mesh, the other meshes, the filter script and the verbosity. Normals and
    bounding box follow, as after MeshLab's own filters.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
        Its current mesh must have faces and finite coordinates.
    vertices : (n, 3) float64
        Untransformed coordinates, one row a vertex.

    Raises
    ------
    MeshSetError
        The mesh did not take the coordinates; it has its old ones then. (So it has if anything else is raised.)
    """
    mesh = ms.current_mesh()
    before = mesh.vertex_matrix()
    if vertices.shape != before.shape:
        raise MeshSetError(f"{len(vertices)} coordinates for a mesh of {len(before)} vertices")
    with _leaving_no_trace(ms):
        try:
            exact = _morph(ms, vertices)
        except BaseException:
            _morph(ms, before)
            raise
        if not exact:
            _morph(ms, before)
            raise MeshSetError(f"the mesh did not take its new coordinates in {MOST_MORPHING_PASSES} morphing passes")


def _morph(ms: pymeshlab.MeshSet, vertices: Floats) -> bool:
    """Move the current mesh onto ``vertices``; whether it arrived to the bit."""
    mesh, target = ms.current_mesh(), _add(ms, pymeshlab.Mesh(vertices, ms.current_mesh().face_matrix()))
    try:
        for _ in range(MOST_MORPHING_PASSES):
            ms.compute_coord_linear_morphing(targetmesh=target, percentmorph=100.0)
            if np.array_equal(mesh.vertex_matrix(), vertices):
                return True
        return False
    finally:
        _delete(ms, target)


def _add(ms: pymeshlab.MeshSet, mesh: pymeshlab.Mesh) -> int:
    """Add a temporary mesh without making it the current one; its id."""
    ms.add_mesh(mesh, "", set_as_current=False)
    return max(int(m.id()) for m in ms)


def _delete(ms: pymeshlab.MeshSet, temporary: int) -> None:
    current = ms.current_mesh_id()
    ms.set_current_mesh(temporary)
    ms.delete_current_mesh()
    ms.set_current_mesh(current)


@contextlib.contextmanager
def _leaving_no_trace(ms: pymeshlab.MeshSet) -> Iterator[None]:
    """Filters called inside are neither printed nor kept in the filter script.

    pymeshlab records every filter and offers no way to drop the last one, so the script is saved, and loaded again
    afterwards. (Its files hold six digits of a number.)
    """
    with tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
        script = Path(folder) / "before.mlx"
        ms.save_filter_script(str(script))
        verbose = _is_verbose(ms)
        ms.set_verbosity(False)
        try:
            yield
        finally:
            ms.clear_filter_script()
            if b"<filter " in script.read_bytes():
                with _native_output_dropped():  # pymeshlab prints what it reads, verbose or not
                    ms.load_filter_script(str(script))
            ms.set_verbosity(verbose)


def _is_verbose(ms: pymeshlab.MeshSet) -> bool:
    """Whether the MeshSet prints what it does; pymeshlab cannot be asked, so a filter is run where nobody sees it."""
    point = _add(ms, pymeshlab.Mesh(np.zeros((1, 3))))
    printed = io.StringIO()
    with _native_output_dropped(), contextlib.redirect_stdout(printed):
        _delete(ms, point)
    return bool(printed.getvalue())


@contextlib.contextmanager
def _native_output_dropped() -> Iterator[None]:
    """Send what C++ writes to standard output and error nowhere; used for the milliseconds of one call."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = {number: os.dup(number) for number in (1, 2)}
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number in kept:
            os.dup2(nowhere, number)
        yield
    finally:
        for number, copy in kept.items():
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
