"""Low-passes whose cut-off is stated on the mesh: as a number of modes kept, or as the shortest wave kept."""

from __future__ import annotations

from dataclasses import dataclass, field

from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.parameters import check_choice, check_count, check_function, check_length
from meshlab_specsmooth.spectral.response import Family, Response, butterworth, gaussian, heat, ideal

ONE_CUTOFF = "modes and wavelength both set the cut-off; give one of them"


@dataclass(frozen=True)
class CutoffResponse:
    """A low-pass by its family and its cut-off; without ``modes`` and ``wavelength`` it keeps waves of 20 mean edges.

    Parameters
    ----------
    modes : int, optional
        Number of modes kept, lowest first (the paper's f_a).
    wavelength : float, optional
        Shortest surface wave kept, in mesh units. Without this and ``modes``: 20 mean edge lengths.
    family : callable
        From the cut-off, an eigenvalue in (0, 2], to a :class:`Response`.

    Raises
    ------
    InvalidParameter
        Both cut-offs are given, or one is out of range.
    """

    modes: int | None = None
    wavelength: float | None = None
    family: Family = field(default=ideal)

    def __post_init__(self) -> None:
        if self.modes is not None and self.wavelength is not None:
            raise InvalidParameter(ONE_CUTOFF)
        if self.modes is not None:
            object.__setattr__(self, "modes", check_count("modes", self.modes, 1, 2**31 - 1, "a positive integer"))
        if self.wavelength is not None:
            object.__setattr__(self, "wavelength", check_length("wavelength", self.wavelength))
        check_function("response", self.family)

    def __repr__(self) -> str:
        cutoffs = (("modes", self.modes), ("wavelength", self.wavelength))
        given = [f"{name}={value!r}" for name, value in cutoffs if value is not None]
        if type(self) is CutoffResponse:
            given.append(f"family={self.family!r}")
        return f"{type(self).__name__}({', '.join(given)})"


@dataclass(frozen=True, repr=False)
class Ideal(CutoffResponse):
    """1 up to the cut-off, 0 above (the paper). Parameters as for :class:`CutoffResponse`.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> mss.Ideal(modes=200) == mss.Ideal(200), mss.Ideal(modes=200)
    (True, Ideal(modes=200))
    """

    family: Family = field(default_factory=lambda: ideal, init=False)


@dataclass(frozen=True, repr=False)
class Butterworth(CutoffResponse):
    """1 / (1 + (lambda / cut-off)^4). Parameters as for :class:`CutoffResponse`."""

    family: Family = field(default_factory=lambda: butterworth, init=False)


@dataclass(frozen=True, repr=False)
class Gaussian(CutoffResponse):
    """2^-(lambda / cut-off)^2. Parameters as for :class:`CutoffResponse`."""

    family: Family = field(default_factory=lambda: gaussian, init=False)


@dataclass(frozen=True, repr=False)
class Heat(CutoffResponse):
    """2^-(lambda / cut-off). Parameters as for :class:`CutoffResponse`."""

    family: Family = field(default_factory=lambda: heat, init=False)


#: Names of the families, as ``response`` takes them.
LOW_PASSES: dict[str, type[CutoffResponse]] = {
    "ideal": Ideal,
    "butterworth": Butterworth,
    "gaussian": Gaussian,
    "heat": Heat,
}

LowPassLike = CutoffResponse | Response


def make_low_pass(
    response: object, modes: int | None = None, wavelength: float | None = None, names: tuple[str, ...] = ()
) -> LowPassLike | None:
    """The low-pass that the keywords of a call describe; None where all of it is automatic.

    Parameters
    ----------
    response : str, Response, CutoffResponse, or callable
        A name, a response (which has its own cut-off), or a family.
    modes, wavelength
        The cut-off.
    names : tuple of str
        Names besides those of the families, as ``"auto"``.

    Raises
    ------
    InvalidParameter
    """
    if isinstance(response, Response | CutoffResponse):
        if modes is not None or wavelength is not None:
            raise InvalidParameter("response has a cut-off of its own; give neither modes nor wavelength beside it")
        return response
    if callable(response):
        return CutoffResponse(modes, wavelength, response)
    name = check_choice("response", response, (*names, *LOW_PASSES))  # type: ignore[type-var]
    if name == "auto":
        return None if modes is None and wavelength is None else Ideal(modes, wavelength)
    return LOW_PASSES[str(name)](modes, wavelength)
