"""Transfer functions h(lambda): the factor by which a filter multiplies each mode.

A response is a pure function of the eigenvalue. Responses can be called, for plots, and combined: ``a * b`` applies one
after the other, ``~a`` is the complement 1 - h, and :func:`band` keeps the band between two cut-offs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import erfc

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.parameters import check_choice, check_number, show

Gain = Callable[[Floats], Floats]

# Points at which a gain is sampled, evenly spaced in arccos(1 - lambda)
_SAMPLES = 4096

# Half width of the band, relative to the cut-off, over which a step is softened for a polynomial, and the difference
# between the step and the softened step outside of it
TRANSITION = 0.25
TRANSITION_ERROR = 0.005


@dataclass(frozen=True)
class Response:
    """A transfer function on the spectrum [0, 2].

    Attributes
    ----------
    label : str
        For legends and reports.
    gain : callable
        h: eigenvalues (any shape) to gains (same shape).
    smooth_gain : callable
        What a polynomial approximates instead of ``gain``: the same function, except that a step is softened (see
        :data:`TRANSITION`).
    transitions : tuple of (float, float)
        Ranges of eigenvalues in which the two differ, one about each step.
    support : float
        Eigenvalue above which the gain is zero; 2 where it is not known to vanish. Below 2, the exact method computes
        only the eigenvectors up to it.

    Examples
    --------
    >>> from meshlab_specsmooth.spectral.response import heat
    >>> heat(0.5)([0.0, 0.5, 1.0])
    array([1.  , 0.5 , 0.25])
    >>> (~heat(0.5))([0.5])
    array([0.5])
    """

    label: str
    gain: Gain
    smooth_gain: Gain
    transitions: tuple[tuple[float, float], ...] = ()
    support: float = 2.0

    def __call__(self, eigenvalues: npt.ArrayLike) -> Floats:
        """The gains at ``eigenvalues``."""
        return self.gain(np.asarray(eigenvalues, dtype=np.float64))

    def __mul__(self, other: Response) -> Response:
        """Both responses, one after the other."""
        return Response(
            f"{self.label} x {other.label}",
            lambda x: self.gain(x) * other.gain(x),
            lambda x: self.smooth_gain(x) * other.smooth_gain(x),
            self.transitions + other.transitions,
            min(self.support, other.support),
        )

    def __invert__(self) -> Response:
        """The complement 1 - h: what this response removes."""
        return Response(
            f"1 - {self.label}", lambda x: 1 - self.gain(x), lambda x: 1 - self.smooth_gain(x), self.transitions
        )

    @property
    def cutoff(self) -> float:
        """Eigenvalue at which the gain first falls to one half; 2 where it never does.

        Examples
        --------
        >>> from meshlab_specsmooth.spectral.response import band, heat, ideal
        >>> round(heat(0.3).cutoff, 12), ideal(0.3).cutoff
        (0.3, 0.3)
        >>> round(band(heat(0.1), heat(1.0)).cutoff, 2), (~ideal(0.3)).cutoff
        (1.0, 2.0)
        """
        x = 1 - np.cos(np.linspace(0, np.pi, _SAMPLES + 1))
        passes = self(x) > 0.5
        falls = np.flatnonzero(passes[:-1] & ~passes[1:])
        if len(falls) == 0:
            return 2.0
        low, high = float(x[falls[0]]), float(x[falls[0] + 1])
        while low < (middle := (low + high) / 2) < high:
            low, high = (middle, high) if self(middle) > 0.5 else (low, middle)
        return low


#: From a cut-off, an eigenvalue in (0, 2], to the low-pass response that is cut off there.
Family = Callable[[float], Response]


def ideal(cutoff: float) -> Response:
    """1 up to the cut-off, 0 above: the paper's low-pass, which keeps the first f_a modes."""
    angle = float(_angle(cutoff))
    # softened in theta = arccos(1 - lambda), in which a polynomial of degree k has a uniform resolution of 1/k
    above = float(_angle(min(2.0, cutoff * (1 + TRANSITION)))) - angle
    below = angle - float(_angle(cutoff * (1 - TRANSITION)))
    width = (min(above, below) if cutoff * (1 + TRANSITION) < 2 else below) / _INVERSE_ERFC

    def softened(x: Floats) -> Floats:
        return np.asarray(0.5 * erfc((_angle(np.clip(x, 0, 2)) - angle) / width))

    def step(x: Floats) -> Floats:
        return (x <= cutoff).astype(np.float64)

    label = f"ideal({cutoff:.4g})"
    if cutoff >= 2:
        return Response(label, step, np.ones_like)
    return Response(label, step, softened, ((cutoff * (1 - TRANSITION), cutoff * (1 + TRANSITION)),), cutoff)


def _angle(eigenvalue: Floats | float) -> Floats:
    """arccos(1 - lambda), accurate for small lambda as well."""
    return np.asarray(2 * np.arcsin(np.sqrt(np.asarray(eigenvalue) / 2)))


# erfc(1.8214) / 2 = 0.005 = TRANSITION_ERROR
_INVERSE_ERFC = 1.8214


def from_gain(gain: Gain, label: str = "custom") -> Response:
    """A response with a given gain, a function smooth enough to be approximated by a polynomial.

    Examples
    --------
    >>> from meshlab_specsmooth.spectral.response import from_gain
    >>> from_gain(lambda x: 1 / (1 + x))([0.0, 1.0])
    array([1. , 0.5])
    """
    return Response(label, gain, gain)


def butterworth(cutoff: float) -> Response:
    """1 / (1 + (lambda / cut-off)^4): flat, then falling fast; a half at the cut-off."""
    return from_gain(lambda x: 1 / (1 + (x / cutoff) ** 4), f"butterworth({cutoff:.4g})")


def gaussian(cutoff: float) -> Response:
    """2^-(lambda / cut-off)^2; a half at the cut-off."""
    return from_gain(lambda x: np.exp2(-((x / cutoff) ** 2)), f"gaussian({cutoff:.4g})")


def heat(cutoff: float) -> Response:
    """2^-(lambda / cut-off), heat diffusion, a Gaussian in frequency; a half at the cut-off."""
    return from_gain(lambda x: np.exp2(-x / cutoff), f"heat({cutoff:.4g})")


RESPONSES: dict[str, Family] = {
    "ideal": ideal,
    "butterworth": butterworth,
    "gaussian": gaussian,
    "heat": heat,
}


def family_of(name: str) -> Family:
    """The family of responses of that name; raises InvalidParameter where there is none."""
    return RESPONSES[check_choice("response", name, RESPONSES)]


def response(name: str, cutoff: float) -> Response:
    """The response of that name with its cut-off at an eigenvalue.

    Raises
    ------
    InvalidParameter
        An unknown name, or a cut-off outside (0, 2].
    """
    family = family_of(name)
    least = float(np.finfo(np.float64).tiny)
    return family(check_number("cutoff", cutoff, least, 2.0, "an eigenvalue, in (0, 2]"))


def check_response(response: object) -> Response:
    """The response, if it is one and its gains are finite numbers.

    Raises
    ------
    InvalidParameter
        Another object, as from a user's family, or gains that are of another shape or not finite.
    """
    if not isinstance(response, Response):
        raise InvalidParameter(
            f"response is {show(response)}; it must be a Response, or a function from a cut-off to one"
        )
    x = 1 - np.cos(np.linspace(0, np.pi, 65))
    for gain in (response.gain, response.smooth_gain):
        values = np.asarray(gain(x))
        if values.shape != x.shape or not np.isfinite(values).all():
            raise InvalidParameter(f"response {response.label} must have one finite gain for each eigenvalue in [0, 2]")
    return response


def band(low: Response, high: Response) -> Response:
    """The band-pass between two low-passes: ``high`` times the complement of ``low``.

    Examples
    --------
    >>> from meshlab_specsmooth.spectral.response import band, ideal
    >>> band(ideal(0.1), ideal(0.5))([0.05, 0.3, 0.7])
    array([0., 1., 0.])
    """
    return high * ~low


def name_of(label: str) -> str:
    """The name of the family of a response, from its label.

    Examples
    --------
    >>> from meshlab_specsmooth.spectral.response import name_of, response
    >>> name_of(response("heat", 0.1).label)
    'heat'
    """
    return label.partition("(")[0]
