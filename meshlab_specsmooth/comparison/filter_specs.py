"""The catalog of filters to compare: MeshLab's smoothing filters and this package's, with their strength parameters.

The demo, the comparison and the benchmarks all take their filters from here.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab.descriptors import Length
from meshlab_specsmooth.parameters import MAX_TIMES, check_count, show


@dataclass(frozen=True)
class Strength:
    """The strength parameter of a filter and the values to sweep.

    Attributes
    ----------
    parameter : str
        Name of a parameter of the filter, or ``"times"``, the number of times that the filter is applied.
    values : tuple
        From weak to strong smoothing. For ``"modes"``, a float is a fraction of the number of vertices.
    """

    parameter: str
    values: tuple[Any, ...]

    def __post_init__(self) -> None:
        _check_kind("strength.parameter", self.parameter, str, "a string")
        _check_kind("strength.values", self.values, tuple, "a tuple")


@dataclass(frozen=True)
class FilterSpec:
    """A filter of a MeshSet with its parameters: one entry of a comparison.

    Attributes
    ----------
    name : str
        Display name.
    filter : str
        Name of the MeshLab filter, or of one of this package's.
    parameters : mapping
        Parameters that differ from the filter's defaults. A
        :class:`~meshlab_specsmooth.meshlab.descriptors.Length` is a fraction of the diagonal of the bounding box.
    times : int
        Number of times that the filter is applied in succession.
    strength : Strength, optional
        The parameter to sweep; None for no sweep.
    auto_parameters : tuple of str
        Parameters that the filter chooses automatically and returns. The error is estimated with these fixed at the
        values chosen for the given mesh, because the estimate is valid for one fixed setting only.
    rerun_filter : str
        The filter that takes ``auto_parameters`` as parameters, if this one does not; else empty.
    notes : tuple of str
        Known faults, shown as footnotes.
    key : str
        Short name, as used on the command line.

    Raises
    ------
    InvalidParameter
        An attribute has the wrong type, or ``times`` is out of range.
    """

    name: str
    filter: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    times: int = 1
    strength: Strength | None = None
    auto_parameters: tuple[str, ...] = ()
    rerun_filter: str = ""
    notes: tuple[str, ...] = ()
    key: str = ""

    def __post_init__(self) -> None:
        for name in ("name", "filter", "rerun_filter", "key"):
            _check_kind(name, getattr(self, name), str, "a string")
        _check_kind("parameters", self.parameters, Mapping, "a mapping of names to values")
        for name in ("auto_parameters", "notes"):
            _check_kind(name, getattr(self, name), tuple, "a tuple of strings")
            for i, each in enumerate(getattr(self, name)):
                _check_kind(f"{name}[{i}]", each, str, "a string")
        for each in self.parameters:
            _check_kind("a name in parameters", each, str, "a string")
        if self.strength is not None:
            _check_kind("strength", self.strength, Strength, "a Strength, or None")
        object.__setattr__(self, "times", check_count("times", self.times, 1, MAX_TIMES))

    @property
    def call(self) -> str:
        """The filter call as Python source, without the MeshSet."""
        given = ", ".join(f"{name}={_format_argument(value)}" for name, value in self.parameters.items())
        return f"{self.filter}({given})" + (f" x {self.times}" if self.times > 1 else "")

    @property
    def ours(self) -> bool:
        """Whether the filter belongs to this package."""
        return "spectral" in self.filter or "edge_aware" in self.filter

    def with_strength(self, value: Any, vertex_count: int) -> FilterSpec:
        """Return the same filter at another strength, for a mesh with ``vertex_count`` vertices.

        Examples
        --------
        >>> from meshlab_specsmooth.comparison.filter_specs import FILTER_SPECS
        >>> FILTER_SPECS["taubin"].with_strength(40, 1000).call
        'apply_coord_taubin_smoothing(stepsmoothnum=40)'
        >>> FILTER_SPECS["low-pass"].with_strength(0.1, 1000).call
        'apply_coord_spectral_low_pass(modes=100)'
        >>> FILTER_SPECS["hc"].with_strength(3, 1000).call
        'apply_coord_hc_laplacian_smoothing() x 3'
        """
        if self.strength is None:
            raise InvalidParameter(f"{self.name} has no strength parameter")
        if self.strength.parameter == "times":
            return replace(self, times=value)
        if self.strength.parameter == "modes":
            value = max(1, min(round(value * vertex_count) if isinstance(value, float) else value, vertex_count))
        return replace(self, parameters={**self.parameters, self.strength.parameter: value})


def _check_kind(name: str, value: object, kind: type, what: str) -> None:
    if not isinstance(value, kind):
        raise InvalidParameter(f"{name} is {show(value)}; it must be {what}")


def _format_argument(value: Any) -> str:
    return f"pymeshlab.PercentageValue({100 * value.fraction:g})" if isinstance(value, Length) else repr(value)


_SELECTION = "MeshLab's filter ignores its parameter selected and works on the selected faces whenever there are any."
_EDGE_AWARE = ("start", "strength", "range_sigma", "iterations", "barycenter_weight")
_STEPS = (1, 2, 3, 5, 8, 13)

FILTER_SPECS = {
    spec.key: spec
    for spec in (
        FilterSpec(
            "specsmooth denoise",
            "apply_coord_spectral_denoising",
            auto_parameters=_EDGE_AWARE,
            rerun_filter="apply_coord_edge_aware_smoothing",
            key="denoise",
        ),
        FilterSpec(
            "MeshLab Laplacian (cotangent)",
            "apply_coord_laplacian_smoothing",
            strength=Strength("stepsmoothnum", _STEPS),
            notes=("Every Laplacian step shrinks the surface.",),
            key="laplacian",
        ),
        FilterSpec(
            "MeshLab Laplacian (umbrella)",
            "apply_coord_laplacian_smoothing",
            {"cotangentweight": False},
            strength=Strength("stepsmoothnum", _STEPS),
            notes=("Every Laplacian step shrinks the surface, and the umbrella also moves vertices along it.",),
            key="umbrella",
        ),
        FilterSpec(
            "MeshLab Taubin",
            "apply_coord_taubin_smoothing",
            strength=Strength("stepsmoothnum", (2, 5, 10, 20, 40)),
            notes=(_SELECTION,),
            key="taubin",
        ),
        FilterSpec(
            "MeshLab HC",
            "apply_coord_hc_laplacian_smoothing",
            strength=Strength("times", (1, 2, 4, 8, 16)),
            notes=(
                "MeshLab's HC has a sign error: its correction term has no effect, and it shrinks a sphere as much as "
                "plain Laplacian steps do (to 65 % in 50 steps).",
                _SELECTION,
            ),
            key="hc",
        ),
        FilterSpec(
            "MeshLab two-step",
            "apply_coord_two_steps_smoothing",
            strength=Strength("stepsmoothnum", (1, 3, 6)),
            key="two-step",
        ),
        FilterSpec(
            "MeshLab scale-dependent",
            "apply_coord_laplacian_smoothing_scale_dependent",
            strength=Strength("delta", (Length(0.0001), Length(0.0003), Length(0.001), Length(0.003))),
            notes=("Its default step, 1 % of the bounding box's diagonal, is too long for fine meshes: it diverges.",),
            key="scale-dependent",
        ),
        FilterSpec(
            "MeshLab surface-preserving",
            "apply_coord_laplacian_smoothing_surface_preserving",
            strength=Strength("iterations", (1, 3, 10)),
            key="surface-preserving",
        ),
        FilterSpec(
            "the paper (200 modes, w = 1)",
            "apply_coord_spectral_smoothing",
            {"modes": 200, "barycenter_weight": 1.0},
            strength=Strength("modes", (50, 200, 0.1)),
            notes=("The paper's only parameter is the number of modes; the strength depends on the fixed weight.",),
            key="paper",
        ),
        FilterSpec(
            "spectral low-pass",
            "apply_coord_spectral_low_pass",
            strength=Strength("modes", (0.3, 0.1, 0.03, 0.01)),
            key="low-pass",
        ),
        FilterSpec(
            "specsmooth automatic",
            "apply_coord_spectral_smoothing",
            strength=Strength("barycenter_weight", (1.0, 0.5, 0.3, 0.2, 0.1)),
            auto_parameters=("barycenter_weight", "response"),
            key="automatic",
        ),
        FilterSpec(
            "specsmooth edge-aware",
            "apply_coord_edge_aware_smoothing",
            strength=Strength("strength", (0.02, 0.2, 1.0, 4.0)),
            auto_parameters=_EDGE_AWARE,
            key="edge-aware",
        ),
    )
}

#: Compared by default: all but the slowest.
DEFAULT = tuple(key for key in FILTER_SPECS if key != "surface-preserving")


#: The filters of the demo, the best one last; the low-pass keeps as many modes as the paper does.
DEMO = (
    FILTER_SPECS["laplacian"],
    FILTER_SPECS["taubin"],
    replace(FILTER_SPECS["low-pass"], name="spectral low-pass (200 modes)", parameters={"modes": 200}),
    FILTER_SPECS["paper"],
    FILTER_SPECS["automatic"],
    FILTER_SPECS["edge-aware"],
)


def select_filters(filters: Iterable[str | FilterSpec] | None = None) -> tuple[FilterSpec, ...]:
    """Look up filters by short name, or parse any filter name or call.

    Parameters
    ----------
    filters : iterable of str or FilterSpec, optional
        For example ``"taubin"``, ``"apply_coord_taubin_smoothing"`` or
        ``"apply_coord_taubin_smoothing(stepsmoothnum=20)"``; :data:`DEFAULT` if not given.

    Raises
    ------
    InvalidParameter
        An entry is neither a short name nor a filter name with literal keyword arguments, or two have the same name.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.filter_specs import select_filters
    >>> [c.name for c in select_filters(["taubin", "apply_coord_unsharp_mask(weight=0.5, iterations=2)"])]
    ['MeshLab Taubin', 'apply_coord_unsharp_mask(weight=0.5, iterations=2)']
    """
    if isinstance(filters, str | bytes | Mapping) or not isinstance(filters, Iterable | None):
        raise InvalidParameter(f"filters is {show(filters)}; it must be a list of names or FilterSpecs")
    wanted = DEFAULT if filters is None else tuple(filters)
    if not wanted:
        raise InvalidParameter("filters is empty; name at least one, or leave it out for all")
    found = tuple(each if isinstance(each, FilterSpec) else _parse(each) for each in wanted)
    names = [each.name for each in found]
    repeated = [name for name in names if names.count(name) > 1]
    if repeated:
        raise InvalidParameter(f"filters contains {repeated[0]!r} twice")
    return found


def _parse(text: object) -> FilterSpec:
    wrong = (
        f"filters has {show(text)}; it must be one of {', '.join(FILTER_SPECS)}, or a call as filter_name(name=value)"
    )
    if not isinstance(text, str):
        raise InvalidParameter(wrong)
    if text in FILTER_SPECS:
        return FILTER_SPECS[text]
    try:
        node: ast.expr = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:  # all that ast.parse raises for a string
        raise InvalidParameter(wrong) from error
    name, parameters = node, {}
    if isinstance(node, ast.Call) and not node.args:
        name = node.func
        try:
            parameters = {str(word.arg): ast.literal_eval(word.value) for word in node.keywords}
        except (ValueError, TypeError, SyntaxError, RecursionError, MemoryError) as error:
            raise InvalidParameter(wrong) from error
    if not isinstance(name, ast.Name) or "_" not in name.id:
        raise InvalidParameter(wrong)
    return FilterSpec(text.strip(), name.id, parameters)
