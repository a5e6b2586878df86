"""The paper's three steps on face normals: noise goes, creases stay; every strength chosen by its estimated error.

1. The signal is the unit normals N of the faces instead of the differential coordinates of the vertices.
2. Its low-pass is (A + t L_w)^-1 A N on the graph of faces that share a vertex, A the faces' areas and L_w the
   Laplacian with weights that fall with the distance of the centroids and with the angle between *guiding* normals:
   those of the isotropically smoothed surface first, then those of the result so far. So nothing flows across a crease.
3. The vertices follow the filtered normals by gradient steps on sum_f (n_f . (c_f - v))^2 over the vertices' faces
   (Sun, Rosin, Martin, Langbein, *Fast and effective feature-preserving mesh denoising*, TVCG 2007), stopped early, so
   that triangles keep their shape.

The mean squared error along the normals of any setting is estimated from the noisy surface alone (Stein 1981; by Monte
Carlo: Ramani, Blu, Unser 2008), and the setting with the least is taken.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array

from meshlab_specsmooth.automatic import drifting, warning_of
from meshlab_specsmooth.errors import InvalidParameter, check_name
from meshlab_specsmooth.graph.faces import FaceGraph, FaceKernels, face_graph, face_kernels
from meshlab_specsmooth.memory import require
from meshlab_specsmooth.noise import IMPULSE, NONE, Noise, measure, nothing, sheet
from meshlab_specsmooth.smoothing import Prepared, assemble
from meshlab_specsmooth.spectral.progress import Progress, part
from meshlab_specsmooth.surface import (
    Booleans,
    Floats,
    Integers,
    Surface,
)

FAVORS = ("position", "normals")
STARTS = ("auto", "given", "smoothed")

# Width of the weights in space, in mean distances of neighbouring centroids: the ring of faces around one counts.
_SPATIAL_WIDTH = 1.5
_SWEEPS = 15
# The solve is cut short where the normals are off by less than a thousandth: they are re-estimated in the next pass.
_SOLVED_TO = 1e-3
_MOST_ITERATIONS = 6
# By so much the noise is taken for higher where normals matter more than positions: what error of position estimates
# do not see is the short waves, which the normals are made of.
_FAVORING_NORMALS = 1.4
# A probe of half the noise's size: the filter's response is then averaged over what the noise may be, which holds for
# noise with heavy tails too; an infinitesimal one sees one realisation only.
_PROBE = 0.5
_MOST_PASSES = 6
# Where a call stands when the operators are made, and when the setting is chosen
_BUILT, _CHOSEN = 0.1, 0.6
# The guide's weight suits noise alone; where the shape has short waves too, it is held more firmly.
_FIRMER = 1.4
# Noise of a millionth of an edge is no more than rounding makes; there is nothing to smooth then.
_ROUNDING = 1e-6
# What a call takes at its peak, with room to spare: 600 were measured at two million faces with the compiled kernels
_BYTES_PER_FACE = 900
# Under impulses most vertices are in place already. What moves the median one so many times as far as drawing the
# impulses in does has fitted the surface to them: the estimate, which is for normal noise, did not see it.
_IMPULSES_ASIDE = 2.0
_MOST_REPAIRS = 10  # of turned faces
# Where the search ends: below, a pass changes nothing; above, one pass flattens what a ring of faces spans.
_STRENGTHS = (0.02, 8.0)
# Normals of neighbours are 0.14 apart on a surface that turns by 8 degrees an edge; 1 is 60 degrees.
_RANGE_WIDTHS = (0.14, 1.0)
# The search runs on all faces of a mesh up to so many, else on some pieces.
_SEARCHED_FACES = 14_000
_PIECES = 4
_PIECE_FACES = 2_000
_MARGIN = 3  # rings of a piece's rim that do not count


@dataclass(frozen=True)
class Setting:
    """One setting of the filter.

    Attributes
    ----------
    start : {"given", "smoothed"}
        What the first pass takes its normals and vertices from: the surface as given, for hard edges, or the
        isotropically smoothed one, for organic shapes.
    strength : float
        t > 0 of the low-pass (I + t L_w)^-1.
    range_width : float
        Standard deviation of the weights over the distance of unit normals.
    passes : int
        0 is the isotropically smoothed surface.
    barycenter_weight : float
        w of the isotropic filter, which the first pass is guided by or starts from.
    """

    start: str
    strength: float
    range_width: float
    passes: int
    barycenter_weight: float


@dataclass(frozen=True)
class Considered:
    """A setting and its estimated root mean square error along the normals, in mesh units."""

    setting: Setting
    error: float


@dataclass(frozen=True, eq=False)
class EdgeAwareResult:
    """The smoothed surface, and the evidence.

    Attributes
    ----------
    vertices : (n, 3) float64
        In mesh units; vertices that no face refers to are where they were, to the bit.
    noise : Noise
        What was measured of the input.
    level : float
        Standard deviation of the noise along the normals that the choice went by, in mesh units.
    start, strength, range_width, passes
        The setting, see :class:`Setting`.
    barycenter_weight : float
        w of the isotropic guide.
    error : float
        Estimated root mean square error along the normals, in mesh units; NaN where nothing was to be chosen.
    considered : tuple of Considered
        All settings that were tried, best first.
    flips : int
        Faces of the result that look away by more than 90 degrees from where the smoothed surface's do, or from where
        their neighbours do.
    volume_change : float
        In per cent; NaN of an open surface.
    displacement : float
        Root mean square distance between input and result, in mesh units.
    kernels : str
        ``"numba"`` where the extra ``fast`` is installed, else ``"scipy"``.
    warning : str or None
        What the choice could not take into account.
    seconds : float
    """

    vertices: Floats
    noise: Noise
    level: float
    start: str
    strength: float
    range_width: float
    passes: int
    barycenter_weight: float
    error: float
    considered: tuple[Considered, ...]
    flips: int
    volume_change: float
    displacement: float
    kernels: str
    warning: str | None
    seconds: float


def smooth_edge_aware(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    *,
    favor: str = "position",
    strength: float | None = None,
    range_width: float | None = None,
    passes: int | None = None,
    start: str = "auto",
    barycenter_weight: float | None = None,
    progress: Progress | None = None,
) -> EdgeAwareResult:
    """Smooth a surface and keep its edges; without parameters, as strongly as the noise asks for.

    Parameters
    ----------
    vertices : (n, 3) array of real numbers
    faces : (m, 3) array of integers
    favor : {"position", "normals"}
        Whether the error of positions is to be least, or rather that of the normals: then the noise is taken for 1.4
        times as high.
    strength : float, optional
        t > 0; 0.1 is gentle, 2 to 6 suits hard edges under much noise. Chosen by estimated error if not given.
    range_width : float, optional
        Between unit normals: 0.2 for hard edges, 0.6 for organic shapes. Chosen if not given.
    passes : int, optional
        Chosen if not given.
    start : {"auto", "given", "smoothed"}
        What the first pass filters: the surface as given, for hard edges, or the isotropically smoothed one, for
        organic shapes. ``"auto"`` chooses, unless nothing else is left to be chosen: then it is as given.
    barycenter_weight : float, optional
        w > 0 of the isotropic filter, which the first pass is guided by or starts from. By the noise if not given.
    progress : callable, optional
        Called with the fraction done, rising to 1; what it raises ends the call.

    Raises
    ------
    InvalidSurface
        As :class:`Surface` does.
    InvalidParameter
        Names the parameter.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = mss.smooth_edge_aware(flat, [[0, 1, 2], [0, 2, 3]])
    >>> bool(abs(result.vertices - flat).max() < 1e-12)
    True
    """
    begin = time.perf_counter()
    _check(favor, strength, range_width, passes, start, barycenter_weight)
    surface = _surface(vertices, faces)
    fixed = _Fixed(strength, range_width, passes, start, barycenter_weight)
    return _denoised(surface, favor, fixed, False, progress, begin)


def denoise(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, *, favor: str = "position", progress: Progress | None = None
) -> EdgeAwareResult:
    """Smooth a surface by whatever has the least estimated error: the isotropic filter or an edge-aware setting.

    Parameters
    ----------
    vertices : (n, 3) array of real numbers
    faces : (m, 3) array of integers
    favor, progress
        As for :func:`smooth_edge_aware`.

    Returns
    -------
    EdgeAwareResult
        ``considered`` is the table of all that was tried; 0 passes stand for the isotropic filter.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = mss.denoise(flat, [[0, 1, 2], [0, 2, 3]])
    >>> bool(abs(result.vertices - flat).max() < 1e-12)
    True
    """
    begin = time.perf_counter()
    check_name("favor", favor, FAVORS)
    return _denoised(_surface(vertices, faces), favor, _Fixed(None, None, None), True, progress, begin)


def _surface(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> Surface:
    """Checked; its constructor makes arrays of what it is given."""
    return Surface(vertices, faces)  # type: ignore[arg-type]


@dataclass(frozen=True)
class _Fixed:
    """What the caller has set."""

    strength: float | None
    range_width: float | None
    passes: int | None
    start: str = "auto"
    barycenter_weight: float | None = None

    def setting(self, weight: float) -> Setting | None:
        """The setting, if nothing is left to be chosen."""
        if self.strength is None or self.range_width is None or self.passes is None:
            return None
        start = "given" if self.start == "auto" else self.start
        return Setting(start, self.strength, self.range_width, self.passes, self.barycenter_weight or weight)


def _check(
    favor: str,
    strength: float | None,
    range_width: float | None,
    passes: int | None,
    start: str,
    barycenter_weight: float | None,
) -> None:
    check_name("favor", favor, FAVORS)
    check_name("start", start, STARTS)
    numbers = {"strength": strength, "range_width": range_width, "barycenter_weight": barycenter_weight}
    for name, value in numbers.items():
        if value is not None and not 0 < value < np.inf:
            raise InvalidParameter(f"{name} is {value}; it must be positive and finite")
    if passes is not None and (
        isinstance(passes, bool) or not isinstance(passes, int | np.integer) or not 1 <= passes <= 100
    ):
        raise InvalidParameter(f"passes is {passes!r}; it must be a whole number from 1 to 100")


# ---------------------------------------------------------------------------------------------------------------------
# A mesh in units of its mean edge


@dataclass(frozen=True, eq=False)
class _Mesh:
    """A surface without stray vertices, measured in mean edges.

    ``pull`` is 1 over the number of each vertex' faces, ``rim`` the vertices at the boundary, ``counts`` those whose
    error counts, ``isotropic`` the operators of the isotropic filter, ``drifting`` the share of its displacement along
    the surface that is kept.
    """

    V: Floats
    F: Integers
    graph: FaceGraph
    kernels: FaceKernels
    pull: Floats
    rim: Booleans
    counts: Booleans
    isotropic: Prepared
    drifting: float = 1.0


def _mesh(V: Floats, F: Integers, counts: Booleans) -> _Mesh:
    graph = face_graph(F, len(V))
    pull = 1.0 / np.maximum(np.diff(graph.vertex_indptr), 1)
    isotropic = assemble(V, F, "uniform")
    rim = np.zeros(len(V), dtype=np.bool_)
    if isotropic.rim is not None:
        rim[isotropic.moving[isotropic.rim.vertices]] = True
    return _Mesh(V, F, graph, face_kernels(graph), pull, rim, counts, isotropic)


def _mean_side(V: Floats, F: Integers) -> float:
    """Mean length of the faces' sides."""
    exponent = int(np.frexp(np.abs(V).max())[1])  # squares of coordinates may be no numbers
    X = np.ldexp(V, -exponent)
    sides = [np.sqrt(((X[F[:, k]] - X[F[:, k - 1]]) ** 2).sum(axis=1)).mean() for k in range(3)]
    return float(np.ldexp(np.mean(sides), exponent))


def _normals(mesh: _Mesh, V: Floats) -> Floats:
    """(n, 3) unit normals of the vertices, the mean over their faces weighted by area."""
    _, normal, area = mesh.kernels.frames(V)
    graph = mesh.graph
    ones = np.ones(len(graph.vertex_faces))
    at = csr_array((ones, graph.vertex_faces, graph.vertex_indptr), shape=(graph.order, graph.size))
    return _unit(at @ (normal * area[:, None]))


def _volume(mesh: _Mesh, V: Floats) -> float:
    """Signed, in cubed mean edges; means something of a closed surface."""
    centre, normal, area = mesh.kernels.frames(V - V.mean(axis=0))
    return float(np.einsum("ij,ij,i->", centre, normal, area) / 6)


def _isotropic(mesh: _Mesh, V: Floats, weight: float) -> Floats:
    """The paper's smoothing of other positions of the mesh's vertices; at the rim along the normals alone.

    The rest of a rim's displacement would draw it inwards.
    """
    prepared = mesh.isotropic
    shift = np.ldexp((V - mesh.V)[prepared.moving], -prepared.exponent)
    moved = replace(prepared, surface=Surface(V, mesh.F), positions=prepared.positions + shift)
    X = moved.smooth(barycenter_weight=weight, response="heat", boundary="free").vertices
    if mesh.drifting < 1:
        n = _normals(mesh, X)
        across = n * ((X - V) * n).sum(axis=1)[:, None]
        X = V + across + mesh.drifting * (X - V - across)
    if mesh.rim.any():
        n = _normals(mesh, X)[mesh.rim]
        step = (X - V)[mesh.rim]
        X[mesh.rim] = V[mesh.rim] + n * (n * step).sum(axis=1)[:, None]
    return X


# ---------------------------------------------------------------------------------------------------------------------
# The filter


def _unit(X: Floats) -> Floats:
    length = np.sqrt(np.einsum("ij,ij->i", X, X))[:, None]
    return np.asarray(np.divide(X, length, out=np.zeros_like(X), where=length > 0))


def _low_pass(
    kernels: FaceKernels, centre: Floats, N: Floats, area: Floats, guide: Floats, strength: float, range_width: float
) -> Floats:
    """Unit normals (A + t L_w)^-1 A N."""
    # the mean centroids of two equilateral triangles of edge 1 on an edge are 1 / sqrt(3) apart
    near = 1.5 / _SPATIAL_WIDTH**2
    alike = 0.5 / range_width**2
    # a face of no area has no normal, but passes on those of its neighbours
    a = np.maximum(area / max(area.mean(), np.finfo(float).tiny), 1e-9)
    root = np.sqrt(a)
    weight, degree = kernels.weigh(centre, guide, root, near, alike)
    diagonal = a + strength * degree
    return _unit(kernels.solve(weight, diagonal, strength, a[:, None] * N, guide, _SOLVED_TO, _MOST_ITERATIONS))


def _passes(
    mesh: _Mesh, given: Floats, smoothed: Floats, start: str, strength: float, range_width: float
) -> Iterator[Floats]:
    """The vertices after each pass, without end."""
    V = given if start == "given" else smoothed
    guide = mesh.kernels.frames(smoothed)[1]
    while True:
        centre, N, area = mesh.kernels.frames(V)
        N = _low_pass(mesh.kernels, centre, N, area, guide, strength, range_width)
        V = mesh.kernels.fit(V, N, mesh.pull, _SWEEPS)
        yield V
        guide = mesh.kernels.frames(V)[1]


def _filtered(
    mesh: _Mesh, given: Floats, smoothed: Floats, setting: Setting, progress: Progress | None = None
) -> Floats:
    """What a setting makes of the given vertices."""
    if setting.passes == 0:
        return smoothed
    path = _passes(mesh, given, smoothed, setting.start, setting.strength, setting.range_width)
    for count in range(1, setting.passes):
        next(path)
        if progress is not None:
            progress(count / setting.passes)
    return next(path)


# ---------------------------------------------------------------------------------------------------------------------
# What is noise


@dataclass(frozen=True)
class _Noise:
    """White noise and, besides it, noise that is correlated over some rings; standard deviations along the normals."""

    kind: str
    white: float
    correlated: float = 0.0

    @property
    def level(self) -> float:
        return float(np.hypot(self.white, self.correlated))


_CORRELATED_OVER = 8  # steps of the lazy walk


def _averaged(mesh: _Mesh, X: Floats) -> Floats:
    """P X, the mean over each vertex' neighbours; the isotropic filter's operators have an order of their own."""
    L, order = mesh.isotropic.L, mesh.isotropic.moving
    Y = np.empty_like(X)
    Y[order] = (L.graph.adjacency() @ X[order]) / L.graph.degree
    return Y


def _walk(mesh: _Mesh, X: Floats, steps: int) -> Floats:
    """Steps of the lazy walk (I + P) / 2 = I - L / 2."""
    for _ in range(steps):
        X = (X + _averaged(mesh, X)) / 2
    return X


def _band(mesh: _Mesh, X: Floats, k: int) -> Floats:
    """(I - W^k)^2 W^(k - 1) X, W the lazy walk: waves of some sqrt(k) edges, nothing of a plane or a paraboloid."""
    Y = _walk(mesh, X, k - 1)
    for _ in range(2):
        Y = Y - _walk(mesh, Y, k)
    return Y


def _drawn(mesh: _Mesh, noise: _Noise, seed: int) -> Floats:
    """(n, 1) noise of this kind."""
    rng = np.random.default_rng(seed)
    n = len(mesh.V)
    g = noise.white * rng.standard_normal((n, 1))
    if noise.correlated:
        x = _walk(mesh, rng.standard_normal((n, 1)), _CORRELATED_OVER)
        g += noise.correlated * x / x.std()
    return np.asarray(g)


_GAUSSIAN = 0.6745  # median of |g|, g standard normal


def _median_level(mesh: _Mesh, normals: Floats) -> float:
    """The noise along the normals by the median estimator on L^2 V (Donoho 1995), in mean edges."""
    z, _ = _high_pass(mesh, mesh.V, normals)
    return float(np.median(np.abs(z)) / _GAUSSIAN)


def _high_pass(mesh: _Mesh, X: Floats, normals: Floats) -> tuple[Floats, Booleans]:
    """n.(L^2 X) over its standard deviation for unit white noise, and the vertices where it was taken."""
    inside = mesh.counts & ~mesh.rim
    if not inside.any():
        inside = np.ones_like(inside)
    for _ in range(2):
        X = X - _averaged(mesh, X)
    root = np.empty(len(X))
    root[mesh.isotropic.moving] = np.sqrt(_row_squares(mesh.isotropic))
    root = root[inside]
    return (X * normals).sum(axis=1)[inside] / root, inside


def _row_squares(isotropic: Prepared) -> Floats:
    """Sums of the squares of the rows of L^2, in the order of its vertices."""
    A, d = isotropic.L.graph.adjacency(), isotropic.L.graph.degree
    P = (diags_array(1 / d[:, 0]) @ A).tocsr()
    L = (diags_array(np.ones(len(d))) - P).tocsr()
    twice = (L @ L).tocsr()
    return np.asarray(twice.multiply(twice).sum(axis=1)).ravel()


# Two bands whose levels differ by so much more than by chance do not see white noise
_COLOURED = 1.1
# The fourth moment of Gaussian noise is 3, of a tenth of impulses ten or more
_HEAVY_TAILED = 3.6
_TRIAL = Setting("given", 2.0, 0.25, 2, 1.0)


def _noise(mesh: _Mesh, normals: Floats, median: float, trial: Callable[[], Floats]) -> _Noise:
    """As what the noise is to be taken, from its level by the median estimator, in mean edges.

    ``trial`` gives vertices of a strong edge-aware setting: what it takes away is nearly all noise.
    """
    inside = mesh.counts & ~mesh.rim
    if median <= 0 or inside.sum() < 100:
        return _Noise("white", median)
    coloured = _coloured(mesh, normals, inside)
    if coloured is not None:
        return coloured
    z, _ = _high_pass(mesh, mesh.V - trial(), normals)
    rms = float(np.sqrt((z**2).mean()))
    if rms > _COLOURED * median and (z**4).mean() > _HEAVY_TAILED * rms**4:
        return _Noise("impulses", rms)
    return _Noise("white", median)


def _coloured(mesh: _Mesh, normals: Floats, inside: Booleans) -> _Noise | None:
    """White and correlated parts from the levels of four bands, or None if the noise is white."""
    rng = np.random.default_rng(2)
    white = rng.standard_normal((len(mesh.V), 3))
    smooth = _walk(mesh, rng.standard_normal((len(mesh.V), 3)), _CORRELATED_OVER)
    smooth /= smooth.std()
    level, share = {}, {}
    for k in (1, 2, 4, 8):
        unit = np.sqrt((_band(mesh, white, k)[inside] ** 2).mean())
        share[k] = np.sqrt((_band(mesh, smooth, k)[inside] ** 2).mean()) / unit
        z = (_band(mesh, mesh.V, k) * normals).sum(axis=1)[inside] / unit
        level[k] = float(np.median(np.abs(z)) / _GAUSSIAN)
    # shape falls by a factor of six from the fourth band to the second, and of three from the eighth to the fourth
    # or by more (measured on clean surfaces); noise falls more slowly, whatever is left when that is taken off is noise
    second, third = (level[k] ** 2 - (level[2 * k] / falls) ** 2 for k, falls in ((2, 6), (4, 3)))
    if second < (_COLOURED * level[1]) ** 2 or third < 2 * second:
        return None
    # two bands, two unknowns; the finest bounds the white part
    correlated = max((third - second) / (share[4] ** 2 - share[2] ** 2), 0.0)
    even = min(max(second - correlated * share[2] ** 2, 0.0), level[1] ** 2)
    return _Noise("correlated", float(np.sqrt(even)), float(np.sqrt(correlated)))


# ---------------------------------------------------------------------------------------------------------------------
# The choice


def guide_weight(level: float) -> float:
    """Barycentre weight of the isotropic guide for noise of a level in mean edges: 0.07 / level, in [0.12, 1]."""
    return float(np.clip(0.07 / level, 0.12, 1.0)) if level > 0 else 1.0


@dataclass(frozen=True, eq=False)
class _Search:
    """What the estimate of a setting's error needs: positions and guides with and without the probe."""

    mesh: _Mesh
    noise: _Noise
    normals: Floats
    given: tuple[Floats, Floats]
    probe: Floats
    guides: dict[float, list[Floats]]

    def smoothed(self, weight: float) -> list[Floats]:
        """The isotropically smoothed positions, with and without the probe; computed once for a weight."""
        if weight not in self.guides:
            self.guides[weight] = [_isotropic(self.mesh, V, weight) for V in self.given]
        return self.guides[weight]

    def error(self, plain: Floats, probed: Floats) -> float:
        """Estimated mean squared error along the normals, in squared mean edges."""
        at = self.mesh.counts
        moved = ((plain - self.mesh.V) * self.normals).sum(axis=1)[at]
        response = (self.probe * (probed - plain)).sum(axis=1)[at]
        variance = ((self.probe * self.normals).sum(axis=1) ** 2)[at].mean()
        # the drawn noise's own variance stands for the expected one: the error of doing nothing is then estimated
        # without scatter
        level = self.noise.level**2
        gain = level / variance if variance > 0 else 0.0
        return float((moved**2).mean() - level + 2 * gain * response.mean() / _PROBE)

    def path(
        self, start: str, strength: float, range_width: float, weight: float, passes: int | None
    ) -> list[tuple[Setting, float]]:
        """Errors after 1, 2, ... passes, until they rise; or of the given number of passes alone."""
        with ThreadPoolExecutor(2) as pool:
            walks = [
                _passes(self.mesh, given, smoothed, start, strength, range_width)
                for given, smoothed in zip(self.given, self.smoothed(weight), strict=True)
            ]
            found: list[tuple[Setting, float]] = []
            for count in range(1, (passes or _MOST_PASSES) + 1):
                plain, probed = pool.map(next, walks)
                if passes is not None and count < passes:
                    continue
                error = self.error(plain, probed)
                found.append((Setting(start, strength, range_width, count, weight), error))
                if len(found) > 2 and error > found[-2][1] > found[-3][1]:
                    break
        return found


_Key = tuple[str, float, float, float]  # start, strength, range width, weight


def _coarse(fixed: _Fixed, weight: float) -> list[_Key]:
    """Where the search starts: hard and soft, sharp and organic."""
    settings = [
        ("given", 0.4, 0.35, 1.0),
        ("given", 2.0, 0.2, 1.0),
        ("given", 2.0, 0.35, 1.0),
        ("smoothed", 0.1, 0.4, 1.0),
        ("smoothed", 0.1, 0.4, _FIRMER),
        ("smoothed", 0.4, 0.28, 1.0),
    ]
    return list(
        dict.fromkeys(
            (
                start if fixed.start == "auto" else fixed.start,
                fixed.strength or t,
                fixed.range_width or width,
                fixed.barycenter_weight or weight * firmer,
            )
            for start, t, width, firmer in settings
        )
    )


def _searched(
    search: _Search, fixed: _Fixed, weight: float, with_isotropic: bool, progress: Progress | None
) -> list[tuple[Setting, float]]:
    """Settings and errors, best first: coarse, then the neighbours of the best as long as they are better."""
    found: dict[_Key, list[tuple[Setting, float]]] = {}

    def look(key: _Key) -> float:
        if key not in found:
            found[key] = search.path(*key, fixed.passes)
            if progress is not None:
                progress(1 - 0.9 ** len(found))  # how many there will be is not known
        return min(error for _, error in found[key])

    best = min(_coarse(fixed, weight), key=look)
    for ratio_t, ratio_width in ((2.0, 2**0.5), (2.0, 2**0.5), (2**0.5, 2**0.25)):
        start, t, width, w = best
        around = [best]
        if fixed.strength is None:
            around += [(start, x, width, w) for x in (t * ratio_t, t / ratio_t) if _STRENGTHS[0] <= x <= _STRENGTHS[1]]
        if fixed.range_width is None:
            widths = (width * ratio_width, width / ratio_width)
            around += [(start, t, x, w) for x in widths if _RANGE_WIDTHS[0] <= x <= _RANGE_WIDTHS[1]]
        best = min(around, key=look)
    rows = [row for path in found.values() for row in path]
    if with_isotropic:
        weights = (weight / _FIRMER, weight, weight * _FIRMER)
        rows += [(Setting("smoothed", 0.0, 0.0, 0, w), search.error(*search.smoothed(w))) for w in weights]
    return sorted(rows, key=lambda row: row[1])


def _denoised(
    surface: Surface, favor: str, fixed: _Fixed, with_isotropic: bool, progress: Progress | None, begin: float
) -> EdgeAwareResult:
    """The whole of :func:`smooth_edge_aware` and :func:`denoise`."""
    V, F = surface.vertices, surface.faces
    require(_BYTES_PER_FACE * len(F), f"smoothing {len(F)} faces")
    h = _mean_side(V, F)
    used = np.zeros(len(V), dtype=np.bool_)
    used[F[(F[:, 0] != F[:, 1]) | (F[:, 1] != F[:, 2])].ravel()] = True
    if h == 0 or not used.any():
        return _untouched(surface, begin)
    moving = np.flatnonzero(used)
    at = np.cumsum(used, dtype=np.int32) - np.int32(1)
    kept = used[F].all(axis=1)
    centre = V[moving].mean(axis=0)
    X, G = (V[moving] - centre) / h, np.ascontiguousarray(at[F[kept]])
    mesh = _mesh(X, G, np.ones(len(X), dtype=np.bool_))
    sample = mesh if len(G) <= _SEARCHED_FACES else _pieces(mesh)
    report = progress or (lambda _: None)
    report(_BUILT)
    measured = measure(sheet(sample.V, sample.F)).noise
    mesh, sample = (replace(each, drifting=drifting(measured)) for each in (mesh, sample))
    if measured.kind == NONE and fixed == _Fixed(None, None, None):
        automatic = _automatic(mesh, favor)
        noise, rows = _Noise("white", measured.level), [automatic.row]
    else:
        noise, rows = _chosen(sample, favor, fixed, with_isotropic, part(progress, _BUILT, _CHOSEN - _BUILT))
    report(_CHOSEN)
    if noise.level <= _ROUNDING and fixed.setting(1.0) is None:
        return _untouched(surface, begin)
    setting, error = rows[0]
    smoothed = _isotropic(mesh, X, setting.barycenter_weight)
    Y = _filtered(mesh, X, smoothed, setting, part(progress, _CHOSEN, 1 - _CHOSEN))
    if measured.kind == IMPULSE and fixed == _Fixed(None, None, None):
        automatic = _automatic(mesh, favor)
        if _moved_in_the_median(mesh, Y) > _IMPULSES_ASIDE * _moved_in_the_median(mesh, automatic.vertices):
            rows, smoothed, Y = [automatic.row, *rows], automatic.vertices, automatic.vertices
            setting, error = automatic.row
    Y, flips = _unflipped(mesh, Y, smoothed)
    volume = 0.0 if mesh.rim.any() else _volume(mesh, X)
    if volume:
        Y = _with_volume(mesh, Y, volume, noise.level)
    result = V.copy()
    step = (Y - X) * h
    result[moving] += step
    report(1.0)
    return EdgeAwareResult(
        vertices=result,
        noise=measured.scaled(0, h),
        level=noise.level * h,
        start=setting.start,
        strength=setting.strength,
        range_width=setting.range_width,
        passes=setting.passes,
        barycenter_weight=setting.barycenter_weight,
        error=_root(error) * h,
        considered=tuple(Considered(each, _root(estimate) * h) for each, estimate in rows),
        flips=flips,
        volume_change=100 * (_volume(mesh, Y) - volume) / abs(volume) if volume else np.nan,
        displacement=float(np.sqrt(((Y - X) ** 2).sum() / len(V))) * h,
        kernels=mesh.kernels.name,
        warning=warning_of(measured),
        seconds=time.perf_counter() - begin,
    )


@dataclass(frozen=True, eq=False)
class _Automatic:
    """What the automatic isotropic filter makes of the mesh, and its row in the table."""

    vertices: Floats
    row: tuple[Setting, float]


def _automatic(mesh: _Mesh, favor: str) -> _Automatic:
    """For a surface without noise worth the name, whatever its edges are like; and for impulses, which it draws in."""
    smoothed = mesh.isotropic.smooth(favor=favor)
    setting = Setting("smoothed", 0.0, 0.0, 0, smoothed.barycenter_weight)
    return _Automatic(smoothed.vertices, (setting, (smoothed.estimated_error or 0.0) ** 2))


def _moved_in_the_median(mesh: _Mesh, Y: Floats) -> float:
    """Median distance along the normals of Y from the surface as given."""
    return float(np.median(np.abs(((Y - mesh.V) * _normals(mesh, Y)).sum(axis=1))))


def _root(squared: float) -> float:
    """Of an estimate, which may turn out below zero where there is hardly an error."""
    return float(np.sqrt(max(squared, 0.0)))


def _chosen(
    mesh: _Mesh, favor: str, fixed: _Fixed, with_isotropic: bool, progress: Progress | None
) -> tuple[_Noise, list[tuple[Setting, float]]]:
    """The noise, and settings with their errors, best first."""
    rough = _normals(mesh, _isotropic(mesh, mesh.V, 0.4))
    median = _median_level(mesh, rough)
    smoothed = _isotropic(mesh, mesh.V, guide_weight(median))
    normals = _normals(mesh, smoothed)
    noise = _noise(mesh, normals, median, lambda: _filtered(mesh, mesh.V, smoothed, _TRIAL))
    if favor == "normals":
        noise = _Noise(noise.kind, noise.white * _FAVORING_NORMALS, noise.correlated * _FAVORING_NORMALS)
    weight = guide_weight(noise.level)
    setting = fixed.setting(weight)
    if setting is not None:
        return noise, [(setting, np.nan)]
    probe = normals * _drawn(mesh, noise, seed=5)
    given = (mesh.V, mesh.V + _PROBE * probe)
    search = _Search(mesh, noise, normals, given, probe, {})
    return noise, _searched(search, fixed, weight, with_isotropic, progress)


def _untouched(surface: Surface, begin: float) -> EdgeAwareResult:
    """For surfaces without an edge of any length, or without noise."""
    return EdgeAwareResult(
        vertices=surface.vertices.copy(),
        noise=nothing(0.0),
        level=0.0,
        start="given",
        strength=0.0,
        range_width=0.0,
        passes=0,
        barycenter_weight=1.0,
        error=0.0,
        considered=(),
        flips=0,
        volume_change=np.nan,
        displacement=0.0,
        kernels="none",
        warning=None,
        seconds=time.perf_counter() - begin,
    )


def _unflipped(mesh: _Mesh, Y: Floats, smoothed: Floats) -> tuple[Floats, int]:
    """The vertices, those of turned faces drawn towards their neighbours; and how many faces stay turned."""
    turned = _turned(mesh, Y, smoothed)
    for _ in range(_MOST_REPAIRS):
        if not turned.any():
            break
        corners = np.unique(mesh.F[turned])
        corners = corners[~mesh.rim[corners]]
        moved = Y.copy()
        moved[corners] += (_around(mesh, Y, corners) - Y[corners]) / 2
        now = _turned(mesh, moved, smoothed)
        if now.sum() > turned.sum():
            break
        Y, turned = moved, now
    return Y, int(turned.sum())


def _around(mesh: _Mesh, Y: Floats, vertices: npt.NDArray[np.integer]) -> Floats:
    """The mean of the centroids of the faces at each of some vertices."""
    graph = mesh.graph
    ones = np.ones(len(graph.vertex_faces))
    at = csr_array((ones, graph.vertex_faces, graph.vertex_indptr), shape=(graph.order, graph.size))
    return np.asarray((at[vertices] @ mesh.kernels.frames(Y)[0]) * mesh.pull[vertices, None])


def _with_volume(mesh: _Mesh, Y: Floats, given: float, level: float) -> Floats:
    """``Y`` moved along its normals, all vertices by the same, so that its volume is that given.

    Noise does not change a volume in the mean, so that of the given surface is the best known. Where that takes more
    than a noise level, the volume means nothing (faces turned this way and that), and ``Y`` stays.
    """
    area = mesh.kernels.frames(Y)[2].sum() / 2
    step = (given - _volume(mesh, Y)) / area if area > 0 else 0.0
    return Y + step * _normals(mesh, Y) if abs(step) <= level else Y


def _turned(mesh: _Mesh, Y: Floats, smoothed: Floats) -> Booleans:
    """Faces that look away from where the smoothed surface's do, or from where their neighbours do."""
    across = mesh.kernels.frames(Y)[1]
    graph = mesh.graph
    around = csr_array((np.ones(len(graph.indices)), graph.indices, graph.indptr), shape=(graph.size, graph.size))
    away = np.asarray((across * mesh.kernels.frames(smoothed)[1]).sum(axis=1) < 0)
    return np.asarray(away | ((across * (around @ across)).sum(axis=1) < 0), dtype=np.bool_)


# ---------------------------------------------------------------------------------------------------------------------
# Pieces of a large mesh


def _pieces(mesh: _Mesh) -> _Mesh:
    """Some connected pieces of the mesh, grown from faces drawn at random, as one mesh."""
    rng = np.random.default_rng(3)
    graph = mesh.graph
    taken = np.zeros(graph.size, dtype=np.bool_)
    counted = np.zeros(graph.size, dtype=np.bool_)
    for seed in rng.permutation(graph.size)[:_PIECES]:
        rings = [np.array([seed])]
        taken_here = np.zeros(graph.size, dtype=np.bool_)
        taken_here[seed] = True
        total = 1
        while total < _PIECE_FACES:
            ring = _ring(graph, rings[-1])
            ring = np.unique(ring[~taken_here[ring]])
            if len(ring) == 0:
                break
            taken_here[ring] = True
            rings.append(ring)
            total += len(ring)
        whole = total < _PIECE_FACES
        inner = rings if whole else rings[: max(len(rings) - _MARGIN, 1)]
        counted[np.concatenate(inner)] = True
        taken |= taken_here
    faces = mesh.F[taken]
    counts = np.zeros(len(mesh.V), dtype=np.bool_)
    counts[mesh.F[counted].ravel()] = True
    vertices, local = np.unique(faces, return_inverse=True)
    return _mesh(mesh.V[vertices], local.reshape(-1, 3).astype(np.int32), counts[vertices])


def _ring(graph: FaceGraph, faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """All neighbours of the given faces, with repetitions."""
    first, count = graph.indptr[faces], np.diff(graph.indptr)[faces]
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(graph.indices[np.repeat(first, count) + offset], dtype=np.int64)
