"""Arrays out of a MeshSet, and new coordinates back into it, with nothing else changed."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pymeshlab

from meshlab_specsmooth.errors import MeshSetError
from meshlab_specsmooth.surface import Floats

# pymeshlab's own, whatever is registered later
_NATIVE_LOAD = pymeshlab.MeshSet.load_filter_script

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
    bounding box follow, as after MeshLab's own filters. The temporary mesh uses up one id, so the next mesh that is
    added gets the one after it.

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
    with leaving_no_trace(ms):
        try:
            exact = _morph(ms, vertices)
        except BaseException:
            _morph(ms, before)
            raise
        if not exact:
            _morph(ms, before)
            raise MeshSetError(f"the mesh did not take its new coordinates in {MOST_MORPHING_PASSES} morphing passes")


def push_quality(ms: pymeshlab.MeshSet, quality: Floats) -> Floats:
    """Give the vertices of the current mesh a quality; nothing else changes, as with :func:`push`.

    It is taken over from a temporary point cloud, by place: vertices at one place get the mean of theirs.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    quality : (n,) float64

    Returns
    -------
    (n,) float64
        What was written, to the bit.

    Raises
    ------
    MeshSetError
        The mesh did not take the values.
    """
    mesh, target = ms.current_mesh(), ms.current_mesh_id()
    _, first, at, count = np.unique(
        mesh.vertex_matrix(), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    mean = np.bincount(at.ravel(), weights=quality, minlength=len(first)) / count
    expected = np.asarray(mean[at.ravel()])
    places = mesh.vertex_matrix()[first]
    # The filter that transfers attributes works on the mesh where its transform puts it, and moves it there and back,
    # which rounds: it must not see the transform.
    transform = mesh.transform_matrix()
    with leaving_no_trace(ms):
        source = _add(ms, pymeshlab.Mesh(places, v_scalar_array=mean))
        try:
            ms.set_matrix(transformmatrix=np.eye(4), freeze=False)
            ms.transfer_attributes_per_vertex(
                sourcemesh=source, targetmesh=target, vertexsampling=True, colortransfer=False, qualitytransfer=True
            )
        finally:
            ms.set_matrix(transformmatrix=transform, freeze=False)
            _delete(ms, source)
    if not np.array_equal(mesh.vertex_scalar_array(), expected):
        raise MeshSetError("the mesh did not take its new vertex quality")
    return expected


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


def is_verbose(ms: pymeshlab.MeshSet) -> bool:
    """Whether the MeshSet prints which filters it runs; it must have a mesh."""
    with leaving_no_trace(ms) as verbose:
        return verbose


@contextlib.contextmanager
def leaving_no_trace(ms: pymeshlab.MeshSet) -> Iterator[bool]:
    """Filters called inside are neither printed nor kept in the filter script; yields whether the MeshSet is verbose.

    The MeshSet must have a mesh.
    """
    with keeping_script(ms):
        full, parameters = False, False
        try:
            full, parameters = _verbosity(ms)
            ms.set_verbosity(False)
            ms.set_parameter_verbosity(False)
            yield full or parameters
        finally:
            ms.set_verbosity(full)
            ms.set_parameter_verbosity(parameters)


@contextlib.contextmanager
def keeping_script(ms: pymeshlab.MeshSet) -> Iterator[None]:
    """The filter script is afterwards what it was before.

    pymeshlab records every filter and offers no way to drop the last one, so the script is saved, and loaded again
    afterwards. Its files hold six digits of a number, and so does the script from then on: what was recorded with more
    digits before is replayed with six.
    """
    with tempfile.TemporaryDirectory(prefix="specsmooth-") as folder:
        script = Path(folder) / "before.mlx"
        ms.save_filter_script(str(script))
        try:
            yield
        finally:
            ms.clear_filter_script()
            if b"<filter " in script.read_bytes():
                load_script(ms, script)


def load_script(ms: pymeshlab.MeshSet, script: Path) -> None:
    """Make a file the MeshSet's filter script; without printing what is read, as pymeshlab does, verbose or not."""
    with native_output():
        _NATIVE_LOAD(ms, str(script))


def _verbosity(ms: pymeshlab.MeshSet) -> tuple[bool, bool]:
    """What the MeshSet prints: everything, and the parameters of filters. It cannot be asked, so it is tried."""
    told = _what_a_filter_tells(ms)
    if not told:
        return False, False
    ms.set_verbosity(False)
    without = _what_a_filter_tells(ms)
    # with everything on, a filter tells of its parameters as well, and one line more
    return told.count("\n") > without.count("\n"), bool(without)


def _what_a_filter_tells(ms: pymeshlab.MeshSet) -> str:
    """What is printed of a filter that does nothing, by C++ and by way of Python.

    Both count: pymeshlab silences C++'s streams for the whole process while a filter runs, and where threads run
    filters at once, they may stay so.
    """
    printed = io.StringIO()
    with native_output() as told, contextlib.redirect_stdout(printed):
        ms.set_selection_none(allfaces=False, allverts=False)
    return told[0] + printed.getvalue()


# standard output and error belong to the process, so threads take turns
_streams = threading.RLock()


@contextlib.contextmanager
def native_output() -> Iterator[list[str]]:
    """Catch what C++ writes to standard output and error during one short call; afterwards it is in the list."""
    told: list[str] = []
    with _streams, tempfile.TemporaryFile() as file:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        kept = {number: os.dup(number) for number in (1, 2) if _is_open(number)}
        try:
            for number in kept:
                os.dup2(file.fileno(), number)
            yield told
        finally:
            for number, copy in kept.items():
                os.dup2(copy, number)
                os.close(copy)
            file.seek(0)
            told.append(file.read().decode(errors="replace"))


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True
