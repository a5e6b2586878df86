"""Settings as values: what a filter is to do, checked, comparable, printable, and stored as plain data.

The fields of these classes are the parameters of the filters, with their defaults. Nothing else lists them: the
signatures of the functions (:mod:`.calls`), the options of the command line and the tests are made from them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.choices import Boundary, Method, ModeCount, ResponseName
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.operators.reconstruction import TOLERANCE
from meshlab_specsmooth.parameters import (
    GAIN_BOUNDS,
    MAX_ITERATIONS,
    SPACING_BOUNDS,
    TOLERANCE_BOUNDS,
    check_barycenter_weight,
    check_choice,
    check_count,
    check_extent,
    check_length,
    check_number,
    show,
)
from meshlab_specsmooth.spectral.design import METHODS, MODE_COUNTS
from meshlab_specsmooth.spectral.low_pass import LOW_PASSES, CutoffResponse, Ideal, LowPassLike, make_low_pass
from meshlab_specsmooth.spectral.response import Family, Response

BOUNDARIES = ("auto", "fixed", "curve", "free")

S = TypeVar("S", bound="Setting")

#: For a field, the keywords that stand for it in a call, with their defaults.
Replaced = dict[str, dict[str, Any]]

_IDEAL = Ideal()


@dataclass(frozen=True, eq=False, repr=False)
class Setting:
    """Base of the settings: equal where all fields are equal, printed without defaults, stored as a dict."""

    #: Keywords that the functions take in place of a field.
    replaced: ClassVar[Replaced] = {}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Setting):
            return NotImplemented
        return type(self) is type(other) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        given = [
            f"{each.name}={getattr(self, each.name)!r}"
            for each in fields(self)
            if not _is_same(getattr(self, each.name), each.default)
        ]
        return f"{type(self).__name__}({', '.join(given)})"

    def _key(self) -> tuple[object, ...]:
        return tuple(_hashable(getattr(self, each.name)) for each in fields(self))

    @classmethod
    def of(cls: type[S], **given: Any) -> S:
        """A setting from the keywords of a call."""
        return cls(**given)

    def to_dict(self) -> dict[str, Any]:
        """The fields that differ from their defaults, as numbers, strings and lists, for JSON.

        Raises
        ------
        InvalidParameter
            A response that is a function of your own, which is not data.

        Examples
        --------
        >>> import meshlab_specsmooth as mss
        >>> setting = mss.Smoothing(low_pass=mss.Heat(wavelength=3.0), barycenter_weight=0.5)
        >>> setting.to_dict()
        {'setting': 'Smoothing', 'low_pass': {'response': 'heat', 'wavelength': 3.0}, 'barycenter_weight': 0.5}
        >>> mss.Smoothing.from_dict(setting.to_dict()) == setting
        True
        """
        stored: dict[str, Any] = {"setting": type(self).__name__}
        for each in fields(self):
            value = getattr(self, each.name)
            if not _is_same(value, each.default):
                stored[each.name] = _to_data(each.name, value)
        return stored

    @property
    def is_data(self) -> bool:
        """Whether :meth:`to_dict` can store it: no response is a function of your own."""
        return not any(_is_code(getattr(self, each.name)) for each in fields(self))

    @classmethod
    def from_dict(cls: type[S], stored: dict[str, Any]) -> S:
        """The setting that :meth:`to_dict` stored; raises :class:`InvalidParameter`."""
        given = dict(stored)
        name = given.pop("setting", cls.__name__)
        if name != cls.__name__:
            raise InvalidParameter(f"setting is {show(name)}; it must be {cls.__name__!r}")
        unknown = given.keys() - {each.name for each in fields(cls)}
        if unknown:
            raise InvalidParameter(f"{cls.__name__} has no {min(unknown)}")
        return cls(**{key: _from_data(value) for key, value in given.items()})

    def _set(self, **checked: object) -> None:
        """Store checked values; for ``__post_init__``."""
        for name, value in checked.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False, repr=False)
class Smoothing(Setting):
    """The paper's three steps: low-pass the differential coordinates, reconstruct with barycenter constraints.

    Parameters
    ----------
    low_pass : Ideal, Butterworth, Gaussian, Heat or Response, optional
        Step 2. A :class:`meshlab_specsmooth.Response` is a function of the eigenvalue in [0, 2], with a cut-off of its
        own. Chosen if not given: ideal, or heat or ideal by estimated error where the weight is chosen too.
    barycenter_weight : float or (n,) array, optional
        w from 1.5e-8 to 6.7e7, dimensionless: how firmly the barycenters are held. It is the strength of the filter,
        more than the cut-off is: 1 is the paper, 0.3 suits noise of 0.2 edge lengths. An array holds the weight at each
        vertex, for noise that differs over the surface. If not given, the noise is estimated
        (:func:`meshlab_specsmooth.estimate_noise`), impulses are clipped, and the weight of least estimated error is
        used; ``result.noise`` is the estimate. Single stray vertices are put back first. Components of different scale
        or noise are smoothed one by one. Where noise and shape cannot be separated, nothing is moved, and where the
        shape would change by more than the noise explains, a weaker result or the input is returned; ``result.warning``
        says so.
    spacing : float or (3,) floats, optional
        Sides of the voxels, in mesh units and along x, y and z, where the surface was made from a binary mask: the
        weight is then the smallest with which nearly all vertices stay within about half a voxel of where they were.
        Recognized if not given, where the mesh is unchanged but for its position, orientation and scale.
    iterations : int
        How often the three steps are applied, each time to the last result; at most 1000.
    method : {"auto", "exact", "chebyshev"}
        How h(L) is applied: with eigenvectors, or with a polynomial; ``"auto"`` is exact up to 1000 vertices.
    mode_count : {"estimate", "exact"}
        How ``modes`` becomes a cut-off: from the density of modes, with the error that the result states, or by a few
        sparse factorizations; up to 1000 vertices it is always exact.
    tolerance : float
        Relative error of the displacement at which polynomials are cut off and the least squares end, from 1e-10 to
        0.1. The default, 0.003, does not show: noise of 0.2 edges is moved by at most 0.0006 edges differently.

    Other Parameters
    ----------------
    response : {"auto", "ideal", "butterworth", "gaussian", "heat"}, Response, or callable
        Shape of the low-pass: a name, a function from a cut-off eigenvalue to a
        :class:`meshlab_specsmooth.Response`, or a response with a cut-off of its own. ``"auto"`` is ideal where
        ``modes`` or ``wavelength`` is given, as in the paper. Otherwise it is heat, or, where the weight is chosen on a
        mesh of at most 100 000 vertices, heat or ideal by estimated error.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> paper = mss.Smoothing(low_pass=mss.Ideal(modes=200), barycenter_weight=1)
    >>> paper
    Smoothing(low_pass=Ideal(modes=200), barycenter_weight=1.0)
    """

    low_pass: LowPassLike | None = None
    barycenter_weight: float | Floats | None = None
    spacing: float | tuple[float, float, float] | None = None
    iterations: int = 1
    method: Method = "auto"
    mode_count: ModeCount = "estimate"
    tolerance: float = TOLERANCE

    replaced: ClassVar[dict[str, dict[str, Any]]] = {
        "low_pass": {"modes": None, "wavelength": None, "response": "auto"}
    }

    def __post_init__(self) -> None:
        weight = self.barycenter_weight
        self._set(
            low_pass=_check_low_pass(self.low_pass, is_optional=True),
            barycenter_weight=None if weight is None else check_weight_field(weight),
            spacing=None if self.spacing is None else check_spacing(self.spacing, weight is not None),
            iterations=check_count("iterations", self.iterations, 1, MAX_ITERATIONS),
            method=check_choice("method", self.method, METHODS),
            mode_count=check_choice("mode_count", self.mode_count, MODE_COUNTS),
            tolerance=check_number("tolerance", self.tolerance, *TOLERANCE_BOUNDS),
        )

    @classmethod
    def of(cls, *, modes: Any = None, wavelength: Any = None, response: Any = "auto", **given: Any) -> Smoothing:
        """A setting from the keywords of :func:`meshlab_specsmooth.smooth`."""
        return cls(low_pass=make_low_pass(response, modes, wavelength, ("auto",)), **given)


@dataclass(frozen=True, eq=False, repr=False)
class LowPass(Setting):
    """Plain spectral smoothing of the coordinates, V' = h(L) V.

    Parameters
    ----------
    low_pass : Ideal, Butterworth, Gaussian, Heat or Response
        As for :class:`Smoothing`.
    method, mode_count
        As for :class:`Smoothing`.

    Other Parameters
    ----------------
    response : {"ideal", "butterworth", "gaussian", "heat"}, Response, or callable
        Shape of the low-pass, as for :func:`meshlab_specsmooth.smooth`.
    """

    low_pass: LowPassLike = _IDEAL
    method: Method = "auto"
    mode_count: ModeCount = "estimate"

    replaced: ClassVar[dict[str, dict[str, Any]]] = {
        "low_pass": {"modes": None, "wavelength": None, "response": "ideal"}
    }

    def __post_init__(self) -> None:
        self._set(
            low_pass=_check_low_pass(self.low_pass),
            method=check_choice("method", self.method, METHODS),
            mode_count=check_choice("mode_count", self.mode_count, MODE_COUNTS),
        )

    @classmethod
    def of(cls, *, modes: Any = None, wavelength: Any = None, response: Any = "ideal", **given: Any) -> LowPass:
        """A setting from the keywords of :func:`meshlab_specsmooth.low_pass`."""
        low_pass = make_low_pass(response, modes, wavelength)
        return cls(low_pass=_check_low_pass(low_pass), **given)


@dataclass(frozen=True, eq=False, repr=False)
class Enhancement(Setting):
    """Amplify a band of the surface's detail: delta' = delta + (gain - 1) band(L) delta.

    Parameters
    ----------
    longest, shortest : float, optional
        The longest and the shortest wave of the band, in mesh units; 30 and 6 mean edge lengths by default.
    gain : float
        Factor for the band's differential coordinates: 1 changes nothing, 2 doubles, 0 removes.
    response : {"butterworth", "ideal", "gaussian", "heat"}, or callable
        Shape of the band's edges: a name, or a function from a cut-off eigenvalue to a
        :class:`meshlab_specsmooth.Response`.
    barycenter_weight : float
        w > 0: the barycenters hold waves back whose eigenvalue is below w, so it is smaller here than for smoothing.
    method : {"auto", "exact", "chebyshev"}
        As for :func:`meshlab_specsmooth.smooth`.
    tolerance : float
        As for :func:`meshlab_specsmooth.smooth`.
    """

    longest: float | None = None
    shortest: float | None = None
    gain: float = 2.0
    response: ResponseName | Family = "butterworth"
    barycenter_weight: float = 0.1
    method: Method = "auto"
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        response = self.response
        self._set(
            longest=None if self.longest is None else check_length("longest", self.longest),
            shortest=None if self.shortest is None else check_length("shortest", self.shortest),
            gain=check_number("gain", self.gain, *GAIN_BOUNDS),
            response=response if callable(response) else check_choice("response", response, LOW_PASSES),
            barycenter_weight=check_barycenter_weight(self.barycenter_weight),
            method=check_choice("method", self.method, METHODS),
            tolerance=check_number("tolerance", self.tolerance, *TOLERANCE_BOUNDS),
        )

    @property
    def family(self) -> Family:
        """The family of responses of the band's edges."""
        return LOW_PASSES[self.response]().family if isinstance(self.response, str) else self.response


@dataclass(frozen=True, eq=False, repr=False)
class Region(Setting):
    """Where a filter acts.

    Parameters
    ----------
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"fixed"``: it stays to the bit. ``"curve"``: it is smoothed
        along itself by the same three steps, except around small holes (shorter than the wavelength), which stay.
        ``"free"``: it is smoothed like the rest, which pulls it inward (the paper). ``"auto"`` is ``"fixed"``, unless
        the weight is chosen and the noise is correlated between neighbors: then the boundary moves as the rest does,
        but across the surface only.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them without a seam.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        Fraction of the removed detail that features keep: 0 smooths them like the rest, 1 keeps them, above 1 enhances
        them. Without ``features`` it has no effect.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
    """

    boundary: Boundary = "auto"
    mask: npt.ArrayLike | None = None
    features: npt.ArrayLike | None = None
    feature_gain: float = 1.0
    max_displacement: float | str | None = None

    def __post_init__(self) -> None:
        self._set(
            boundary=check_choice("boundary", self.boundary, BOUNDARIES),
            feature_gain=check_number("feature_gain", self.feature_gain, *GAIN_BOUNDS),
            max_displacement=None
            if self.max_displacement is None
            else check_extent("max_displacement", self.max_displacement),
        )


#: The whole surface, its boundary treated as the default is.
EVERYWHERE = Region()


def check_weight_field(given: object) -> float | Floats:
    """A barycenter weight, or one for each vertex; raises :class:`InvalidParameter`."""
    if not isinstance(given, list | tuple | np.ndarray) or np.ndim(given) == 0:
        return check_barycenter_weight(given)
    array = np.asarray(given)
    if array.ndim != 1 or array.dtype.kind not in "iuf":
        raise InvalidParameter(f"barycenter_weight is {show(array)}; pass one number, or one for each vertex")
    for i in np.flatnonzero(~((array > 0) & np.isfinite(array)))[:1]:
        raise InvalidParameter(f"barycenter_weight[{i}] is {array[i]}; weights are positive numbers")
    for bound in (array.min(), array.max()):
        check_barycenter_weight(float(bound))
    stored = array.astype(np.float64)
    stored.flags.writeable = False
    return stored


def check_spacing(given: object, is_weight_given: bool = False) -> float | tuple[float, float, float]:
    """Sides of voxels, one number or three; raises :class:`InvalidParameter`."""
    if is_weight_given:
        raise InvalidParameter("spacing and barycenter_weight are both given; give one of them")
    if not isinstance(given, list | tuple | np.ndarray):
        return check_number("spacing", given, *SPACING_BOUNDS)
    if np.shape(given) != (3,):
        raise InvalidParameter(f"spacing is {show(given)}; it must be a length, or one for each of x, y and z")
    x, y, z = (check_number(f"spacing[{i}]", each, *SPACING_BOUNDS) for i, each in enumerate(given))
    return x, y, z


def _check_low_pass(given: object, is_optional: bool = False) -> Any:
    if isinstance(given, CutoffResponse | Response) or (given is None and is_optional):
        return given
    raise InvalidParameter(f"low_pass is {show(given)}; it must be Ideal(...), Heat(...), ... or a Response")


def _is_same(a: object, b: object) -> bool:
    return _hashable(a) == _hashable(b)


def _hashable(value: object) -> object:
    if isinstance(value, np.ndarray | list):
        array = np.asarray(value)
        return array.shape, array.dtype.kind == "b", array.astype(np.float64).tobytes()
    return value


def _is_code(value: object) -> bool:
    """Whether a value is a function or a response of one's own."""
    if type(value) in LOW_PASSES.values():
        return False
    return callable(value) or isinstance(value, CutoffResponse | Response)


def _to_data(name: str, value: object) -> Any:
    if isinstance(value, CutoffResponse):
        for response, kind in LOW_PASSES.items():
            if type(value) is kind:
                cutoffs = {"modes": value.modes, "wavelength": value.wavelength}
                return {"response": response} | {k: v for k, v in cutoffs.items() if v is not None}
    if isinstance(value, np.ndarray | list | tuple):
        return np.asarray(value).tolist()
    if _is_code(value):
        raise InvalidParameter(f"{name} is a function of your own, which is not data; store what it is made from")
    return value


def _from_data(value: Any) -> Any:
    if isinstance(value, dict):
        return make_low_pass(**value)
    return np.asarray(value) if isinstance(value, list) else value
