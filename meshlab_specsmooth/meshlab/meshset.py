"""Arrays out of a MeshSet, and new coordinates back into it, with nothing else changed."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import MeshSetError
from meshlab_specsmooth.meshlab import records
from meshlab_specsmooth.meshlab.records import Stand, Verbosity, kept
from meshlab_specsmooth.runtime import blocks, temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts, all_or_nothing

# pymeshlab's own, whatever is registered later
_NATIVE_LOAD, _NATIVE_SAVE = pymeshlab.MeshSet.load_filter_script, pymeshlab.MeshSet.save_filter_script
_NATIVE_VERBOSITY = pymeshlab.MeshSet.set_verbosity
_NATIVE_PARAMETER_VERBOSITY = pymeshlab.MeshSet.set_parameter_verbosity

# MeshLab moves v to v + (t - v), which is exact where t lies between v / 2 and 2 v. From anywhere else, across a
# coordinate plane for one, a pass comes so close that the next is exact; a third never was needed.
MOST_MORPHING_PASSES = 3

# pymeshlab dies where it transfers attributes between meshes and squares of coordinates leave the range of numbers
_FARTHEST_WITH_QUALITY = 1e150


def new(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> pymeshlab.MeshSet:
    """A MeshSet with one mesh."""
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(np.asarray(vertices, dtype=np.float64), np.asarray(faces)))
    return ms


def pull(ms: pymeshlab.MeshSet) -> tuple[Floats, npt.NDArray[np.int32]]:
    """Vertices and faces of the current mesh, in its untransformed coordinates, as MeshLab's filters see them."""
    mesh = ms.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


@dataclass(frozen=True, eq=False)
class Change:
    """What is to be written into a MeshSet.

    Attributes
    ----------
    vertices : (n, 3) float64, optional
        New untransformed coordinates of the current mesh, which must have faces and finite coordinates.
    quality : (n,) float64, optional
        New quality of its vertices, equal for vertices at one place; see :func:`by_place`.
    step : str
        XML of a filter, to be appended to the filter script.
    """

    vertices: Floats | None = None
    quality: Floats | None = None
    step: str = ""


def push(ms: pymeshlab.MeshSet, vertices: Floats) -> None:
    """Give the current mesh new coordinates, to the bit; see :func:`write`."""
    write(ms, Change(vertices=vertices))


def push_quality(ms: pymeshlab.MeshSet, quality: Floats) -> Floats:
    """Give the vertices of the current mesh a quality; nothing else changes. See :func:`write`.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    quality : (n,) float64

    Returns
    -------
    (n,) float64
        What was written, to the bit: vertices at one place get the mean of theirs.
    """
    written = by_place(ms.current_mesh().vertex_matrix(), quality)
    write(ms, Change(quality=written))
    return written


def in_one_pass(before: Floats, wanted: Floats) -> Floats:
    """The coordinates closest to those wanted that MeshLab's morph reaches in a single pass, to the bit.

    It moves v to v + (t - v), which rounds where t is much smaller than v, as when a vertex crosses a coordinate plane.
    What is reached differs from what was wanted by no more than the last bit of the larger of both.

    Parameters
    ----------
    before, wanted : (n, 3) float64

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.meshset import in_one_pass
    >>> before, wanted = np.array([[1.0, 1.0, 1.0]]), np.array([[1.5, 0.1, -1e-20]])
    >>> reached = in_one_pass(before, wanted)
    >>> np.array_equal(before + (reached - before), reached), bool(abs(reached - wanted).max() < 2**-53)
    (True, True)
    """
    reached = np.empty_like(wanted)

    def reach(at: slice) -> None:
        v, t = before[at], reached[at]
        with np.errstate(invalid="ignore"):
            np.subtract(wanted[at], v, out=t)
        t += v
        rounded = (t != wanted[at]) & ~np.isnan(t)  # of vertices that no face uses
        if rounded.any():
            # once more, as t - v may round as well where t is the larger one
            t[rounded] = v[rounded] + (t[rounded] - v[rounded])

    blocks.parallel_rows(reach, len(wanted))
    return reached


def by_place(vertices: Floats, quality: Floats) -> Floats:
    """Quality of vertices, those at one place with the mean of theirs.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.meshset import by_place
    >>> by_place(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]]), np.array([1.0, 5, 2]))
    array([1.5, 5. , 1.5])
    """
    order = np.lexsort(vertices.T)
    ordered = vertices[order]
    is_first = np.ones(len(order), dtype=np.bool_)
    is_first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    group = np.empty(len(order), dtype=np.intp)
    group[order] = np.cumsum(is_first) - 1
    return np.asarray((np.bincount(group, weights=quality) / np.bincount(group))[group])


def write(ms: pymeshlab.MeshSet, change: Change, verbosity: Verbosity | None = None) -> None:
    """Make a change, to the bit and with nothing else changed, or raise with nothing changed at all.

    Only filters change a mesh inside a MeshSet: coordinates are morphed onto those of a temporary mesh, quality is
    transferred from one. Everything that hangs on the mesh stays, and so do the current mesh, the other meshes, the
    filter script (but for the step to be appended) and the verbosity; what the script then is, is made out when it is
    looked at (:mod:`meshlab_specsmooth.meshlab.records`). Normals and bounding box follow coordinates, as
    after MeshLab's own filters. The temporary mesh uses up one id: the next mesh that is added gets the one after it.

    An interrupt (Ctrl-C) waits until what runs in C++ is done. Then everything is put back; but a mesh that had no
    quality has one then, and vertices at one place, if theirs differed, the mean.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    change : Change
    verbosity : Verbosity, optional
        As :func:`verbosity_of` has it, if it is known.

    Raises
    ------
    MeshSetError
        The mesh did not take the coordinates or the quality; it has its old ones then.
    """
    mesh = ms.current_mesh()
    vertices, quality = mesh.vertex_matrix(), mesh.vertex_scalar_array() if mesh.has_vertex_scalar() else None
    if change.vertices is not None and change.vertices.shape != vertices.shape:
        raise MeshSetError(f"{len(change.vertices)} coordinates for a mesh of {len(vertices)} vertices")
    check_finite(vertices, is_moved=change.vertices is not None)
    if change.quality is not None and np.abs(vertices).max() > _FARTHEST_WITH_QUALITY:
        raise MeshSetError(
            f"coordinates beyond {_FARTHEST_WITH_QUALITY:.0e} take no vertex quality (pymeshlab crashes); scale them"
        )
    if change.quality is not None and not _takes_quality(mesh, change.quality):
        raise MeshSetError(
            "the mesh takes no vertex quality: distances between its vertices are lost in rounding; scale or center it"
        )
    known, used, noted = verbosity or verbosity_of(ms), list[Stand](), len(kept(ms).stands)

    def make(may_stop: Callable[[], None]) -> None:
        _silence(ms, known)
        if change.vertices is not None and not _move(ms, change.vertices, may_stop, used):
            raise MeshSetError(f"the mesh did not take its new coordinates in {MOST_MORPHING_PASSES} morphing passes")
        if change.quality is not None and not _transfer_quality(ms, change.quality, may_stop, used):
            raise MeshSetError("the mesh did not take its new vertex quality")
        if used:
            kept(ms).stands += [*used[:-1], replace(used[-1], step=change.step)]
        elif change.step:
            # nothing was recorded that could stand for it
            set_script(ms, _appended(script_of(ms), change.step))
        _speak(ms, known)

    def undo() -> None:
        _silence(ms, known)
        if not np.array_equal(mesh.vertex_matrix(), vertices, equal_nan=True):
            _move(ms, vertices, lambda: None, used)
        if quality is not None and not np.array_equal(mesh.vertex_scalar_array(), quality):
            _transfer_quality(ms, by_place(vertices, quality), lambda: None, used)
        if used:
            before = kept(ms).stands[:noted]
            set_script(ms, records.put_right(records.without_last(_native_script(ms), used), before))
        _speak(ms, known)

    all_or_nothing(make, undo)


def check_finite(vertices: Floats, is_moved: bool) -> None:
    """Refuse what pymeshlab would damage: NaN may stay where vertices are moved, all else must be finite."""
    with np.errstate(invalid="ignore"):
        if np.isfinite(vertices.sum()):
            return
    bad = np.isinf(vertices) if is_moved else ~np.isfinite(vertices)
    rows = np.flatnonzero(bad.any(axis=1))
    if len(rows):
        raise MeshSetError(
            f"vertex {rows[0]} is not finite: {vertices[rows[0]].tolist()}; remove vertices that no face uses first "
            "(meshing_remove_unreferenced_vertices)"
        )


def _move(ms: pymeshlab.MeshSet, vertices: Floats, may_stop: Callable[[], None], used: list[Stand]) -> bool:
    """Morph the current mesh onto ``vertices``; whether it arrived to the bit."""
    mesh = ms.current_mesh()
    with _temporary(ms, pymeshlab.Mesh(vertices), used) as target:  # faces would triple its cost, and are not looked at
        for _ in range(MOST_MORPHING_PASSES):
            may_stop()
            ms.compute_coord_linear_morphing(targetmesh=target, percentmorph=100.0)
            if np.array_equal(mesh.vertex_matrix(), vertices, equal_nan=True):
                return True
        return False


def _takes_quality(mesh: pymeshlab.Mesh, quality: Floats) -> bool:
    """Whether a transfer by place would arrive, tried on a copy: a quality cannot be taken away again."""
    copy = pymeshlab.MeshSet()
    other = np.where(quality == 0, 1.0, -quality)  # so that what did not arrive shows
    copy.add_mesh(pymeshlab.Mesh(mesh.vertex_matrix(), mesh.face_matrix(), v_scalar_array=other))
    return _transfer_quality(copy, quality, lambda: None, [])


def _transfer_quality(ms: pymeshlab.MeshSet, quality: Floats, may_stop: Callable[[], None], used: list[Stand]) -> bool:
    """Take quality over from a point cloud, by place; whether it arrived to the bit."""
    mesh, target = ms.current_mesh(), ms.current_mesh_id()
    # The filter that transfers attributes works on the mesh where its transform puts it, and moves it there and back,
    # which rounds: it must not see the transform.
    transform = mesh.transform_matrix()
    has_one = not np.array_equal(transform, np.eye(4))
    with _temporary(ms, pymeshlab.Mesh(mesh.vertex_matrix(), v_scalar_array=quality), used, int(has_one)) as source:
        may_stop()
        with _without(transform, ms) if has_one else contextlib.nullcontext():
            ms.transfer_attributes_per_vertex(
                sourcemesh=source, targetmesh=target, vertexsampling=True, colortransfer=False, qualitytransfer=True
            )
    return np.array_equal(mesh.vertex_scalar_array(), quality)


@contextlib.contextmanager
def _without(transform: Floats, ms: pymeshlab.MeshSet) -> Iterator[None]:
    ms.set_matrix(transformmatrix=np.eye(4), freeze=False)
    try:
        yield
    finally:
        ms.set_matrix(transformmatrix=transform, freeze=False)


@contextlib.contextmanager
def _temporary(ms: pymeshlab.MeshSet, mesh: pymeshlab.Mesh, used: list[Stand], ahead: int = 0) -> Iterator[int]:
    """The id of a mesh that is there for the time being, without being the current one; it is added to those used."""
    current = ms.current_mesh_id()
    ms.add_mesh(mesh, "", set_as_current=False)
    del mesh  # the MeshSet has its own copy
    temporary = max(int(m.id()) for m in ms)
    used.append(Stand(temporary, ahead))
    try:
        yield temporary
    finally:
        ms.set_current_mesh(temporary)
        ms.delete_current_mesh()
        ms.set_current_mesh(current)


def _silence(ms: pymeshlab.MeshSet, known: Verbosity) -> None:
    if any(known):
        _NATIVE_VERBOSITY(ms, False)
        _NATIVE_PARAMETER_VERBOSITY(ms, False)


def _speak(ms: pymeshlab.MeshSet, known: Verbosity) -> None:
    if any(known):
        _NATIVE_VERBOSITY(ms, known.everything)
        _NATIVE_PARAMETER_VERBOSITY(ms, known.parameters)


def verbosity_of(ms: pymeshlab.MeshSet) -> Verbosity:
    """What the MeshSet prints; it must have a mesh. It cannot be asked, so it is tried, once and without a trace."""
    known = kept(ms)
    if known.verbosity is None:
        with DeferInterrupts(), keeping_script(ms):
            known.verbosity = _tried_verbosity(ms)
    return known.verbosity


def _tried_verbosity(ms: pymeshlab.MeshSet) -> Verbosity:
    told = _what_a_filter_tells(ms)
    if not told:
        return Verbosity(False, False)
    _NATIVE_VERBOSITY(ms, False)
    without = _what_a_filter_tells(ms)
    # with everything on, a filter tells of its parameters as well, and one line more
    everything = told.count("\n") > without.count("\n")
    _NATIVE_VERBOSITY(ms, everything)
    return Verbosity(everything, bool(without))


def _what_a_filter_tells(ms: pymeshlab.MeshSet) -> str:
    """What is printed of a filter that does nothing, by C++ and by way of Python.

    Both count: pymeshlab silences C++'s streams for the whole process while a filter runs, and where threads run
    filters at once, they may stay so.
    """
    printed = io.StringIO()
    with native_output() as told, contextlib.redirect_stdout(printed):
        ms.set_selection_none(allfaces=False, allverts=False)
    return told[0] + printed.getvalue()


@contextlib.contextmanager
def keeping_script(ms: pymeshlab.MeshSet) -> Iterator[None]:
    """The filter script is afterward what it was before; interrupts must wait around it (:class:`DeferInterrupts`).

    pymeshlab records every filter and offers no way to drop the last one, so the script is saved, and loaded again
    afterward. Its files hold six digits of a number, and so does the script from then on: what was recorded with more
    digits before is replayed with six.
    """
    script = script_of(ms)
    try:
        yield
    finally:
        set_script(ms, script)


def script_of(ms: pymeshlab.MeshSet) -> str:
    """The MeshSet's filter script, as pymeshlab writes it."""
    with DeferInterrupts():
        put_script_right(ms)
        return _native_script(ms)


def put_script_right(ms: pymeshlab.MeshSet) -> None:
    """Have pymeshlab's record of a MeshSet's filters hold ours, and not those that stand for them."""
    if kept(ms).stands:
        with DeferInterrupts():
            set_script(ms, records.put_right(_native_script(ms), kept(ms).stands))


def _native_script(ms: pymeshlab.MeshSet) -> str:
    with DeferInterrupts(), temporary.folder() as folder:
        path = Path(folder) / "script.mlx"
        _NATIVE_SAVE(ms, str(path))
        return path.read_text(encoding="utf-8")


def set_script(ms: pymeshlab.MeshSet, text: str) -> None:
    """Make a text the MeshSet's filter script; without printing what is read, as pymeshlab does, verbose or not."""
    kept(ms).stands.clear()
    if "<filter " not in text:
        ms.clear_filter_script()
        return
    with DeferInterrupts(), temporary.folder() as folder:
        path = Path(folder) / "script.mlx"
        path.write_text(text, encoding="utf-8")
        with native_output():
            ms.clear_filter_script()
            _NATIVE_LOAD(ms, str(path))


def _appended(script: str, step: str) -> str:
    """A script with one more filter."""
    # as text: a session's script may be longer than one from a stranger is allowed to be
    start, end, rest = script.replace("<FilterScript/>", "<FilterScript></FilterScript>").rpartition("</FilterScript>")
    return start + step + end + rest


records.wrap(put_script_right)

# standard output and error belong to the process, so threads take turns
_streams = threading.RLock()


@contextlib.contextmanager
def native_output() -> Iterator[list[str]]:
    """Catch what C++ writes to standard output and error during one short call; afterward it is in the list.

    Interrupts must wait around it (:class:`DeferInterrupts`), or the process may be left without its standard output.
    """
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
