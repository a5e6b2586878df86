"""What is noise: its level along the normals, its kind, and the evidence; arrays that :mod:`.smoothing` has prepared.

Everything is measured on the component of L^2 V along the normals of a smoothed guide, divided by the norm of the rows
of L^2, so that white noise of standard deviation s gives s at every vertex; L^2 leaves nearly nothing of a smooth shape
(of the curvature, what L leaves, only its change). The median of it does not see what few vertices have: sharp edges.

Other scales are seen through bands W^(k - 1) (I - W^k)^2, W = I - L/2 the lazy walk, k = 1, 2, 4, ...: waves of some
sqrt(k) edges, nothing of a plane or a paraboloid; each is compared with what white noise gives in the same band. White
noise has one level in all of them until shape takes over. Noise that neighbors share is taken for the sum of white
noise and of white noise that has walked for some steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.special import ndtr

from meshlab_specsmooth.arrays import Booleans, Floats, Integers
from meshlab_specsmooth.describe import Described, Rows, format_bound, format_edges, format_length
from meshlab_specsmooth.geometry.triangles import compute_aspects, compute_heights
from meshlab_specsmooth.graph.build import mesh_graph
from meshlab_specsmooth.graph.laplacian import Laplacian, laplacian
from meshlab_specsmooth.operators.laplacians import Gram, gram_of_barycenters
from meshlab_specsmooth.operators.patches import MIN_COUNTED
from meshlab_specsmooth.operators.reconstruction import TOLERANCE, solve

NONE, WHITE, DIRECTIONAL, QUANTIZED = "none", "white", "directional", "quantized"
IMPULSE, CORRELATED, UNCLEAR = "impulse", "correlated", "unclear"
KINDS = (NONE, WHITE, DIRECTIONAL, QUANTIZED, IMPULSE, CORRELATED, UNCLEAR)

# Below this share of an edge nothing is called noise: it tilts normals by a degree or two, and the triangles of any
# real mesh leave as much (an unsmoothed scan of 28 000 vertices has 0.015, a coarse model of 3000 more).
NEGLIGIBLE = 0.02

# On a regular mesh with noise of s edges the weight 0.07 / s removes nearly all of it (measured on meshes made in code)
STRENGTH = 0.07

LEAST_WEIGHT, MOST_WEIGHT = 0.02, 1000.0

# What is smoothed for an estimate may be off by this share of its displacement: the estimate scatters by far more
OFF = 1e-2

ORDERS = 4
BANDS = 6
_SEED = 20251
_MEDIAN = 0.6744897501960817  # of the absolute value of a standard normal
_REJECTED_FROM = 2.5  # standard deviations: beyond it a residual is an outlier, or shape
_MARGIN = 3  # rings at a boundary, where the Laplacian is one-sided, that have no say
_FEWEST = 50  # vertices left, or else all have a say

# White noise is the same in L, L^2, L^3, L^4; the median of impulses, which only few vertices have, rises with the
# order, as every order spreads them over more vertices. This is how much, and how many standard errors besides.
_RISE_OF_IMPULSES = 1.05
_STANDARD_ERRORS = 2.0

# From the third band to the second, and from the fourth to the third, the level of a smooth shape falls by so much or
# by more (measured on clean surfaces), that of noise by less: what is left when so much of the coarser band is taken
# off is noise. Where its variance is more than that of the first band, and yet more in the third, neighbors share it.
_FALLS = (6.0, 3.0)
_MORE_THAN_FIRST, _MORE_THAN_SECOND = 1.1**2, 2.0
_SHARED_OVER = 8  # steps of the walk

# A surface has normals because its waves get lower faster than shorter: from an octave to the next the amplitude more
# than doubles (the power of its modes falls faster than 1 / lambda^2). Below what is called noise in the shortest waves
# neighbors share noise only where, over two octaves, it does not: then the normals are lost in longer ones.
_GROWTH_OF_SHAPE = 2.0
_FINER, _COARSER = 2, 4  # the bands between which it is looked at

# Where triangles are coarse for the shape, its detail is in the first band too, and grows by so much to the second
# (measured on clean scans and models of a few thousand vertices); noise does not grow, by more than it scatters.
_GROWTH_OF_DETAIL, _SCATTER = 1.6, 1.1

# Coordinates that are rounded to a lattice take few values, each many times
_FEWEST_STEPS, _FEWEST_PER_STEP = 8, 4

# Half of the triangles longer than this against their altitude: the uniform Laplacian sees their shape as noise. White
# noise of half an edge on even triangles gives a median of 2 to 3, adaptive meshes have 2, stretched ones 3 to 5.
_MAX_ASPECT = 6.0
# Detail of a coarse shape looks like noise that neighbors share, but grows from band to band like shape, and is as high
# in L^4 as in L^2, where shared noise falls off (measured on decimated models; noise shared over two edges or more)
_GROWTH_OF_COARSE = (2.6, 2.1)
_STEADY = 0.85
_MAX_OUTLIERS = 0.1  # where a part of the surface has noise and the rest has not, there are more
# White noise leaves a hundredth of the corners within this fraction of its level of the plane of the next face. Where
# it is a fifth, the faces are flat on purpose. Staircases of masks have such faces too, but even triangles, and no
# shape that takes over within two octaves.
_FLAT_HEIGHT, _MAX_FLAT = 0.02, 0.2
_MAX_ASPECT_OF_FLAT = 3.5
_GROWTH_OF_FLAT = 2.2

# Corners within a millionth of an edge of the plane of the next face are exact. Of a surface of revolution made of
# quadrilaterals it is every diagonal, a third of the edges, and more at its caps; of a mask's surface more than two
# thirds are, and of noise none.
_EXACT_HEIGHT, _EXACT_FRACTIONS = 1e-6, (0.3, 0.68)
# Of the largest tenth of the deviations of an exact model a third and more are equal to others, to a millionth of an
# edge; of impulses hardly any, and a tenth where a flat part has many of one height. A lattice keeps some symmetry, of
# 16 copies about an axis; a turned part has more
_LARGEST, _REPEATED, _MAX_REPEATS = 0.9, 1e-6, {IMPULSE: 0.25, QUANTIZED: 0.95}
# Noise of more edges than this has lost the surface: what is measured so is a coarse shape
_MAX_LEVEL = 1.0
# Rounding to a lattice leaves its error at most vertices, which the median sees; the rings of a turned part lie on a
# lattice as well
_MIN_OF_ROUNDING = 0.4
# Sums of the faces' vectors at a vertex that are smaller than this fraction of their areas cancel
_CANCELED = 1e-6

# Eigenvalues of the covariance of noise of one level in all directions are within a factor of two of their mean, and
# the median and the mean square of its residual agree
_ONE_SIDED, _UNLIKE = 2.0, 1.1

# Share of the mean level in what few normals see of the covariance: on a box only those at its edges see more than axes
_HELD = 0.03

# The estimate's standard error is this over the root of the number of vertices: the residuals of L^2 at neighbors are
# correlated, so that there are half as many independent ones as vertices. The rest is what guide and shape put it off.
_SPREAD = 1.25
_SYSTEMATIC = 0.03


@dataclass(frozen=True, eq=False, repr=False)
class Noise(Described):
    """How much noise, of what kind, and the evidence. Lengths are in mesh units.

    Attributes
    ----------
    level : float
        Standard deviation along the normals.
    low, high : float
        Interval that holds it in 95 of 100 cases, if the kind is right; not for ``"correlated"``, whose long waves
        nothing tells from shape: there it is a factor of two either way.
    kind : {"none", "white", "directional", "quantized", "impulse", "correlated", "unclear"}
        ``"none"``: below 2 % of an edge. ``"white"``: independent from vertex to vertex. ``"directional"``: white,
        and along one direction mostly, as along the line of sight. ``"quantized"``: coordinates rounded to a lattice.
        ``"impulse"``: some vertices far off.
        ``"correlated"``: shared between neighbors. ``"unclear"``: the triangles are too uneven, too coarse or too few
        to tell noise from shape; the level is 0 then, and ``high`` is what it would be if nothing were shape.
    mean_edge : float
        Of the mesh as given; noise makes edges longer.
    orders : (4,) tuple of float
        Levels from L, L^2, L^3, L^4: alike for white noise, falling for correlated noise, rising for impulses.
    bands : (6,) tuple of float
        Levels in bands of wavelength, each an octave of eigenvalues below the one before.
    kurtosis : float
        Excess kurtosis of the residual: 0 for white noise, above 3 for impulses, and for clean shapes with edges.
    outliers : float
        Share of vertices whose residual is beyond three standard deviations (0.003 for white noise).
    shared : float
        Of the level, the part that neighbors share: level^2 = shared^2 + white^2; 0 for other kinds.
    covariance : (3, 3) float64
        Of the noise vector of a vertex, in units of the squared level, so far as it is seen along the normals.
    hit : float
        Share of the vertices that have noise: below 1 for impulses.
    reason : str or None
        Why noise and shape cannot be told apart, or why what was measured may be something else than noise.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    >>> at = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    >>> faces = np.concatenate([np.c_[at, at + 1, at + 41], np.c_[at, at + 41, at + 40]])
    >>> flat = np.c_[x, y, 0.2 * np.random.default_rng(0).standard_normal(1600)]
    >>> noise = mss.estimate_noise(flat, faces)
    >>> noise.kind, round(noise.level, 1), noise.low < 0.2 < noise.high
    ('white', 0.2, True)
    """

    level: float
    low: float
    high: float
    kind: str
    mean_edge: float
    orders: tuple[float, ...]
    bands: tuple[float, ...]
    kurtosis: float
    outliers: float
    shared: float
    covariance: Floats
    hit: float = 1.0
    reason: str | None = None

    @property
    def warning(self) -> str | None:
        """What a choice by this noise cannot take into account, in a sentence."""
        if self.kind == UNCLEAR:
            return f"nothing is moved, as noise cannot be told from shape: {self.reason}"
        if self.kind == CORRELATED:
            return (
                "the noise is shared between neighbors; nothing tells its long waves from shape, so the level and the "
                "strength are a guess"
            )
        if self.reason is not None:
            return (
                f"{self.reason}: such steps are no noise, and the strength is a guess: give one (barycenter_weight "
                "0.05 to 0.1)"
            )
        return None

    @property
    def is_left_alone(self) -> bool:
        """Whether there is nothing to remove, or nothing that could be told from shape."""
        return self.kind in (NONE, UNCLEAR)

    @property
    def resolution(self) -> float:
        """The least error that an estimate can tell from none, in mesh units: sqrt(level (high - level)).

        An estimated squared error is off by about twice the level times what the level is off by. Of an unclear level
        nothing is known but its bound.
        """
        if self.kind == UNCLEAR:
            return self.high
        return float(np.sqrt(self.level * (self.high - self.level)))

    @property
    def level_in_edges(self) -> float:
        """The level in mean edges of the mesh as given; 0 where no edge has a length."""
        return self.level / self.mean_edge if self.mean_edge else 0.0

    def format_error(self, error: float) -> str:
        """An estimated error in words, in mean edges: "at most" where it cannot be told from none, and never 0."""
        if not error > self.resolution:
            return format_bound(self.resolution, self.mean_edge)
        return format_edges(error, self.mean_edge)

    def describe_error(self, error: float) -> str:
        """The same with the unit, and in mesh units."""
        return f"{self.format_error(error)} edges ({max(error, self.resolution):.3g})"

    @property
    def summary(self) -> str:
        """Kind and level in a few words."""
        if self.kind == NONE:
            return f"no noise (below {100 * NEGLIGIBLE:g} % of an edge)"
        if self.kind == UNCLEAR:
            return f"noise cannot be told from shape: {self.reason}"
        return f"noise {self.describe_level()}"

    def describe_level(self) -> str:
        """Kind and level without a verb, for tables."""
        if self.kind == NONE:
            return f"none (below {100 * NEGLIGIBLE:g} % of an edge)"
        if self.kind == UNCLEAR:
            return f"unclear: {self.reason}"
        return f"{self.kind} {format_length(self.level, self.mean_edge)}"

    def rows(self) -> Rows:
        """Kind, level and what is known besides."""
        edge = self.mean_edge
        rows = [("kind", self.kind), ("level", format_length(self.level, edge))]
        if self.kind == UNCLEAR:
            rows[1:] = [("level", f"{format_bound(self.high, edge)} edges ({self.high:.3g})")]
        elif self.kind != NONE:
            rows.append(("interval", f"{format_edges(self.low, edge)} to {format_length(self.high, edge)}"))
        if self.shared:
            rows.append(("shared", f"{format_length(self.shared, edge)} of it between neighbors"))
        if self.hit < 1:
            rows.append(("hit", f"{100 * self.hit:.3g} % of the vertices"))
        rows.append(("mean edge", f"{edge:.4g}"))
        return rows if self.warning is None else [*rows, ("warning", self.warning)]

    def scaled(self, exponent: int, factor: float = 1.0) -> Noise:
        """The same noise with lengths times ``factor`` 2^exponent."""
        lengths = {
            name: np.ldexp(np.multiply(getattr(self, name), factor), exponent).tolist()
            for name in ("level", "low", "high", "mean_edge", "orders", "bands", "shared")
        }
        return replace(self, **lengths | {name: tuple(lengths[name]) for name in ("orders", "bands")})


@dataclass(frozen=True, eq=False)
class Sheet:
    """A mesh, or patches of one, with what is measured on it.

    Attributes
    ----------
    positions : (k, 3) float64
        Of size 1 or so.
    faces : (m, 3) int32
    L : Laplacian
        Uniform: with it the noise of every vertex weighs the same.
    gram : Gram
    inner : (k,) bool
        Vertices that have a say: away from boundaries.
    mean_edge : float
    """

    positions: Floats
    faces: Integers
    L: Laplacian
    gram: Gram
    inner: Booleans
    mean_edge: float


def sheet(positions: Floats, faces: Integers, counted: Booleans | None = None) -> Sheet:
    """The operators of a mesh; every vertex must have an edge.

    What is not ``counted`` has no say, where enough is left.
    """
    mesh = mesh_graph(faces, len(positions))
    L = laplacian(mesh.graph)
    ends = mesh.boundary()
    outer = np.zeros(len(positions), dtype=np.bool_)
    outer[ends.ravel()] = True
    adjacency = L.graph.adjacency(np.ones(len(L.graph.indices)))
    for _ in range(_MARGIN):
        outer |= adjacency @ outer.astype(np.float64) > 0
    inner = ~outer if (~outer).sum() >= _FEWEST else np.ones_like(outer)
    if counted is not None and (inner & counted).sum() >= MIN_COUNTED:
        inner &= counted
    return Sheet(positions, faces, L, gram_of_barycenters(mesh), inner, L.mean_edge_length(positions))


def rebuilt(
    L: Laplacian, gram: Gram, X: Floats, weight: float, change: Floats | None = None, off: float = TOLERANCE
) -> Floats:
    """Step 3 of X, (k, 3): the surface of least |L V' - L X - change|^2 + w^2 |C V' - C X|^2.

    Without ``change`` no differential coordinates are kept, as with a very low cut-off. The displacement may be ``off``
    by such a share.
    """
    return np.asarray(X + solve(L, gram, weight, -(L @ X) if change is None else change, rtol=off).displacement)


def normals(X: Floats, F: Integers) -> Floats:
    """(k, 3) unit normals of the vertices, weighted by area; zero where there is none."""
    _, sums = _face_vectors(X, F)
    length = np.linalg.norm(sums, axis=1)
    return np.asarray(np.divide(sums, length[:, None], out=np.zeros_like(sums), where=length[:, None] > 0))


def _face_vectors(X: Floats, F: Integers) -> tuple[Floats, Floats]:
    """(m, 3) normals whose length is twice the face's area, and (k, 3) their sums at the vertices."""
    vectors = np.cross(X[F[:, 1]] - X[F[:, 0]], X[F[:, 2]] - X[F[:, 0]])
    corner = F.ravel()
    # (bincount counts in integers where there is nothing to count)
    sums = np.stack([np.bincount(corner, np.repeat(c, 3), len(X)) for c in vectors.T], axis=1).astype(np.float64)
    return vectors, sums


def weight_for(level: float) -> float:
    """A first guess of the barycenter weight for noise of ``level`` edges."""
    return float(np.clip(STRENGTH / max(level, 1e-6), 2 * LEAST_WEIGHT, MOST_WEIGHT))


@dataclass(frozen=True, eq=False)
class Measured:
    """Noise on a sheet, in its units, and the normals of the guide."""

    noise: Noise
    normals: Floats


def measure(on: Sheet) -> Measured:
    """Level and kind of the noise."""
    if on.mean_edge == 0:
        return Measured(nothing(on.mean_edge), normals(on.positions, on.faces))
    if len(on.positions) < _FEWEST:
        noise = unclear(nothing(on.mean_edge), on.mean_edge, f"there are fewer than {_FEWEST} vertices")
        return Measured(noise, normals(on.positions, on.faces))
    white = np.random.default_rng(_SEED).standard_normal(on.positions.shape)
    level, guide, residual, peakedness = _followed(on)
    through, of_white = (_scales(on.L, X) for X in (on.positions, white))
    orders, bands = (_levels(on, guide, *pair) for pair in zip(through, of_white, strict=True))
    residual = residual[on.inner]
    covariance, spread = _covariance(residual**2, guide[on.inner], level)
    scale = max(level, np.finfo(np.float64).tiny)
    square = float((residual**2).mean())
    kurtosis = float((residual**4).mean()) / square**2 - 3 if square > 0 else 0.0
    outliers = float((np.abs(residual) > 3 * scale).mean())
    alone, shared = _parts(on, bands, of_white[1])
    share = _share_of_noise(bands)
    kind = _kind(level, spread, share, orders, bands, shared, covariance, on)
    spread, covariance = share * spread, share**2 * covariance
    fraction = _SPREAD / np.sqrt(len(residual))
    rounding = _rounding(on.positions)
    expected = float(np.sqrt((guide[on.inner] ** 2 @ rounding**2).mean()))
    seen = _mean_square_level(on, guide, through[0][-1], of_white[0][-1])
    is_rounded = level > _MIN_OF_ROUNDING * expected and 0.5 * expected < seen < 2 * expected
    if kind != CORRELATED and NEGLIGIBLE * on.mean_edge < expected and is_rounded:
        # what is rounded to a lattice has a known error, but no normal distribution: much of it stays in place
        kind, spread, covariance = QUANTIZED, expected, np.diag(rounding**2)
    hit = 1.0
    if kind == IMPULSE:
        spread = seen
        # the fourth moment of noise that a share p of the vertices has is 3 / p, and L^2 adds up some of them
        hit = 3 / (3 + max(kurtosis, 0.0) / peakedness)
        # few vertices carry the variance
        fraction *= np.sqrt(1 + max(kurtosis, 0.0) / 2)
    if kind == CORRELATED:
        spread, low, high = float(np.hypot(alone, shared)), 0.5, 2.0
    else:
        shared = 0.0
        width = float(np.hypot(2 * fraction, _SYSTEMATIC))
        low, high = max(1 - width, 0.0), 1 + width
    covariance = covariance / spread**2 if spread > 0 else np.zeros((3, 3))
    noise = Noise(
        spread,
        low * spread,
        high * spread,
        kind,
        on.mean_edge,
        orders,
        bands,
        kurtosis,
        outliers,
        shared,
        covariance,
        hit,
    )
    reason, flat = _doubt(on, noise, residual)
    if reason is not None:
        noise = unclear(noise, max(high * spread, level), reason)
    elif flat > _MAX_FLAT and kind in (WHITE, DIRECTIONAL):
        noise = replace(noise, reason=f"{100 * flat:.0f} % of the edges are exactly flat, as on the terraces of a mask")
    return Measured(noise, guide)


def unclear(noise: Noise, bound: float, reason: str) -> Noise:
    """That noise cannot be told from shape; ``bound`` is the level if nothing were shape."""
    return replace(
        noise, level=0.0, low=0.0, high=bound, kind=UNCLEAR, shared=0.0, covariance=np.zeros((3, 3)), reason=reason
    )


def _doubt(on: Sheet, noise: Noise, residual: Floats) -> tuple[str | None, float]:
    """Why what was measured may be shape, and the fraction of edges that are exactly flat where that was looked at."""
    if _is_two_sided(on):
        return "faces that look opposite ways lie upon each other", 0.0
    if noise.kind == NONE:
        return None, 0.0
    aspect = float(np.median(compute_aspects(on.positions, on.faces)))
    if aspect > _MAX_ASPECT:
        return f"half of the triangles are more than {_MAX_ASPECT:.0f} times as long as high", 0.0
    if noise.level > _MAX_LEVEL * on.mean_edge:
        return "what was measured is larger than the triangles", 0.0
    first, second, third = noise.bands[1:4]
    grows = second > _GROWTH_OF_COARSE[0] * first and third > _GROWTH_OF_COARSE[1] * second
    steady = noise.orders[3] > _STEADY * noise.orders[1]
    if noise.kind == CORRELATED and grows and steady and noise.outliers < _MAX_OUTLIERS:
        return "the shape has detail as fine as the triangles", 0.0
    if noise.kind in (IMPULSE, QUANTIZED):
        repeats = _count_repeats(residual, _REPEATED * on.mean_edge) > _MAX_REPEATS[noise.kind]
        return ("the largest deviations repeat exactly, as at the edges of a CAD model" if repeats else None), 0.0
    heights = compute_heights(on.positions, on.faces)
    flat = float((heights < _FLAT_HEIGHT * noise.level).mean()) if len(heights) else 0.0
    growing = noise.bands[3] > _GROWTH_OF_FLAT * noise.bands[2]
    low, high = _EXACT_FRACTIONS
    exact = float((heights < _EXACT_HEIGHT * on.mean_edge).mean()) if len(heights) else 0.0
    if low < exact < high:
        return f"{100 * exact:.0f} % of the edges are exactly flat, as in a CAD model", flat
    if flat > _MAX_FLAT and (aspect > _MAX_ASPECT_OF_FLAT or growing):
        return f"{100 * flat:.0f} % of the edges are exactly flat, as in a CAD model, and the rest is too coarse", flat
    return None, flat


def _count_repeats(residual: Floats, tolerance: float) -> float:
    """The fraction of the largest sizes that are equal to the next, as on an exact model; those of impulses are not."""
    sizes = np.sort(np.abs(residual))
    gaps = np.diff(sizes[sizes >= np.quantile(sizes, _LARGEST)])
    return float((gaps < tolerance).mean()) if len(gaps) else 0.0


def _is_two_sided(on: Sheet) -> bool:
    """Whether the faces at most vertices cancel each other: then there are no normals."""
    F, n = on.faces, len(on.positions)
    vectors, sums = _face_vectors(on.positions, F)
    areas = np.bincount(F.ravel(), np.repeat(np.linalg.norm(vectors, axis=1), 3), n)
    canceled = np.linalg.norm(sums, axis=1) < _CANCELED * areas
    return bool(2 * canceled.sum() > n)


def _followed(on: Sheet) -> tuple[float, Floats, Floats, float]:
    """Level, guide, residual along it, and the mean of sum h^4 / (sum h^2)^2 for the rows h of L^2.

    What is smoothed as much as the level asks for guides to the next level, which settles in two.
    """
    X, L = on.positions, on.L
    rows, peakedness = _rows(L)
    twice = L @ (L @ X)
    level = 0.3 * on.mean_edge
    for _ in range(3):
        weight = min(weight_for(level / on.mean_edge), 1.0)  # a guide is smooth in any case
        guide = normals(rebuilt(L, on.gram, X, max(weight, 0.1), off=OFF), on.faces)
        residual = (twice * guide).sum(axis=1) / rows
        level = float(np.median(np.abs(residual[on.inner]))) / _MEDIAN
    return level, guide, residual, peakedness


def nothing(mean_edge: float) -> Noise:
    """No noise, on a mesh with edges of that length."""
    return Noise(0.0, 0.0, 0.0, NONE, mean_edge, (0.0,) * ORDERS, (0.0,) * BANDS, 0.0, 0.0, 0.0, np.zeros((3, 3)))


def _rows(L: Laplacian) -> tuple[Floats, float]:
    """(k,) norms of the rows h of L^2, and the mean of sum h^4 / (sum h^2)^2."""
    degree = L.degree[:, 0]
    walk = csr_array(L.graph.adjacency(np.ones(len(L.graph.indices))))
    matrix = csr_array(eye_array(L.size) - csr_array(walk.multiply(1 / degree[:, None])))
    squares = csr_array(matrix @ matrix).power(2)
    sums, fourth = (np.asarray(x.sum(axis=1)).ravel() for x in (squares, squares.power(2)))
    return np.sqrt(sums), float((fourth / sums**2).mean())


def _levels(on: Sheet, guide: Floats, through: list[Floats], of_white: list[Floats]) -> tuple[float, ...]:
    """Levels of what comes through filters, against white noise that goes the same way."""

    def level(given: Floats, white: Floats) -> float:
        along = np.abs((given * guide).sum(axis=1))[on.inner]
        return float(np.median(along) / max(np.median(np.abs(white[on.inner])), np.finfo(np.float64).tiny))

    return tuple(level(*pair) for pair in zip(through, of_white, strict=True))


def _scales(L: Laplacian, X: Floats) -> tuple[list[Floats], list[Floats]]:
    """Powers of L of X, and bands."""
    powers = [L @ X]
    while len(powers) < ORDERS:
        powers.append(L @ powers[-1])
    return powers, _bands(L, X, BANDS)


def _bands(L: Laplacian, X: Floats, count: int) -> list[Floats]:
    """W^(k - 1) (I - W^k)^2 X for k = 1, 2, 4, ..., so many, on one walk."""
    bands = [np.zeros_like(X) for _ in range(count)]
    shares = [{k - 1: 1.0, 2 * k - 1: -2.0, 3 * k - 1: 1.0} for k in (2**i for i in range(count))]
    for steps in range(max(shares[-1]) + 1):
        for band, share in zip(bands, shares, strict=True):
            if steps in share:
                band += share[steps] * X
        X = _walked(L, X, 1)
    return bands


def _walked(L: Laplacian, X: Floats, steps: int) -> Floats:
    """W^steps X."""
    for _ in range(steps):
        before = np.zeros_like(X)
        L.step(X, X, before, factor=-0.5, coefficient=0.5)
        X = before
    return X


def _shared(L: Laplacian, white: Floats) -> Floats:
    """Noise of unit variance that neighbors share, of white noise."""
    walked = _walked(L, white, _SHARED_OVER)
    return np.asarray(walked / np.sqrt((walked**2).mean()))


def _parts(on: Sheet, bands: tuple[float, ...], of_white: list[Floats]) -> tuple[float, float]:
    """Standard deviations of the white noise and of what neighbors share, which is 0 if the noise is white."""
    first = bands[0] ** 2
    second, third = (max(bands[i] ** 2 - (bands[i + 1] / _FALLS[i - 1]) ** 2, 0.0) for i in (1, 2))
    if second <= _MORE_THAN_FIRST * first or third <= _MORE_THAN_SECOND * second:
        return bands[0], 0.0
    shared = _shared(on.L, np.random.default_rng(_SEED + 1).standard_normal(on.positions.shape))
    # its variance in the bands, against white noise; two bands, two unknowns; the first bounds the white part
    of_second, of_third = (
        float((other[on.inner] ** 2).mean() / (white[on.inner] ** 2).mean())
        for other, white in list(zip(_bands(on.L, shared, 3), of_white, strict=False))[1:]
    )
    variance = max((third - second) / (of_third - of_second), 0.0)
    even = min(max(second - variance * of_second, 0.0), first)
    return float(np.sqrt(even)), float(np.sqrt(variance))


def _covariance(squares: Floats, along: Floats, level: float) -> tuple[Floats, float]:
    """The covariance S that makes n^T S n the variance along the normals n, and the root of its mean.

    Least squares, weighted by the inverse variance; residuals beyond 2.5 standard deviations are left out, the
    variance of what is left being known for normal noise, until nothing changes.
    """
    x, y, z = along.T
    rows = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z], axis=1)
    isotropic = np.array([1.0, 1, 1, 0, 0, 0])
    density = np.exp(-(_REJECTED_FROM**2) / 2) / np.sqrt(2 * np.pi)
    kept_variance = 1 - 2 * _REJECTED_FROM * density / (2 * ndtr(_REJECTED_FROM) - 1)
    variance = np.full(len(along), level**2)
    entries = level**2 * isotropic
    for _ in range(12):
        mean = variance.mean()
        if not mean > 0:
            break
        kept = squares < _REJECTED_FROM**2 * variance
        if not kept.any():
            break
        weighted = rows[kept] / np.maximum(variance[kept], 0.05 * mean)[:, None]
        matrix = weighted.T @ rows[kept]
        # directions that no normal sees are taken to have the mean level
        hold = _HELD * np.trace(matrix) / 6
        entries = np.linalg.solve(
            matrix + hold * np.eye(6), weighted.T @ squares[kept] / kept_variance + hold * mean * isotropic
        )
        variance = rows @ entries
        variance = np.maximum(variance, 0.02 * max(float(variance.mean()), 0.0))
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), float(np.sqrt(max(variance.mean(), 0.0)))


def _mean_square_level(on: Sheet, guide: Floats, highest: Floats, of_white: Floats) -> float:
    """Level by the mean square in L^4, which sees impulses in full and of shape the least."""
    along = (highest * guide).sum(axis=1)[on.inner]
    return float(np.sqrt((along**2).mean() / (of_white[on.inner] ** 2).mean()))


def _rounding(X: Floats) -> Floats:
    """(3,) standard deviation of rounding to the lattice that coordinates lie on, step / sqrt(12); 0 where on none."""
    steps = np.zeros(3)
    for axis, column in enumerate(X.T):
        values = np.unique(column)
        gaps = np.diff(values)
        gaps = gaps[gaps > 1e-9 * (values[-1] - values[0])]
        if len(gaps) < _FEWEST_STEPS or len(values) * _FEWEST_PER_STEP > len(column):
            continue
        multiples = gaps / gaps.min()
        if (np.abs(multiples - np.rint(multiples)) < 1e-3 * multiples).all():
            steps[axis] = gaps.min()
    return np.asarray(steps / np.sqrt(12))


def _share_of_noise(bands: tuple[float, ...]) -> float:
    """Of the level in the first band, what is white noise and not detail of the shape.

    b_0^2 = s^2 + d^2 and b_1^2 = (c s)^2 + (g d)^2 with a detail d that grows g-fold from a band to the next, and noise
    that seems to grow c-fold at most.
    """
    growth, scatter = _GROWTH_OF_DETAIL**2, _SCATTER**2
    first, second = (level**2 for level in bands[:2])
    if first == 0:
        return 1.0
    return float(np.sqrt(np.clip((growth - second / first) / (growth - scatter), 0.0, 1.0)))


def _kind(
    level: float,
    spread: float,
    share: float,
    orders: tuple[float, ...],
    bands: tuple[float, ...],
    shared: float,
    covariance: Floats,
    on: Sheet,
) -> str:
    edge, error = on.mean_edge, _STANDARD_ERRORS / np.sqrt(on.inner.sum())
    growing = bands[_COARSER] >= _GROWTH_OF_SHAPE ** (_COARSER - _FINER) * bands[_FINER]
    if shared and not (max(level, spread) < NEGLIGIBLE * edge and growing):
        return CORRELATED
    if share * max(level, spread) < NEGLIGIBLE * edge:
        return NONE
    if orders[3] > (_RISE_OF_IMPULSES + error) * orders[1]:
        return IMPULSE
    eigenvalues = np.linalg.eigvalsh(covariance)
    if eigenvalues[-1] > _ONE_SIDED * np.trace(covariance) / 3 and spread > _UNLIKE * level:
        return DIRECTIONAL
    return WHITE


def realization(on: Sheet, guide: Floats, noise: Noise, seed: int = _SEED) -> Floats:
    """(k, 3): three draws of noise of that kind, each a scalar a vertex along the normals, in the sheet's units."""
    white = np.random.default_rng(seed).standard_normal(on.positions.shape)
    if noise.kind == CORRELATED:
        other = np.random.default_rng([seed, 1]).standard_normal(on.positions.shape)
        return np.asarray(np.sqrt(noise.level**2 - noise.shared**2) * white + noise.shared * _shared(on.L, other))
    if noise.kind in (DIRECTIONAL, QUANTIZED):
        variance = np.maximum(np.einsum("ni,ij,nj->n", guide, noise.covariance, guide), 0.0)
        return np.asarray(noise.level * np.sqrt(variance)[:, None] * white)
    if noise.kind == IMPULSE:
        is_hit = np.random.default_rng([seed, 1]).random(on.positions.shape) < noise.hit
        return np.asarray(noise.level / np.sqrt(noise.hit) * is_hit * white)
    return np.asarray(noise.level * white)
