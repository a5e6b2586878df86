"""The choice for all pieces, made on samples of the surface from all over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.choices import LaplacianKind
from meshlab_specsmooth.edge_aware.denoising import denoise_mesh
from meshlab_specsmooth.edge_aware.settings import CLIPPED, EdgeAware, EdgeAwareRegion
from meshlab_specsmooth.noise.local import root_mean_square
from meshlab_specsmooth.noise.model import NEGLIGIBLE, STAIRCASE, UNCLEAR, Noise
from meshlab_specsmooth.noise.outliers import measure_offsets
from meshlab_specsmooth.operators.assemble import assemble
from meshlab_specsmooth.pieces.bands import group_levels
from meshlab_specsmooth.pieces.cut import Survey
from meshlab_specsmooth.pieces.plan import Band
from meshlab_specsmooth.risk.estimate_error import estimate_noise
from meshlab_specsmooth.runtime.warned import unwarned
from meshlab_specsmooth.smoothing.api import smooth
from meshlab_specsmooth.smoothing.automatic import scale_modes
from meshlab_specsmooth.smoothing.filter import DEFAULT_WAVELENGTH_IN_EDGES
from meshlab_specsmooth.smoothing.result import join_warnings
from meshlab_specsmooth.smoothing.settings import Smoothing
from meshlab_specsmooth.spectral.cutoff import from_wavelength
from meshlab_specsmooth.spectral.low_pass import CutoffResponse
from meshlab_specsmooth.spectral.response import name_of

Patch = tuple[Floats, npt.NDArray[np.int64]]


@dataclass(frozen=True)
class Choice:
    """What is to be done to all pieces.

    Attributes
    ----------
    filter : {"isotropic", "edge_aware"}
    bands : tuple of Band
        By rising level.
    levels : list of [x, y, z, level] or None
        Where the levels of several bands were measured.
    noise : Noise or None
        Of the samples, the strongest where it varies; None where it was not measured.
    level : float
        Root mean square of its level over the samples.
    response : str
    cutoff : float
        Eigenvalue.
    iterations : int
        Of the isotropic filter.
    stray_offset : float
        Median distance of a vertex from the mean of its neighbors.
    is_automatic : bool
    warning : str or None
    """

    filter: str
    bands: tuple[Band, ...]
    levels: list[list[float]] | None
    noise: Noise | None
    level: float
    response: str
    cutoff: float
    iterations: int
    stray_offset: float
    is_automatic: bool
    warning: str | None

    @property
    def moves(self) -> bool:
        """Whether anything is to be done."""
        return any(band.barycenter_weight is not None for band in self.bands)

    @property
    def lowest_weight(self) -> float:
        """The lowest weight of all bands."""
        return min(band.barycenter_weight for band in self.bands if band.barycenter_weight is not None)

    @property
    def edge_aware_iterations(self) -> int:
        """The largest number of iterations of the edge-aware filter."""
        return max((band.edge_aware or {}).get("iterations") or 0 for band in self.bands)


@dataclass(frozen=True)
class _Found:
    """What was chosen for some samples."""

    band: Band
    noise: Noise | None
    response: str
    cutoff: float
    iterations: int
    is_edge_aware: bool
    warning: str | None
    varies: bool = False


def choose_smoothing(
    seen: Survey, vertex_count: int, asked: Smoothing, laplacian: LaplacianKind, weld: bool, by_region: bool
) -> Choice:
    """Choose what :func:`meshlab_specsmooth.smooth` would; a setting that is given is taken as it is."""

    def find(V: Floats, F: npt.NDArray[np.int64]) -> _Found:
        return _find_smoothing(seen, vertex_count, asked, laplacian, weld, V, F)

    return _choose(seen, find, asked.barycenter_weight is None, by_region)


def choose_denoising(seen: Survey, asked: EdgeAware, weld: bool, by_region: bool) -> Choice:
    """Choose what :func:`meshlab_specsmooth.denoise` would; what is given of a setting is taken as it is."""

    def find(V: Floats, F: npt.NDArray[np.int64]) -> _Found:
        everywhere = EdgeAwareRegion()
        result = denoise_mesh(V, F, asked, everywhere, asked.is_automatic, weld, None, is_exact=True)
        noise, used = result.noise, result.setting
        if used is None:
            return _found_nothing(noise, result.warning)
        if asked.is_automatic and (noise.kind == STAIRCASE or used.start == CLIPPED):  # the isotropic filter's choice
            return _find_smoothing(seen, 0, Smoothing(), "uniform", weld, V, F)
        band = Band(result.level, used.barycenter_weight, asdict(used))
        cutoff = from_wavelength(DEFAULT_WAVELENGTH_IN_EDGES, 1).eigenvalue
        varies = noise.local is not None and bool(np.ptp(noise.local) > 0)
        # what is said of parts is of the samples
        warning = noise.warning if varies else result.warning
        return _Found(band, noise, "heat", cutoff, 1, True, warning, varies)

    return _choose(seen, find, asked.is_automatic, by_region)


def _find_smoothing(
    seen: Survey,
    vertex_count: int,
    asked: Smoothing,
    laplacian: LaplacianKind,
    weld: bool,
    V: Floats,
    F: npt.NDArray[np.int64],
) -> _Found:
    setting = scale_modes(asked, len(V) / vertex_count, len(V)) if vertex_count else asked
    low_pass = setting.low_pass
    if isinstance(low_pass, CutoffResponse) and low_pass.wavelength is not None:
        edges = np.linalg.norm(V[F] - np.roll(V[F], 1, axis=1), axis=2).mean()
        scaled = low_pass.wavelength * float(edges) / seen.mean_edge
        setting = replace(setting, low_pass=replace(low_pass, wavelength=scaled))
    result = smooth(V, F, setting, laplacian=laplacian, weld=weld)
    noise = result.noise if asked.barycenter_weight is None else None
    if noise is not None and noise.is_left_alone:
        return _found_nothing(noise, result.warning)
    # where the noise varies each vertex has a weight; here it is the mean on a scale of factors
    weight = float(np.exp(np.mean(np.log(np.maximum(result.barycenter_weight, 1e-12)))))
    iterations = result.setting.iterations if isinstance(result.setting, Smoothing) else asked.iterations
    band = Band(0.0 if noise is None else noise.level, weight)
    varies = noise is not None and noise.local is not None and bool(np.ptp(noise.local) > 0)
    # what is said of parts is of the samples
    warning = noise.warning if noise is not None and varies else result.warning
    return _Found(band, noise, name_of(result.response), result.cutoff, iterations, False, warning, varies)


def _found_nothing(noise: Noise, warning: str | None) -> _Found:
    cutoff = from_wavelength(DEFAULT_WAVELENGTH_IN_EDGES, 1).eigenvalue
    return _Found(Band(NEGLIGIBLE * noise.mean_edge, None), noise, "heat", cutoff, 1, False, warning)


def _choose(seen: Survey, find: Callable[..., _Found], is_automatic: bool, by_region: bool) -> Choice:
    patches = [(V, F) for V, F in seen.patches if len(F)]
    with unwarned():
        offset = float(np.median(np.concatenate([_measure_offsets(V, F) for V, F in patches])))
        if not (by_region and is_automatic and len(patches) > 1):
            found = find(*_join(patches))
            varies = "the noise varies, but one setting is for all pieces (take --local, or local=True)"
            return _combine(
                [found], None, _find_level(found.noise), offset, is_automatic, varies if found.varies else None
            )
        noises = [estimate_noise(V, F) for V, F in patches]
        floor = NEGLIGIBLE * seen.mean_edge
        levels = np.array([floor if each.is_left_alone else max(each.level, floor) for each in noises])
        groups = group_levels(levels)
        results = [find(*_join([patches[k] for k in group])) for group in groups]
    unclear = sum(each.kind == UNCLEAR for each in noises)
    note = f"noise cannot be separated from shape in {unclear} of {len(noises)} samples" if unclear else None
    known = [[*V.mean(axis=0).tolist(), level] for (V, _), level in zip(patches, levels.tolist(), strict=True)]
    at = [float(np.exp(np.log(levels[group]).mean())) for group in groups]
    results = [replace(each, band=replace(each.band, level=level)) for each, level in zip(results, at, strict=True)]
    return _combine(results, known if len(groups) > 1 else None, root_mean_square(levels), offset, True, note)


def _combine(
    found: Sequence[_Found],
    levels: list[list[float]] | None,
    level: float,
    offset: float,
    is_automatic: bool,
    note: str | None,
) -> Choice:
    """One choice for all bands; the evidence is that of the noisiest one."""
    active = [each for each in found if each.band.barycenter_weight is not None] or list(found)
    last = active[-1]
    if len({each.is_edge_aware for each in active}) > 1:  # a staircase or impulses in a part of the mesh
        last = next(each for each in reversed(active) if not each.is_edge_aware)
        found = [replace(each, band=replace(each.band, edge_aware=None)) for each in found]
    return Choice(
        "edge_aware" if last.is_edge_aware else "isotropic",
        tuple(each.band for each in found),
        levels,
        last.noise,
        level,
        last.response,
        min(each.cutoff for each in active),
        last.iterations,
        offset,
        is_automatic,
        join_warnings(note, *dict.fromkeys(each.warning for each in active)),
    )


def _find_level(noise: Noise | None) -> float:
    """Over all samples, which may be of several levels."""
    if noise is None:
        return 0.0
    return noise.level if noise.local is None else max(noise.level, root_mean_square(noise.local))


def _measure_offsets(V: Floats, F: npt.NDArray[np.int64]) -> Floats:
    ops = assemble(V, F)
    return np.ldexp(measure_offsets(ops.positions, ops.L), ops.exponent)


def _join(patches: Sequence[Patch]) -> Patch:
    """Some samples as one mesh."""
    starts = np.cumsum([0, *(len(V) for V, _ in patches)])
    V = np.concatenate([V for V, _ in patches])
    return V, np.concatenate([F + start for (_, F), start in zip(patches, starts[:-1], strict=True)])
