"""Transfer functions h(lambda): what share of each mode a filter keeps.

Every response is a pure function of the eigenvalue, can be plotted by calling it, and can be combined: ``a * b`` is
one after the other, ``~a`` the complement 1 - h, and :func:`band` keeps what lies between two cut-offs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import erfc

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.parameters import check_choice, check_number

Gain = Callable[[Floats], Floats]

# Where a step is approximated by a polynomial it rises over a band about the cut-off: outside cut-off +- 25 % the
# softened step is within 0.5 % of the step.
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
        What a polynomial filter approximates instead of ``gain``: the same function, except that a step is softened
        (see :data:`TRANSITION`).
    transitions : tuple of (float, float)
        Where the two differ: the ranges of eigenvalues about each step.

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
        )

    def __invert__(self) -> Response:
        """The complement 1 - h: what this response removes."""
        return Response(
            f"1 - {self.label}", lambda x: 1 - self.gain(x), lambda x: 1 - self.smooth_gain(x), self.transitions
        )


def ideal(cutoff: float) -> Response:
    """1 up to the cut-off, 0 above: the paper's low-pass, which keeps the first f_a modes."""
    angle = float(_angle(cutoff))
    # the step is softened in theta = arccos(1 - lambda), where a polynomial of degree k resolves 1/k everywhere
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
    return Response(label, step, softened, ((cutoff * (1 - TRANSITION), cutoff * (1 + TRANSITION)),))


def _angle(eigenvalue: Floats | float) -> Floats:
    """The arccos of 1 - lambda, also where lambda is lost beside 1."""
    return np.asarray(2 * np.arcsin(np.sqrt(np.asarray(eigenvalue) / 2)))


# erfc(1.8214) / 2 = 0.005 = TRANSITION_ERROR
_INVERSE_ERFC = 1.8214


def _smooth(label: str, gain: Gain) -> Response:
    return Response(label, gain, gain)


def butterworth(cutoff: float) -> Response:
    """1 / (1 + (lambda / cut-off)^4): flat, then falling fast; a half at the cut-off."""
    return _smooth(f"butterworth({cutoff:.4g})", lambda x: 1 / (1 + (x / cutoff) ** 4))


def gaussian(cutoff: float) -> Response:
    """2^-(lambda / cut-off)^2; a half at the cut-off."""
    return _smooth(f"gaussian({cutoff:.4g})", lambda x: np.exp2(-((x / cutoff) ** 2)))


def heat(cutoff: float) -> Response:
    """2^-(lambda / cut-off), heat diffusion, a Gaussian in frequency; a half at the cut-off."""
    return _smooth(f"heat({cutoff:.4g})", lambda x: np.exp2(-x / cutoff))


RESPONSES: dict[str, Callable[[float], Response]] = {
    "ideal": ideal,
    "butterworth": butterworth,
    "gaussian": gaussian,
    "heat": heat,
}


def response(name: str, cutoff: float) -> Response:
    """The response of that name with its cut-off at an eigenvalue.

    Raises
    ------
    InvalidParameter
        An unknown name, or a cut-off outside (0, 2].
    """
    name = check_choice("response", name, RESPONSES)
    least = float(np.finfo(np.float64).tiny)
    return RESPONSES[name](check_number("cutoff", cutoff, least, 2.0, "an eigenvalue, in (0, 2]"))


def band(low: Response, high: Response) -> Response:
    """What ``high`` keeps and ``low`` does not: the band between two low-passes.

    Examples
    --------
    >>> from meshlab_specsmooth.spectral.response import band, ideal
    >>> band(ideal(0.1), ideal(0.5))([0.05, 0.3, 0.7])
    array([0., 1., 0.])
    """
    return high * ~low


def name_of(label: str) -> str:
    """The name of a response that :func:`response` made, from its label.

    Examples
    --------
    >>> from meshlab_specsmooth.spectral.response import name_of, response
    >>> name_of(response("heat", 0.1).label)
    'heat'
    """
    return label.partition("(")[0]
