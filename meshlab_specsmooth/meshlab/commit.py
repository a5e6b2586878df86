"""Write vertices or vertex quality into a MeshSet, exactly and with nothing else changed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import MeshSetError
from meshlab_specsmooth.geometry.welding import unique_rows
from meshlab_specsmooth.meshlab.filter_script import discard_records, get_script, set_script
from meshlab_specsmooth.meshlab.filter_script_text import append_step
from meshlab_specsmooth.meshlab.records import Placeholder, Verbosity, state_of
from meshlab_specsmooth.meshlab.verbosity import restore, silence, verbosity_of
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.runtime.interrupts import all_or_nothing

# MeshLab moves v to v + (t - v), which is exact if t is between v / 2 and 2 v. Otherwise, as when a vertex crosses a
# coordinate plane, the first pass comes so close that the second is exact; a third has never been needed.
MAX_MORPHING_PASSES = 3

# pymeshlab crashes when it transfers attributes between meshes and squares of coordinates overflow
_MAX_COORDINATE_WITH_QUALITY = 1e150


@dataclass(frozen=True, eq=False)
class Change:
    """What to write into a MeshSet.

    Attributes
    ----------
    vertices : (n, 3) float64, optional
        New untransformed coordinates of the current mesh, which must have faces and finite coordinates.
    quality : (n,) float64, optional
        New quality of its vertices, equal for coincident vertices; see :func:`average_coincident`.
    step : str
        XML of a filter to append to the filter script.
    """

    vertices: Floats | None = None
    quality: Floats | None = None
    step: str = ""


def reachable_by_morph(before: Floats, wanted: Floats) -> Floats:
    """Return the coordinates closest to those wanted that MeshLab's morph reaches exactly in a single pass.

    The morph moves v to v + (t - v), which rounds if t is much smaller than v, as when a vertex crosses a coordinate
    plane. The result differs from ``wanted`` by at most the last bit of the larger of both.

    Parameters
    ----------
    before, wanted : (n, 3) float64

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.commit import reachable_by_morph
    >>> before, wanted = np.array([[1.0, 1.0, 1.0]]), np.array([[1.5, 0.1, -1e-20]])
    >>> reached = reachable_by_morph(before, wanted)
    >>> np.array_equal(before + (reached - before), reached), bool(abs(reached - wanted).max() < 2**-53)
    (True, True)
    """
    reached = np.empty_like(wanted)

    def reach(at: slice) -> None:
        v, t = before[at], reached[at]
        with np.errstate(invalid="ignore"):
            np.subtract(wanted[at], v, out=t)
        t += v
        rounded = (t != wanted[at]) & ~np.isnan(t)  # NaN: unreferenced vertices
        if rounded.any():
            # once more, as t - v may round as well if t is the larger one
            t[rounded] = v[rounded] + (t[rounded] - v[rounded])

    blocks.parallel_rows(reach, len(wanted))
    return reached


def average_coincident(vertices: Floats, quality: Floats) -> Floats:
    """Replace the quality of coincident vertices by their mean.

    Parameters
    ----------
    vertices : (n, 3) float64
    quality : (n,) float64

    Returns
    -------
    (n,) float64

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.commit import average_coincident
    >>> average_coincident(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]]), np.array([1.0, 5, 2]))
    array([1.5, 5. , 1.5])
    """
    _, group = unique_rows(vertices)
    return np.asarray((np.bincount(group, weights=quality) / np.bincount(group))[group])


def write(ms: pymeshlab.MeshSet, change: Change, verbosity: Verbosity | None = None) -> None:
    """Write a change exactly and with nothing else changed, or raise and leave the MeshSet unchanged.

    Only filters change a mesh inside a MeshSet: vertices are morphed to those of a temporary mesh, and quality is
    transferred from one. All other data of the mesh stays, and so do the current mesh, the other meshes, the filter
    script (apart from the appended step; see :mod:`meshlab_specsmooth.meshlab.records`) and the verbosity. Normals and
    bounding box follow the coordinates, as after MeshLab's own filters. The temporary mesh consumes one mesh id.

    An interrupt (Ctrl-C) waits for the running C++ call. Then everything is restored, except that a mesh that had no
    quality then has one, and coincident vertices of different quality have the mean.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    change : Change
    verbosity : Verbosity, optional
        As returned by :func:`verbosity_of`, if it is known.

    Raises
    ------
    MeshSetError
        The mesh did not take the coordinates or the quality; the old ones are restored.
    """
    mesh = ms.current_mesh()
    vertices, quality = mesh.vertex_matrix(), mesh.vertex_scalar_array() if mesh.has_vertex_scalar() else None
    _check(mesh, vertices, change)
    known, used, earlier = verbosity or verbosity_of(ms), list[Placeholder](), len(state_of(ms).placeholders)

    def make(allow_interrupt: Callable[[], None]) -> None:
        silence(ms, known)
        if change.vertices is not None and not _morph(ms, change.vertices, allow_interrupt, used):
            raise MeshSetError(f"the mesh did not take its new coordinates in {MAX_MORPHING_PASSES} morphing passes")
        if change.quality is not None and not _transfer_quality(ms, change.quality, allow_interrupt, used):
            raise MeshSetError("the mesh did not take its new vertex quality")
        if used:
            state_of(ms).placeholders += [*used[:-1], replace(used[-1], step=change.step)]
        elif change.step:
            # no helper filter has run, so there is no record that could stand for the step
            set_script(ms, append_step(get_script(ms), change.step))
        restore(ms, known)

    def undo() -> None:
        silence(ms, known)
        if not _are_equal(mesh.vertex_matrix(), vertices):
            _morph(ms, vertices, lambda: None, used)
        if quality is not None and not np.array_equal(mesh.vertex_scalar_array(), quality):
            _transfer_quality(ms, average_coincident(vertices, quality), lambda: None, used)
        if used:
            discard_records(ms, used, earlier)
        restore(ms, known)

    all_or_nothing(make, undo)


def check_finite(vertices: Floats, is_moved: bool) -> None:
    """Refuse coordinates that pymeshlab would damage: vertices to be moved may be NaN, all others must be finite."""
    with np.errstate(invalid="ignore"):
        if np.isfinite(vertices.sum()):
            return
    bad = np.isinf(vertices) if is_moved else ~np.isfinite(vertices)
    rows = np.flatnonzero(bad.any(axis=1))
    if len(rows):
        raise MeshSetError(
            f"vertex {rows[0]} is not finite: {vertices[rows[0]].tolist()}; first remove vertices that no face uses "
            "(meshing_remove_unreferenced_vertices)"
        )


def _check(mesh: pymeshlab.Mesh, vertices: Floats, change: Change) -> None:
    """Refuse a change that the mesh cannot take, before anything is changed."""
    if change.vertices is not None and change.vertices.shape != vertices.shape:
        raise MeshSetError(f"{len(change.vertices)} coordinates for a mesh of {len(vertices)} vertices")
    check_finite(vertices, is_moved=change.vertices is not None)
    if change.quality is None:
        return
    if np.abs(vertices).max() > _MAX_COORDINATE_WITH_QUALITY:
        raise MeshSetError(
            f"with coordinates beyond {_MAX_COORDINATE_WITH_QUALITY:.0e} vertex quality cannot be set (pymeshlab "
            "crashes); scale the mesh"
        )
    if not _takes_quality(mesh, change.quality):
        raise MeshSetError(
            "vertex quality cannot be set: distances between the vertices are lost in rounding; scale or center the "
            "mesh"
        )


def _morph(
    ms: pymeshlab.MeshSet, vertices: Floats, allow_interrupt: Callable[[], None], used: list[Placeholder]
) -> bool:
    """Morph the current mesh to ``vertices``; returns whether it reached them exactly."""
    mesh = ms.current_mesh()
    # without faces, which are not used and would triple its cost
    with _temporary_mesh(ms, pymeshlab.Mesh(vertices), used) as target:
        for _ in range(MAX_MORPHING_PASSES):
            allow_interrupt()
            ms.compute_coord_linear_morphing(targetmesh=target, percentmorph=100.0)
            if _are_equal(mesh.vertex_matrix(), vertices):
                return True
        return False


def _are_equal(a: Floats, b: Floats) -> bool:
    """Whether two arrays are equal to the bit, or both not numbers; looking for those takes several times as long."""
    return np.array_equal(a, b) or np.array_equal(a, b, equal_nan=True)


def _takes_quality(mesh: pymeshlab.Mesh, quality: Floats) -> bool:
    """Try the transfer on a copy, as a mesh cannot be deprived of its quality again."""
    copy = pymeshlab.MeshSet()
    other = np.where(quality == 0, 1.0, -quality)  # different everywhere, so that missing values show
    copy.add_mesh(pymeshlab.Mesh(mesh.vertex_matrix(), mesh.face_matrix(), v_scalar_array=other))
    return _transfer_quality(copy, quality, lambda: None, [])


def _transfer_quality(
    ms: pymeshlab.MeshSet, quality: Floats, allow_interrupt: Callable[[], None], used: list[Placeholder]
) -> bool:
    """Transfer quality from a point cloud by position; returns whether it arrived exactly."""
    mesh, target = ms.current_mesh(), ms.current_mesh_id()
    # The filter applies the transform of the mesh and its inverse to the coordinates, which rounds: hide the transform
    transform = mesh.transform_matrix()
    has_one = not np.array_equal(transform, np.eye(4))
    with _temporary_mesh(
        ms, pymeshlab.Mesh(mesh.vertex_matrix(), v_scalar_array=quality), used, preceding=int(has_one)
    ) as source:
        allow_interrupt()
        with _untransformed(ms, transform) if has_one else contextlib.nullcontext():
            ms.transfer_attributes_per_vertex(
                sourcemesh=source, targetmesh=target, vertexsampling=True, colortransfer=False, qualitytransfer=True
            )
    return np.array_equal(mesh.vertex_scalar_array(), quality)


@contextlib.contextmanager
def _untransformed(ms: pymeshlab.MeshSet, transform: Floats) -> Iterator[None]:
    ms.set_matrix(transformmatrix=np.eye(4), freeze=False)
    try:
        yield
    finally:
        ms.set_matrix(transformmatrix=transform, freeze=False)


@contextlib.contextmanager
def _temporary_mesh(
    ms: pymeshlab.MeshSet, mesh: pymeshlab.Mesh, used: list[Placeholder], preceding: int = 0
) -> Iterator[int]:
    """Add a mesh for the duration of the block, without making it the current one; yields its id, noted in ``used``."""
    current = ms.current_mesh_id()
    ms.add_mesh(mesh, "", set_as_current=False)
    del mesh  # the MeshSet has its own copy
    temporary = max(int(m.id()) for m in ms)
    used.append(Placeholder(temporary, preceding))
    try:
        yield temporary
    finally:
        ms.set_current_mesh(temporary)
        ms.delete_current_mesh()
        ms.set_current_mesh(current)
