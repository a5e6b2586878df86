"""Surfaces of several labels that share borders: tissues, grains, materials."""

from __future__ import annotations

import functools
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, Source, recognize
from meshlab_specsmooth.adapters.face_labels import find_labels
from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.describe import Rows, count_of, format_length
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.geometry.triangles import compute_face_vectors, number_edges
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.operators.assemble import assemble_surface, find_referenced_vertices
from meshlab_specsmooth.operators.boundary import boundary_curve
from meshlab_specsmooth.operators.curves import trace_curves
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import Progress, finish, subrange
from meshlab_specsmooth.smoothing.automatic import smooth_operators
from meshlab_specsmooth.smoothing.limit import limit_displacement
from meshlab_specsmooth.smoothing.result import FilterResult, SmoothingResult, add_warnings
from meshlab_specsmooth.smoothing.settings import Region, Smoothing

Indices = npt.NDArray[np.int64]

#: The label of what is no body, where faces have two labels.
BACKGROUND = 0

# Fraction of the time that assembling takes
_ASSEMBLY = 0.25
_SHOWN = 8


@dataclass(frozen=True)
class LabelVolume:
    """A label, and its volume before and after, in cubic mesh units; None where its faces do not close a body."""

    label: int
    before: float | None
    after: float | None

    @property
    def change(self) -> float | None:
        """Relative change of the volume."""
        if self.before is None or self.after is None or self.before == 0:
            return None
        return self.after / self.before - 1


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LabelResult(FilterResult):
    """The surfaces of all labels, and the evidence. Further fields are those of :class:`FilterResult`.

    Attributes
    ----------
    smoothing : SmoothingResult
        Of all surfaces together, each place and each shared face once: noise, weight, estimated error.
    labels : tuple of LabelVolume
    shared : int
        Number of places at which vertices of two labels or more lie.
    still_shared : int
        Number of these at which they all lie, to the bit, in the result.
    curves : int
        Number of border curves, which are smoothed along themselves.
    sources : tuple of Source
        The meshes given, if several were.
    """

    smoothing: SmoothingResult
    labels: tuple[LabelVolume, ...]
    shared: int
    still_shared: int
    curves: int
    sources: tuple[Source, ...] = ()

    @functools.cached_property
    def meshes(self) -> list[Mesh]:
        """The meshes with the new positions, each of the kind that was given; one if one was given."""
        if not self.sources:
            return [self.mesh]
        bounds = np.cumsum([0, *(len(source.vertices) for source in self.sources)])
        parts = zip(self.sources, bounds[:-1], bounds[1:], strict=True)
        return [source.moved(self.vertices[start:end]) for source, start, end in parts]

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        bodies = f"{count_of(len(self.labels), 'label')}, {count_of(self.curves, 'border curve')}"
        return f"{bodies}, {self.still_shared} of {self.shared} shared vertices still shared; {self.smoothing.summary}"

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        rows = [(f"label {each.label}", _describe(each)) for each in self.labels[:_SHOWN]]
        if len(self.labels) > _SHOWN:
            rows.append(("labels", f"{len(self.labels) - _SHOWN} more in .labels"))
        moved = ("moved", f"{format_length(self.displacement, self.smoothing.mean_edge)} (RMS)")
        rows += [moved, ("time", f"{self.seconds:.2f} s")]
        return rows if self.warning is None else [*rows, ("warning", self.warning)]

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the cached meshes."""
        return {name: value for name, value in super().__getstate__().items() if name != "meshes"}


def smooth_surfaces(
    mesh: Mesh,
    faces: Any,
    setting: Smoothing,
    region: Region,
    labels: Any,
    laplacian: str,
    progress: Progress | None,
) -> LabelResult:
    """Smooth the surfaces of several labels; see :func:`meshlab_specsmooth.smooth_labels`."""
    began = time.perf_counter()
    progress = begin(progress, "assembling")
    sources, surface, of_faces = _gather(mesh, faces, labels)
    unique, place = _join_places(surface)
    patches, keys = _unite_faces(unique, of_faces)
    ops = assemble_surface(Surface(unique.vertices, patches), laplacian, weld=False)
    border, rim = _find_borders(ops.faces, keys)
    ops = replace(ops, boundary=boundary_curve(ops.positions, border.astype(np.int32)))
    stays = np.zeros(len(unique.vertices), dtype=np.bool_)
    stays[ops.active[rim]] = True
    where = replace(region, boundary="curve", mask=~stays if stays.any() else None)
    work = subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY)
    smoothed = limit_displacement(smooth_operators(ops, setting, where, progress=work), where, ops)
    vertices = surface.vertices.copy()
    is_used = place >= 0
    vertices[is_used] = smoothed.vertices[place[is_used]]
    finish(progress)
    shared = _find_shared(unique.faces, of_faces, is_two_sided=of_faces.shape[1] > 1)
    result = LabelResult(
        vertices=vertices,
        displacement=smoothed.displacement,
        kernels=smoothed.kernels,
        seconds=time.perf_counter() - began,
        outliers=smoothed.outliers,
        limited=smoothed.limited,
        source=sources[0] if len(sources) == 1 and not isinstance(mesh, list) else None,
        given=surface,
        smoothing=smoothed,
        labels=measure_volumes(surface, vertices, of_faces),
        shared=len(shared),
        still_shared=_count_together(place, vertices, is_used, shared),
        curves=len(trace_curves(border)),
        sources=tuple(sources) if isinstance(mesh, list) else (),
    )
    return add_warnings(result, *ops.notes, smoothed.warning)


def _gather(mesh: Any, faces: Any, labels: Any) -> tuple[list[Source], Surface, Indices]:
    """The meshes, all of their triangles as one surface, and the labels (m, 1) or (m, 2) of these."""
    if isinstance(mesh, list) and faces is None and labels is None:
        sources = [recognize(each, None, f"mesh[{number}]") for number, each in enumerate(mesh)]
        if not sources:
            raise InvalidParameter("mesh is an empty list; pass a mesh, or a list of meshes")
        surfaces = [source.surface() for source in sources]
        starts = np.cumsum([0, *(len(each.vertices) for each in surfaces[:-1])])
        vertices = np.concatenate([each.vertices for each in surfaces])
        together = np.concatenate([each.faces + start for each, start in zip(surfaces, starts, strict=True)])
        numbers = np.repeat(np.arange(len(surfaces)), [len(each.faces) for each in surfaces])
        return [source.kept() for source in sources], Surface(vertices, together), numbers[:, None]
    if labels is None:
        raise InvalidParameter("labels is None; pass the labels of the faces, or a list of meshes without faces")
    source = recognize(mesh, faces)
    surface = source.surface()
    count = len(surface.faces) if source.polygons is None else int(source.polygons.max()) + 1
    of_faces = find_labels(mesh, labels, count)
    return [source.kept()], surface, of_faces if source.polygons is None else of_faces[source.polygons]


def _join_places(surface: Surface) -> tuple[Surface, Indices]:
    """The surface with one vertex at each place, and the (n,) index of each vertex there, -1 if no face uses it."""
    V, F = surface.vertices, surface.faces
    is_used = find_referenced_vertices(F, len(V))
    copies = find_copies(V, is_used)
    first = np.arange(len(V)) if copies is None else copies.astype(np.int64)
    is_first = is_used & (first == np.arange(len(V)))
    number = np.cumsum(is_first) - 1
    place = np.where(is_used, number[first], -1)
    return Surface(V[is_first], place[F]), place


def _unite_faces(surface: Surface, labels: Indices) -> tuple[npt.NDArray[np.int32], Indices]:
    """Faces each once, whichever way they turn, and for each a number that says which labels it has."""
    corners = np.sort(surface.faces, axis=1)
    _, first, group = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    pairs = np.stack([np.repeat(group, labels.shape[1]), labels.ravel()], axis=1)
    pairs = np.unique(pairs, axis=0)
    # the labels of a face as one number: that of the combination
    count = np.bincount(pairs[:, 0], minlength=len(first))
    table = np.full((len(first), int(count.max())), np.iinfo(np.int64).min)
    column = np.arange(len(pairs)) - np.repeat(np.cumsum(count) - count, count)
    table[pairs[:, 0], column] = pairs[:, 1]
    _, keys = np.unique(table, axis=0, return_inverse=True)
    order = np.argsort(first)  # as the faces were
    return surface.faces[first[order]], keys.ravel()[order].astype(np.int64)


def _find_borders(F: npt.NDArray[np.int32], keys: Indices) -> tuple[Indices, Indices]:
    """The edges (b, 2) where other than two faces of the same labels meet, and the vertices of edges with one face."""
    edges, edge = number_edges(F, int(F.max(initial=0)) + 1)
    count = np.bincount(edge.ravel())
    lowest, highest = np.full(len(edges), np.iinfo(np.int64).max), np.full(len(edges), -1)
    np.minimum.at(lowest, edge, keys[:, None])
    np.maximum.at(highest, edge, keys[:, None])
    is_border = (count != 2) | (lowest != highest)
    return edges[is_border], np.unique(edges[count == 1])


def _find_shared(F: npt.NDArray[np.int32], labels: Indices, is_two_sided: bool) -> Indices:
    """The places at which faces of two labels or more meet; the background is none."""
    pairs = np.stack([np.repeat(F.ravel(), labels.shape[1]), np.repeat(labels, 3, axis=0).ravel()], axis=1)
    if is_two_sided:
        pairs = pairs[pairs[:, 1] != BACKGROUND]
    at, count = np.unique(np.unique(pairs, axis=0)[:, 0], return_counts=True)
    return at[count > 1].astype(np.int64)


def _count_together(place: Indices, vertices: Floats, is_used: Booleans, shared: Indices) -> int:
    """The number of shared places whose vertices are all at one place in the result, to the bit."""
    at, X = place[is_used], vertices[is_used]
    low, high = np.full((at.max() + 1, 3), np.inf), np.full((at.max() + 1, 3), -np.inf)
    np.minimum.at(low, at, X)
    np.maximum.at(high, at, X)
    return int((low[shared] == high[shared]).all(axis=1).sum())


def measure_volumes(surface: Surface, after: Floats, labels: Indices) -> tuple[LabelVolume, ...]:
    """Return the volume of each label before and after.

    Parameters
    ----------
    surface : Surface
    after : (n, 3) float64
    labels : (m, 1) or (m, 2) int64
        With two, the label behind each face and that in front of it.
    """
    F = surface.faces.astype(np.int64)
    is_two_sided = labels.shape[1] > 1
    known = np.unique(labels[labels != BACKGROUND] if is_two_sided else labels)
    contributions = [_signed_parts(X, F) for X in (surface.vertices, after)]
    found = []
    for label in known.tolist():
        sign = (labels[:, 0] == label).astype(np.int64) - (labels[:, 1] == label if is_two_sided else 0)
        if not _is_closed(F, sign, surface.vertices):
            found.append(LabelVolume(label, None, None))
            continue
        before, now = (abs(float((sign * parts).sum())) for parts in contributions)
        found.append(LabelVolume(label, before, now))
    return tuple(found)


def _signed_parts(X: Floats, F: Indices) -> Floats:
    """(m,) volumes of the tetrahedra between the faces and the middle of the surface, by the sides of the faces."""
    center = X[F].mean(axis=(0, 1))
    return np.asarray(np.einsum("ij,ij->i", X[F[:, 0]] - center, compute_face_vectors(X, F.astype(np.int32))) / 6)


def _is_closed(F: Indices, sign: Indices, V: Floats) -> bool:
    """Whether the faces, each as often and in the direction that its sign says, have no border."""
    taken = sign != 0
    if not taken.any():
        return False
    copies = find_copies(V, find_referenced_vertices(F[taken], len(V)))
    own = F[taken] if copies is None else copies[F[taken]].astype(np.int64)
    _, edge = number_edges(own, len(V))
    turns = sign[taken, None] * np.sign(own[:, [1, 2, 0]] - own)
    return not np.bincount(edge.ravel(), turns.ravel()).any()


def _describe(each: LabelVolume) -> str:
    if each.before is None or each.after is None:
        return "not closed, so without a volume"
    change = "" if each.change is None else f" ({100 * each.change:+.2f} %)"
    return f"volume {each.before:.6g}, now {each.after:.6g}{change}"


def list_labels(result: LabelResult) -> Sequence[dict[str, Any]]:
    """Return labels and volumes as dicts for JSON."""
    return [{"label": each.label, "before": each.before, "after": each.after} for each in result.labels]
