"""Results: the new positions, and the evidence."""

from __future__ import annotations

import functools
import importlib
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Source, WithMesh
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.describe import Described, Pictured, Rows, count_of, format_length
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.noise.model import STAIRCASE, Noise
from meshlab_specsmooth.smoothing.settings import Setting


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FilterResult(WithMesh, Described):
    """What the results of all filters have.

    Attributes
    ----------
    vertices : (n, 3) float64
        New positions, in mesh units; vertices without an edge are where they were, to the bit.
    displacement : float
        Root mean square distance between input and result, in mesh units.
    kernels : str
        What swept over the mesh: ``"numba"`` where the extra ``fast`` is installed, else ``"scipy"``.
    seconds : float
        Wall time of the call.
    warning : str or None
        What the user should know: what could not be taken into account, what was left alone, or that there was next to
        nothing to smooth.
    welded : int
        Number of vertices that lie where another one does, and moved with it.
    outliers : (k,) int64
        Single stray vertices that were put where their neighbors are, where the setting was chosen.
    limited : int
        Number of vertices that are held at the ``max_displacement``.
    source : Source or None
        The mesh that was given, for ``mesh``.
    given : Surface or None
        The input, for the picture of before and after in a notebook.
    """

    vertices: Floats
    displacement: float = 0.0
    kernels: str = "none"
    seconds: float = 0.0
    warning: str | None = None
    welded: int = 0
    outliers: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    limited: int = 0
    source: Source | None = field(default=None, repr=False)
    given: Surface | None = None

    @functools.cached_property
    def error_field(self) -> Floats:
        """(n,) expected error around each vertex, in mesh units; see :func:`estimate_error_field`."""
        # of a higher layer: it applies the filter again
        module = importlib.import_module("meshlab_specsmooth.error_field")
        return np.asarray(module.estimate_error_field(self))

    def pictured(self) -> Pictured | None:
        """Before and after."""
        return None if self.given is None else (self.given.vertices, self.vertices, self.given.faces)

    def _describe_unmoved(self, noise: Noise | None) -> str:
        """Why nothing was moved, as far as that is known."""
        if noise is not None and noise.is_left_alone:
            return f"left as it is: {noise.summary}"
        return "left as it is" if self.warning is None else f"left as it is: {self.warning}"

    def _describe_strays(self, noise: Noise) -> str:
        """That only stray vertices were moved."""
        return f"{_count_strays(self.outliers)} put back; {noise.summary}"

    def _final_rows(self, edge: float) -> Rows:
        """The rows at the end: displacement, strays, welded vertices, time, warning."""
        rows = [("moved", f"{format_length(self.displacement, edge)} (RMS)")]
        if len(self.outliers):
            rows.append(("put back", _count_strays(self.outliers)))
        if self.welded:
            rows.append(("welded", f"{self.welded} vertices move with another one at their place"))
        rows += [("mean edge", f"{edge:.4g}"), ("time", f"{self.seconds:.2f} s")]
        return rows if self.warning is None else [*rows, ("warning", self.warning)]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SmoothingResult(FilterResult):
    """The smoothed surface, and the evidence. Further fields are those of :class:`FilterResult`.

    Attributes
    ----------
    cutoff : float
        Eigenvalue of the Laplacian that the response is cut off at, in (0, 2].
    modes : float
        Number of modes below the cut-off: as given, or from the wavelength, by the law of the regular lattice.
    modes_error : float
        Standard error of that number relative to it; 0 where the eigenvalues were computed, NaN for the lattice's law.
    wavelength : float
        Length of the surface wave at the cut-off, in mesh units.
    mean_edge : float
        Mean edge length of the input, in mesh units.
    response, laplacian, method : str
        As used; ``method`` is never ``"auto"``.
    barycenter_weight : float or (n,) float64
        0 for the plain low-pass, which is the limit.
    iterations : int
    degree : int
        Sweeps over the mesh an iteration: the degree of the Chebyshev series; 0 for the exact method.
    response_error : float
        Bound on the error of the polynomial in any mode's displacement, relative to its differential coordinates (on a
        regular mesh), or its coordinates for a plain low-pass; 0 for the exact method. An ideal response is softened
        within 25 % of the cut-off, and modes there are not counted.
    cg_iterations : tuple of int
        Of the conjugate gradients, for each iteration.
    residual : float
        Largest relative residual of the normal equations of the least squares, computed from the solution.
    displacement_error : float
        Estimated error of the displacement due to ending the least squares early, relative to it; at most the
        ``tolerance``.
    setting : Setting or None
        The setting that was used, with a chosen weight and low-pass filled in; it reproduces the filter without the
        steps around an automatic choice.
    noise : Noise or None
        The noise of the input where the weight was chosen; None where it was given.
    estimated_error : float or None
        Expected root mean square error along the normals, in mesh units, where the weight was chosen. Below
        ``noise.resolution`` it cannot be distinguished from zero; 0 where the estimate is negative.
    """

    # the defaults are those of a surface without an edge
    cutoff: float = 2.0
    modes: float = 0.0
    modes_error: float = 0.0
    wavelength: float = 0.0
    mean_edge: float = 0.0
    response: str
    laplacian: str
    method: str = "exact"
    barycenter_weight: float | Floats
    iterations: int = 1
    degree: int = 0
    response_error: float = 0.0
    cg_iterations: tuple[int, ...] = ()
    residual: float = 0.0
    displacement_error: float = 0.0
    setting: Setting | None = None
    noise: Noise | None = None
    estimated_error: float | None = None

    @property
    def summary(self) -> str:
        """What was done, and why, in a sentence."""
        if self.displacement == 0:
            return self._describe_unmoved(self.noise)
        weight = f"isotropic, barycenter weight {format_weight(self.barycenter_weight)}"
        if self.noise is None or self.estimated_error is None:
            filter_ = weight if np.any(self.barycenter_weight) else "low-pass of the coordinates"
            return f"{filter_} as given; moved by {format_length(self.displacement, self.mean_edge)}"
        if self.noise.is_left_alone:
            return self._describe_strays(self.noise)
        if self.noise.kind == STAIRCASE:
            return f"{weight}, as far as the voxels allow; {self.noise.summary}"
        error = self.noise.format_error(self.estimated_error)
        return f"{weight} by estimated error {error} edges; {self.noise.summary}"

    def rows(self) -> Rows:
        """Noise, error, response, and how far vertices moved."""
        edge, rows = self.mean_edge, []
        if self.noise is not None and self.estimated_error is not None:
            rows.append(("noise", self.noise.describe_level()))
            if not self.noise.is_left_alone:
                rows.append(("estimated error", self.noise.describe_error(self.estimated_error)))
        kept = f"{format_length(self.wavelength, edge)}, {count_of(round(self.modes), 'mode')}"
        rows += [("response", f"{self.response}, keeps waves longer than {kept}")]
        return [*rows, *self._final_rows(edge)]


def format_weight(weight: float | Floats) -> str:
    """A barycenter weight, or the range of those over a surface."""
    if isinstance(weight, np.ndarray):
        return f"{weight.min():.3g} to {weight.max():.3g}"
    return f"{weight:.3g}"


def _count_strays(outliers: npt.NDArray[np.int64]) -> str:
    return "1 stray vertex" if len(outliers) == 1 else f"{len(outliers)} stray vertices"


R = TypeVar("R", bound=FilterResult)


def add_warnings(result: R, *warnings: str | None) -> R:
    """The result with further warnings, each once."""
    present = result.warning or ""
    new = (each for each in warnings if each is not None and each not in present)
    return replace(result, warning=join_warnings(result.warning, *new))


def join_warnings(*warnings: str | None) -> str | None:
    """Warnings in one string; None if there are none."""
    return "; ".join(filter(None, warnings)) or None
