"""Who is compared: MeshLab's smoothing filters and ours, each with the parameter that is its strength."""

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
    """What makes a filter smooth more, and the values that are tried.

    Attributes
    ----------
    parameter : str
        Of the filter; ``"times"`` is how often it is applied.
    values : tuple
        From gentle to strong. Of ``"modes"``, fractions are shares of the number of vertices.
    """

    parameter: str
    values: tuple[Any, ...]

    def __post_init__(self) -> None:
        _check_kind("strength.parameter", self.parameter, str, "a string")
        _check_kind("strength.values", self.values, tuple, "a tuple")


@dataclass(frozen=True)
class Competitor:
    """A filter to be compared: a name for people, and how it is called on a MeshSet.

    Attributes
    ----------
    name, filter : str
    parameters : mapping
        Those that are not left at their defaults; a
        :class:`~meshlab_specsmooth.meshlab.descriptors.Length` is a fraction of the bounding box's diagonal.
    times : int
        How often in succession.
    strength : Strength, optional
        None where nothing is swept.
    holds : tuple of str
        What the filter chooses by itself and returns. Its error is estimated with those held at what it chose for the
        mesh as given, so that it is the error of one setting.
    held_by : str
        The filter that runs at what was chosen, where this one has no parameters for it; empty where it has.
    notes : tuple of str
        Known faults, as footnotes.
    key : str
        Short name, as on the command line.

    Raises
    ------
    InvalidParameter
        An attribute is of the wrong kind.
    """

    name: str
    filter: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    times: int = 1
    strength: Strength | None = None
    holds: tuple[str, ...] = ()
    held_by: str = ""
    notes: tuple[str, ...] = ()
    key: str = ""

    def __post_init__(self) -> None:
        for name in ("name", "filter", "held_by", "key"):
            _check_kind(name, getattr(self, name), str, "a string")
        _check_kind("parameters", self.parameters, Mapping, "a mapping of names to values")
        for name in ("holds", "notes"):
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
        """The call as one would type it."""
        given = ", ".join(f"{name}={_typed(value)}" for name, value in self.parameters.items())
        return f"{self.filter}({given})" + (f" x {self.times}" if self.times > 1 else "")

    @property
    def ours(self) -> bool:
        """Whether it is one of this package's."""
        return "spectral" in self.filter or "edge_aware" in self.filter

    def at(self, value: Any, vertices: int) -> Competitor:
        """The same at another strength, on a mesh of so many vertices.

        Examples
        --------
        >>> from meshlab_specsmooth.comparison.competitors import COMPETITORS
        >>> COMPETITORS["taubin"].at(40, 1000).call
        'apply_coord_taubin_smoothing(stepsmoothnum=40)'
        >>> COMPETITORS["low-pass"].at(0.1, 1000).call
        'apply_coord_spectral_low_pass(modes=100)'
        >>> COMPETITORS["hc"].at(3, 1000).call
        'apply_coord_hc_laplacian_smoothing() x 3'
        """
        if self.strength is None:
            raise InvalidParameter(f"{self.name} has no strength")
        if self.strength.parameter == "times":
            return replace(self, times=value)
        if self.strength.parameter == "modes":
            value = max(1, min(round(value * vertices) if isinstance(value, float) else value, vertices))
        return replace(self, parameters={**self.parameters, self.strength.parameter: value})


def _check_kind(name: str, value: object, kind: type, what: str) -> None:
    if not isinstance(value, kind):
        raise InvalidParameter(f"{name} is {show(value)}; it must be {what}")


def _typed(value: Any) -> str:
    return f"pymeshlab.PercentageValue({100 * value.fraction:g})" if isinstance(value, Length) else repr(value)


_SELECTION = "MeshLab's filter ignores its parameter selected, and works on selected faces alone if there are any."
_EDGE_AWARE = ("start", "strength", "range_sigma", "iterations", "barycenter_weight")
_STEPS = (1, 2, 3, 5, 8, 13)

COMPETITORS = {
    competitor.key: competitor
    for competitor in (
        Competitor(
            "specsmooth denoise",
            "apply_coord_spectral_denoising",
            holds=_EDGE_AWARE,
            held_by="apply_coord_edge_aware_smoothing",
            key="denoise",
        ),
        Competitor(
            "MeshLab Laplacian (cotangent)",
            "apply_coord_laplacian_smoothing",
            strength=Strength("stepsmoothnum", _STEPS),
            notes=("Every Laplacian step shrinks the surface.",),
            key="laplacian",
        ),
        Competitor(
            "MeshLab Laplacian (umbrella)",
            "apply_coord_laplacian_smoothing",
            {"cotangentweight": False},
            strength=Strength("stepsmoothnum", _STEPS),
            notes=("Every Laplacian step shrinks the surface, and the umbrella pulls vertices along it, too.",),
            key="umbrella",
        ),
        Competitor(
            "MeshLab Taubin",
            "apply_coord_taubin_smoothing",
            strength=Strength("stepsmoothnum", (2, 5, 10, 20, 40)),
            notes=(_SELECTION,),
            key="taubin",
        ),
        Competitor(
            "MeshLab HC",
            "apply_coord_hc_laplacian_smoothing",
            strength=Strength("times", (1, 2, 4, 8, 16)),
            notes=(
                "MeshLab's HC has a sign error: what should push the surface back does not, and it shrinks a sphere as "
                "plain Laplacian steps do (to 65 % in 50).",
                _SELECTION,
            ),
            key="hc",
        ),
        Competitor(
            "MeshLab two-step",
            "apply_coord_two_steps_smoothing",
            strength=Strength("stepsmoothnum", (1, 3, 6)),
            key="two-step",
        ),
        Competitor(
            "MeshLab scale-dependent",
            "apply_coord_laplacian_smoothing_scale_dependent",
            strength=Strength("delta", (Length(0.0001), Length(0.0003), Length(0.001), Length(0.003))),
            notes=("Its default step, 1 % of the bounding box's diagonal, is too long for fine meshes: it diverges.",),
            key="scale-dependent",
        ),
        Competitor(
            "MeshLab surface-preserving",
            "apply_coord_laplacian_smoothing_surface_preserving",
            strength=Strength("iterations", (1, 3, 10)),
            key="surface-preserving",
        ),
        Competitor(
            "the paper (200 modes, w = 1)",
            "apply_coord_spectral_smoothing",
            {"modes": 200, "barycenter_weight": 1.0},
            strength=Strength("modes", (50, 200, 0.1)),
            notes=("The paper's one parameter is the number of modes; its strength is the barycenter weight, 1.",),
            key="paper",
        ),
        Competitor(
            "spectral low-pass",
            "apply_coord_spectral_low_pass",
            strength=Strength("modes", (0.3, 0.1, 0.03, 0.01)),
            key="low-pass",
        ),
        Competitor(
            "specsmooth automatic",
            "apply_coord_spectral_smoothing",
            strength=Strength("barycenter_weight", (1.0, 0.5, 0.3, 0.2, 0.1)),
            holds=("barycenter_weight",),
            key="automatic",
        ),
        Competitor(
            "specsmooth edge-aware",
            "apply_coord_edge_aware_smoothing",
            strength=Strength("strength", (0.02, 0.2, 1.0, 4.0)),
            holds=_EDGE_AWARE,
            key="edge-aware",
        ),
    )
}

DEFAULT = tuple(key for key in COMPETITORS if key != "surface-preserving")


def competitors(filters: Iterable[str | Competitor] | None = None) -> tuple[Competitor, ...]:
    """The competitors by their short names, or any filter by its name, with parameters if wanted.

    Parameters
    ----------
    filters : iterable of str or Competitor, optional
        ``"taubin"``, ``"apply_coord_taubin_smoothing"`` or ``"apply_coord_taubin_smoothing(stepsmoothnum=20)"``.

    Raises
    ------
    InvalidParameter
        No short name, and no name of a filter with literal keyword arguments.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.competitors import competitors
    >>> [c.name for c in competitors(["taubin", "apply_coord_unsharp_mask(weight=0.5, iterations=2)"])]
    ['MeshLab Taubin', 'apply_coord_unsharp_mask(weight=0.5, iterations=2)']
    """
    if isinstance(filters, str | bytes | Mapping) or not isinstance(filters, Iterable | None):
        raise InvalidParameter(f"filters is {show(filters)}; it must be several names or Competitors, as a list")
    wanted = DEFAULT if filters is None else tuple(filters)
    if not wanted:
        raise InvalidParameter("filters is empty; name at least one, or leave it out for all")
    found = tuple(each if isinstance(each, Competitor) else _parsed(each) for each in wanted)
    names = [each.name for each in found]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InvalidParameter(f"filters names {twice[0]!r} twice")
    return found


def _parsed(text: object) -> Competitor:
    wrong = (
        f"filters has {show(text)}; it must be one of {', '.join(COMPETITORS)}, or a call as filter_name(name=value)"
    )
    if not isinstance(text, str):
        raise InvalidParameter(wrong)
    if text in COMPETITORS:
        return COMPETITORS[text]
    try:
        node: ast.expr = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:  # what its parser raises of a text
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
    return Competitor(text.strip(), name.id, parameters)
