"""Smoothing of the boundary alone: jagged rims of scans and of meshes that were cut."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import splu

from meshlab_specsmooth.adapters import Mesh, accept_meshes
from meshlab_specsmooth.arrays import Booleans, Floats
from meshlab_specsmooth.describe import Rows, count_of, format_length
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.triangles import compute_face_vectors
from meshlab_specsmooth.operators.assemble import Operators, as_operators
from meshlab_specsmooth.operators.curves import Curve, find_corners, low_pass_curve, split_curve, trace_curves
from meshlab_specsmooth.parameters import check_count, check_extent, check_length, check_number, resolve_length
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import Progress, announce, finish, subrange
from meshlab_specsmooth.smoothing.filter import move_vertices
from meshlab_specsmooth.smoothing.limit import find_limited, project
from meshlab_specsmooth.smoothing.region import spread_weights
from meshlab_specsmooth.smoothing.result import FilterResult, add_warnings

#: Default wavelength in mean segments of the boundary, rings that follow, and angle of corners in degrees.
WAVELENGTH_IN_SEGMENTS = 12.0
RINGS = 3
CORNER_ANGLE = 60.0

MAX_RINGS = 100

# A curve whose jags have less than this RMS, in its mean segments, is left as it is
_SMALLEST_JAGS = 0.02

# Fraction of the time that the operators take
_ASSEMBLY = 0.6


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class BoundaryResult(FilterResult):
    """The surface with a smooth boundary, and the evidence. Further fields are those of :class:`FilterResult`.

    Attributes
    ----------
    wavelength : float
        Along the boundary, at which waves keep half of their height; in mesh units.
    curves : int
        Number of boundary curves, between points where more than two boundary edges meet.
    smoothed : int
        Number of those that were smoothed; the others have no jags, or are shorter than the wavelength.
    corners : int
        Number of corners that were kept.
    rings : int
        Rings of inner vertices that followed.
    boundary_displacement : float
        Root mean square displacement of the vertices on the curves that were smoothed, in mesh units.
    flips : int
        Faces that were turned over.
    mean_segment : float
        Mean length of the boundary edges, in mesh units.
    """

    wavelength: float
    curves: int
    smoothed: int
    corners: int
    rings: int
    boundary_displacement: float
    flips: int
    mean_segment: float

    @property
    def summary(self) -> str:
        """Summary of the result in one sentence."""
        if self.smoothed == 0:
            return self._describe_unmoved(None)
        kept = f", {count_of(self.corners, 'corner')} kept" if self.corners else ""
        moved = f"moved by {format_length(self.boundary_displacement, self.mean_segment)} (RMS)"
        return f"{self.smoothed} of {count_of(self.curves, 'boundary curve')} smoothed{kept}, {moved}"

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        return [
            ("wavelength", format_length(self.wavelength, self.mean_segment)),
            ("rings", f"{count_of(self.rings, 'ring')} of inner vertices followed"),
            ("flips", f"{count_of(self.flips, 'face')} turned over"),
            *self._final_rows(self.mean_segment),
        ]


@accept_meshes
def smooth_boundary(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    wavelength: float | None = None,
    rings: int = RINGS,
    corner_angle: float = CORNER_ANGLE,
    mask: npt.ArrayLike | None = None,
    max_displacement: float | str | None = None,
    weld: bool = True,
    progress: Progress | None = None,
) -> BoundaryResult:
    """Smooth the boundary of a surface along itself, and leave the rest of the surface as it is.

    The three steps of the paper are applied to the curves of the boundary: the uniform Laplacian of a curve, a low-pass
    that removes all differential coordinates, and a reconstruction that keeps the midpoints of the segments
    (:func:`meshlab_specsmooth.operators.curves.low_pass_curve`). Corners stay, closed curves do not shrink, and curves
    without jags are returned to the bit. A few rings of inner vertices follow, by a displacement that is harmonic.

    Parameters
    ----------
    mesh, faces
        As for :func:`meshlab_specsmooth.smooth`.
    wavelength : float, optional
        Along the boundary, at which waves keep half of their height, in mesh units; shorter ones are removed. The
        default is 12 mean boundary edges. Curves that are shorter are left as they are.
    rings : int
        Rings of inner vertices that follow the boundary; with 0 they stay.
    corner_angle : float
        Where the boundary, seen over a few of its edges, turns by more than this angle in degrees, it has a corner that
        stays; 180: none.
    mask : (n,) real array, optional
        Weights in [0, 1] by which the displacements of boundary vertices are multiplied.
    max_displacement : float or str, optional
        The largest distance that a vertex may move, in mesh units or in percent of the diagonal of the bounding box,
        such as ``"0.1%"``; see :func:`meshlab_specsmooth.smooth`.
    weld, progress
        As for :func:`meshlab_specsmooth.smooth`; so are the errors.

    Returns
    -------
    BoundaryResult

    Examples
    --------
    A flat sheet with a zigzag along one side:

    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(30.0), np.arange(30.0)))
    >>> at = (np.arange(29)[:, None] * 30 + np.arange(29)).ravel()
    >>> faces = np.concatenate([np.c_[at, at + 1, at + 31], np.c_[at, at + 31, at + 30]])
    >>> sheet = np.c_[x, y + 0.4 * (-1) ** x * (y == 0), 0 * x]
    >>> result = mss.smooth_boundary(sheet, faces)
    >>> result.corners, bool(np.abs(result.vertices[5:25, 1]).max() < 0.05)
    (4, True)
    """
    began = time.perf_counter()
    wavelength = None if wavelength is None else check_length("wavelength", wavelength)
    rings = check_count("rings", rings, 0, MAX_RINGS)
    corner_angle = check_number("corner_angle", corner_angle, 0.0, 180.0)
    limit = None if max_displacement is None else check_extent("max_displacement", max_displacement)
    progress = begin(progress, "assembling")
    ops = as_operators(mesh, faces, "uniform", weld=weld, progress=subrange(progress, 0.0, _ASSEMBLY))
    weights = None if mask is None else spread_weights(ops, "mask", mask)
    announce(progress, "smoothing")
    made = _smooth_curves(ops, wavelength, corner_angle, weights)
    limited = 0
    if limit is not None and ops.boundary is not None and made.displacement.any():
        radius = float(np.ldexp(resolve_length(limit, ops.surface.vertices), -ops.exponent))
        at = ops.boundary.vertices
        cut = 1 - np.cos(2 * np.pi / made.wavelength_in_segments)
        gram = ops.boundary.gram.scaled(cut**2 / (1 - cut / 2))  # the weight at which the curve is smoothed
        made.displacement[at] = project(ops.boundary.L, gram, made.displacement[at], radius)
        limited = int(find_limited(made.displacement[at], radius).sum())
    displacement = _let_follow(ops, made.displacement, rings)
    flips = _count_flips(ops, displacement)
    vertices, rms = move_vertices(ops, displacement)
    scale = float(np.ldexp(1.0, ops.exponent))
    finish(progress)
    result = BoundaryResult(
        vertices=vertices,
        displacement=rms,
        welded=ops.welded,
        limited=limited,
        source=ops.source,
        given=ops.surface,
        wavelength=made.wavelength_in_segments * made.mean_segment * scale,
        curves=made.curves,
        smoothed=made.smoothed,
        corners=made.corners,
        rings=rings,
        boundary_displacement=made.rms * scale,
        flips=flips,
        mean_segment=made.mean_segment * scale,
        seconds=time.perf_counter() - began,
    )
    return add_warnings(result, *ops.notes, *_warnings(result))


@dataclass(frozen=True, eq=False)
class _Smoothed:
    """Displacements (k, 3) of the active vertices on the boundary, and numbers about its curves."""

    displacement: Floats
    wavelength_in_segments: float
    mean_segment: float
    curves: int = 0
    smoothed: int = 0
    corners: int = 0
    rms: float = 0.0


def _smooth_curves(ops: Operators, wavelength: float | None, corner_angle: float, weights: Floats | None) -> _Smoothed:
    """Low-pass all boundary curves, each between its corners."""
    displacement = np.zeros_like(ops.positions)
    curve = ops.boundary
    if curve is None or curve.mean_edge == 0:
        return _Smoothed(displacement, WAVELENGTH_IN_SEGMENTS, 0.0)
    in_segments = WAVELENGTH_IN_SEGMENTS
    if wavelength is not None:
        in_segments = float(np.ldexp(wavelength, -ops.exponent)) / curve.mean_edge
        if in_segments <= 2:
            raise InvalidParameter(
                f"wavelength is {wavelength:.4g}; it must be above two mean edges of the boundary, "
                f"{2 * np.ldexp(curve.mean_edge, ops.exponent):.4g}"
            )
    pairs = curve.L.graph.adjacency().tocoo()
    once = pairs.coords[0] < pairs.coords[1]
    segments = curve.vertices[np.stack([pairs.coords[0][once], pairs.coords[1][once]], axis=1)].astype(np.int64)
    curves = trace_curves(segments)
    smoothed = corners = 0
    moved = np.zeros(len(ops.positions), dtype=np.bool_)
    for each in curves:
        change, found = smooth_along(each, ops.positions, in_segments, corner_angle)
        if change is None:
            continue
        smoothed, corners = smoothed + 1, corners + found
        displacement[each.vertices] += change if weights is None else change * weights[each.vertices]
        moved[each.vertices] = True
    square = np.einsum("ij,ij->i", displacement[moved], displacement[moved])
    rms = float(np.sqrt(square.mean())) if len(square) else 0.0
    return _Smoothed(displacement, in_segments, curve.mean_edge, len(curves), smoothed, corners, rms)


def smooth_along(curve: Curve, positions: Floats, wavelength: float, corner_angle: float) -> tuple[Floats | None, int]:
    """Return the displacement (k, 3) of the vertices along a curve, and its number of corners.

    The displacement is None where the curve has no jags, or is shorter than the wavelength, in segments.
    """
    if curve.segments < wavelength:
        return None, 0
    corners = find_corners(curve, positions, corner_angle)
    found = np.empty((len(curve.vertices), 3))
    place = {vertex: i for i, vertex in enumerate(curve.vertices.tolist())}
    for part in split_curve(curve, corners):
        after = low_pass_curve(positions[part.vertices], part.is_closed, wavelength)
        found[[place[v] for v in part.vertices.tolist()]] = after
    X = positions[curve.vertices]
    change = found - X
    segment = np.linalg.norm(np.diff(X, axis=0), axis=1).mean()
    if np.sqrt(np.einsum("ij,ij->i", change, change).mean()) < _SMALLEST_JAGS * segment:
        return None, 0
    return change, len(corners)


def _let_follow(ops: Operators, displacement: Floats, rings: int) -> Floats:
    """Extend the displacement of the boundary over some rings of inner vertices, harmonically."""
    if rings == 0 or not displacement.any():
        return displacement
    adjacency: csr_array = ops.L.graph.adjacency(np.ones(len(ops.L.graph.indices)))
    on_boundary = np.zeros(len(displacement), dtype=np.bool_)
    on_boundary[ops.boundary_vertices] = True
    reached: Booleans = np.asarray(np.any(displacement, axis=1), dtype=np.bool_)
    for _ in range(rings):
        reached = reached | (adjacency @ reached.astype(np.float64) > 0)
    free = np.flatnonzero(reached & ~on_boundary)
    if len(free) == 0:
        return displacement
    rows = adjacency[free]
    degree = np.asarray(rows.sum(axis=1)).ravel()
    A = (diags_array(degree) - rows[:, free]).tocsc()
    found = displacement.copy()
    found[free] = splu(A).solve(rows @ displacement)
    return found


def _count_flips(ops: Operators, displacement: Floats) -> int:
    """Number of faces that a displacement turns over."""
    is_moved = np.any(displacement, axis=1, keepdims=True)
    F = ops.faces[np.flatnonzero(is_moved[ops.faces, 0].any(axis=1))]
    before = compute_face_vectors(ops.positions, F)
    after = compute_face_vectors(ops.positions + displacement, F)
    return int((np.einsum("ij,ij->i", before, after) < 0).sum())


def _warnings(result: BoundaryResult) -> list[str]:
    found = []
    if result.curves == 0:
        found.append("the surface is closed: it has no boundary to smooth")
    elif result.smoothed == 0:
        found.append("no boundary curve has jags, or is longer than the wavelength")
    if result.flips:
        found.append(
            f"{count_of(result.flips, 'face')} at the boundary turned over; raise rings, or remove faces that hang on "
            "one edge first"
        )
    if result.limited:
        found.append(f"{result.limited} of the boundary's vertices are held at the max_displacement")
    return found
