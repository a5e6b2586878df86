"""How far a surface deviates from another one, along the normals."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, recognize
from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.comparison.distances import distances
from meshlab_specsmooth.comparison.signed_distances import signed_distances
from meshlab_specsmooth.describe import Described, Pictured, Rows
from meshlab_specsmooth.errors import InvalidSurface
from meshlab_specsmooth.geometry.surface import Surface, mean_edge_length
from meshlab_specsmooth.geometry.triangles import compute_vertex_normals
from meshlab_specsmooth.geometry.welding import find_copies
from meshlab_specsmooth.operators.assemble import find_referenced_vertices
from meshlab_specsmooth.parameters import check_extent, resolve_length
from meshlab_specsmooth.smoothing.result import FilterResult

# Worst places: at most so many, which are further from each other than this fraction of the diagonal
_MAX_PLACES = 5
_APART = 0.05

_BINS = 41
_QUANTILES = (0.5, 0.95, 0.99)


@dataclass(frozen=True)
class Place:
    """A vertex, its position in mesh units, and its signed distance."""

    vertex: int
    position: tuple[float, float, float]
    distance: float


@dataclass(frozen=True, eq=False, repr=False)
class Deviation(Described):
    """The deviation of a surface ``after`` from a surface ``before``.

    Attributes
    ----------
    distances : (n,) float64
        Signed distance of each vertex of ``after`` in mesh units, positive on the side of the normals of ``before``;
        0 for vertices without a face.
    vertices, faces : (n, 3) float64, (m, 3) int32
        The surface ``after``.
    before : Surface
    tolerance : float or None
        In mesh units.
    corresponds : bool
        Whether both have the same faces. Then a distance is the displacement of the vertex along the normal of
        ``before``; else it is the exact distance to the surface ``before``.
    largest_displacement : float or None
        The largest distance between a vertex and itself, if the vertices correspond.
    largest_uncovered : float or None
        The largest distance from a vertex of ``before`` to the surface ``after``, if the vertices do not correspond: it
        is large where a part is missing in ``after``.
    """

    distances: Floats
    vertices: Floats
    faces: npt.NDArray[np.int32]
    before: Surface
    tolerance: float | None
    corresponds: bool
    largest_displacement: float | None = None
    largest_uncovered: float | None = None

    @functools.cached_property
    def is_used(self) -> Booleans:
        """(n,) whether a face refers to the vertex; all numbers are of these vertices."""
        return find_referenced_vertices(self.faces, len(self.vertices))

    @property
    def count(self) -> int:
        """Number of vertices that were measured."""
        return int(self.is_used.sum())

    @property
    def mean(self) -> float:
        """Mean signed distance."""
        return float(self.distances[self.is_used].mean())

    @property
    def rms(self) -> float:
        """Root mean square distance."""
        return float(np.sqrt(np.square(self.distances[self.is_used]).mean()))

    @property
    def highest(self) -> float:
        """The largest distance on the side of the normals, or 0."""
        return float(self.distances.max(initial=0.0))

    @property
    def lowest(self) -> float:
        """The largest distance on the other side, as a negative number, or 0."""
        return float(self.distances.min(initial=0.0))

    @property
    def largest(self) -> float:
        """The largest distance without its sign."""
        return max(self.highest, -self.lowest)

    @property
    def outside(self) -> int:
        """Number of vertices beyond the tolerance; 0 without one."""
        return 0 if self.tolerance is None else int((np.abs(self.distances) > self.tolerance).sum())

    @property
    def share_within(self) -> float:
        """Fraction of the vertices within the tolerance; 1 without one."""
        return 1 - self.outside / self.count

    @property
    def is_within(self) -> bool:
        """Whether no vertex is beyond the tolerance; True without one."""
        return self.outside == 0

    def worst(self, count: int = _MAX_PLACES) -> tuple[Place, ...]:
        """Return the vertices of largest distance that are apart from each other by 5 % of the diagonal, worst first.

        With a tolerance, only those that are beyond it.
        """
        left = np.where(self.is_used, np.abs(self.distances), 0.0)
        X = self.vertices[self.faces]
        apart = _APART * math.hypot(*(X.max(axis=(0, 1)) - X.min(axis=(0, 1))))
        found: list[Place] = []
        while len(found) < count:
            at = int(left.argmax())
            if left[at] <= (self.tolerance or 0.0):
                break
            x, y, z = self.vertices[at].tolist()
            found.append(Place(at, (x, y, z), float(self.distances[at])))
            with np.errstate(invalid="ignore"):  # vertices without a face may be NaN
                left[np.linalg.norm(self.vertices - self.vertices[at], axis=1) <= apart] = 0.0
        return tuple(found)

    def histogram(self, bins: int = _BINS) -> tuple[npt.NDArray[np.int64], Floats]:
        """Return the number of vertices in each of some bins of the same width, and their (bins + 1,) limits."""
        reach = self.largest or self.tolerance or 1.0
        counts, limits = np.histogram(self.distances[self.is_used], bins, (-reach, reach))
        return counts.astype(np.int64), limits

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as a dict for JSON, with worst places and histogram and without the field."""
        counts, limits = self.histogram()
        size = np.abs(self.distances[self.is_used])
        names = ("tolerance", "is_within", "share_within", "outside", "count", "mean", "rms", "highest", "lowest")
        return {
            **{name: getattr(self, name) for name in names},
            "quantiles": {f"{q:g}": float(np.quantile(size, q)) for q in _QUANTILES},
            "corresponds": self.corresponds,
            "largest_displacement": self.largest_displacement,
            "largest_uncovered": self.largest_uncovered,
            "worst": [{"vertex": p.vertex, "position": list(p.position), "distance": p.distance} for p in self.worst()],
            "histogram": {"counts": counts.tolist(), "limits": limits.tolist()},
        }

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        extremes = f"from {self.lowest:.4g} to {self.highest:+.4g}, RMS {self.rms:.4g}"
        if self.tolerance is None:
            return f"deviation {extremes}"
        number = (
            f"all {self.count} vertices within" if self.is_within else f"{self.outside} of {self.count} vertices beyond"
        )
        return f"{number} the tolerance of {self.tolerance:.4g}: deviation {extremes}"

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        size = np.abs(self.distances[self.is_used])
        half, most, nearly_all = (float(np.quantile(size, q)) for q in _QUANTILES)
        edge = mean_edge_length(self.before)
        rows = [
            ("quantiles", f"50 % below {half:.4g}, 95 % below {most:.4g}, 99 % below {nearly_all:.4g}"),
            ("mean", f"{self.mean:+.4g}"),
        ]
        if self.tolerance is not None:
            rows.insert(0, ("within", f"{_percent(self.share_within)} of {self.count} vertices"))
        if self.largest_displacement is not None:
            rows.append(("displacement", f"at most {self.largest_displacement:.4g}"))
        if self.largest_uncovered is not None:
            rows.append(("uncovered", f"before is at most {self.largest_uncovered:.4g} away from after"))
        for number, place in enumerate(self.worst(), start=1):
            x, y, z = place.position
            rows.append((f"worst {number}", f"{place.distance:+.4g} at ({x:.4g}, {y:.4g}, {z:.4g})"))
        return [*rows, ("mean edge", f"{edge:.4g}")]

    def pictured(self) -> Pictured | None:
        """Before and after, if their vertices correspond."""
        return (self.before.vertices, self.vertices, self.faces) if self.corresponds else None


def deviation(
    before: Mesh,
    after: Mesh | FilterResult,
    *,
    tolerance: float | str | None = None,
    faces: npt.ArrayLike | None = None,
) -> Deviation:
    """Measure how far a surface deviates from another one, along the normals.

    If both have the same faces, as before and after a filter, the distance of a vertex is its displacement along the
    normal of ``before``. Otherwise it is the exact distance from the vertex to the surface ``before``, whose sign is
    that of the normal there; distances between vertices of ``after`` are not sampled.

    Parameters
    ----------
    before : (n, 3) real array, or a mesh of any kind
        The reference; see :func:`meshlab_specsmooth.smooth` for the kinds of meshes.
    after : the same, or the result of a filter
        Need not have the vertices or the kind of ``before``. Vertices alone are those of the faces of ``before``.
    tolerance : float or str, optional
        A length in mesh units, or a percentage of the diagonal of the bounding box of ``before`` such as ``"0.1%"``.
    faces : (m, 3) integer array, optional
        Of ``before``, if that is an array, and of ``after``, if that is one too.

    Returns
    -------
    Deviation
        ``is_within`` states whether the tolerance is kept, ``worst()`` where it is not; see also
        :func:`meshlab_specsmooth.draw_deviation` and :func:`meshlab_specsmooth.write_deviation`.

    Raises
    ------
    InvalidParameter
    InvalidSurface
    FileError

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> V, F = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    >>> found = mss.deviation((V, F), V + [0, 0, 0.1], tolerance=0.05)
    >>> found.is_within, found.outside, found.mean
    (False, 4, 0.1)
    >>> print(found.summary)
    4 of 4 vertices beyond the tolerance of 0.05: deviation from 0 to +0.1, RMS 0.1
    """
    if tolerance is not None:
        tolerance = check_extent("tolerance", tolerance)
    reference = recognize(before, faces, "before").surface()
    moved = _surface_after(after, reference, faces)
    of_reference = reference.vertices[find_referenced_vertices(reference.faces, len(reference.vertices))]
    length = None if tolerance is None else resolve_length(tolerance, of_reference)
    is_used = find_referenced_vertices(moved.faces, len(moved.vertices))
    found = np.zeros(len(moved.vertices))
    corresponds = len(moved.vertices) == len(reference.vertices) and np.array_equal(moved.faces, reference.faces)
    if corresponds:
        change = moved.vertices[is_used] - reference.vertices[is_used]
        found[is_used] = np.einsum("ij,ij->i", change, _normals(reference, is_used)[is_used])
        furthest = float(np.sqrt(np.einsum("ij,ij->i", change, change).max()))
        return Deviation(found, moved.vertices, moved.faces, reference, length, corresponds, furthest)
    found[is_used] = signed_distances(moved.vertices[is_used], reference)
    uncovered = float(distances(of_reference, moved).max())
    return Deviation(found, moved.vertices, moved.faces, reference, length, corresponds, None, uncovered)


def _surface_after(after: Mesh | FilterResult, reference: Surface, faces: npt.ArrayLike | None) -> Surface:
    """The surface ``after``: of a result, of a mesh, or of vertices with the faces of ``before``."""
    if isinstance(after, FilterResult):
        if after.given is None:
            raise InvalidSurface("after", "is a result without faces", "pass vertices and faces, or a mesh")
        return Surface(after.vertices, after.given.faces)
    if isinstance(after, np.ndarray | list):
        return recognize(after, reference.faces if faces is None else faces, "after").surface()
    return recognize(after, None, "after").surface()


def _normals(surface: Surface, is_used: Booleans) -> Floats:
    """(n, 3) vertex normals; vertices at the same place have the same."""
    copies = find_copies(surface.vertices, is_used)
    normals = compute_vertex_normals(surface.vertices, surface.faces if copies is None else copies[surface.faces])
    return normals if copies is None else normals[copies]


def _percent(share: float) -> str:
    """A percentage, never rounded to 100."""
    return "100 %" if share == 1 else f"{min(100 * share, 99.99):.4g} %"
