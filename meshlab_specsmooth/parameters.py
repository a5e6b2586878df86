"""Checks of parameters: each takes a name and a value of any kind, and returns a plain value or names what is wrong.

Numbers may be Python's or numpy's, integers or floats of any width, fractions, or arrays of no dimension. True and
False are no numbers, and neither are strings, complex numbers and decimals.
"""

from __future__ import annotations

import numbers
import os
from collections.abc import Callable, Iterable
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.errors import InvalidParameter

Function = TypeVar("Function", bound=Callable[..., Any])
Choice = TypeVar("Choice", bound=str)

# The spacing of numbers about 1
_EPSILON = 2.0**-52

# The normal equations of the reconstruction are L^T L + w^2 C^T C, both of size 1. Where w^2 is below the spacing of
# numbers about 1 the second is lost beside the first, and where it is above one over that the first beside the second.
BARYCENTER_WEIGHTS = (2.0**-26, 2.0**26)

# The low-pass of normals is (A + t L_w)^-1 A, both of size 1 in units of the mean area. Beyond these one of them is
# lost beside the other.
STRENGTHS = (_EPSILON, 1 / _EPSILON)

# Weights fall with the squared distance of unit normals over that of the width, which is 4 over it at most: from the
# upper bound on all are 1 to the last bit but two. Below the lower one they compare what is rounding in normals.
RANGE_SIGMAS = (_EPSILON, 2.0**26)

# What is multiplied with more has lost half of its digits, as rounding is multiplied, too
GAINS = (0.0, 2.0**26)

# A level of noise in extents of the mesh: beyond the upper bound nothing is left of the mesh beside it
NOISE_IN_EXTENTS = (0.0, 1 / _EPSILON)

MAX_ITERATIONS = 1000
MAX_FACE_ITERATIONS = 100
BANDS = (2, 4096)
MOST_PROBES = 10_000
MOST_TIMES = 10_000
MOST_WORKERS = 4096
# What every generator of random numbers takes
LARGEST_SEED = 2**63 - 1

_SHOWN = 60
_SHOWN_BITS = 128


def check_number(name: str, value: object, low: float, high: float, what: str = "") -> float:
    """A number within inclusive bounds, as a float.

    Parameters
    ----------
    name : str
        Of the parameter, for the error.
    value
        Anything.
    low, high : float
    what : str, optional
        What the parameter must be, for the error; the bounds by default.

    Raises
    ------
    InvalidParameter

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.parameters import check_number
    >>> check_number("gain", np.float32(0.5), 0.0, 2.0)
    0.5
    >>> check_number("gain", [0.5, 1.0], 0.0, 2.0)
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.InvalidParameter: gain is of type list; it must be one number from 0 to 2
    """
    number = _as_float(value)
    if number is None or not low <= number <= high:
        wanted = what or f"one number from {low:.3g} to {high:.3g}"
        raise InvalidParameter(f"{name} is {show(value)}; it must be {wanted}")
    return number


def check_length(name: str, value: object) -> float:
    """A positive length in mesh units, as a float; raises :class:`InvalidParameter`."""
    limits = np.finfo(np.float64)
    return check_number(
        name, value, float(limits.smallest_subnormal), float(limits.max), "a positive length in mesh units"
    )


def check_barycenter_weight(value: object) -> float:
    """How firmly barycenters are held: one number for all; raises :class:`InvalidParameter`."""
    low, high = BARYCENTER_WEIGHTS
    return check_number(
        "barycenter_weight", value, low, high, f"one number from {low:.2g} to {high:.2g} (for the limit 0, low_pass)"
    )


def check_count(name: str, value: object, low: int, high: int, what: str = "") -> int:
    """A whole number within inclusive bounds, as an int; a float is none, whatever its digits.

    Parameters
    ----------
    name, value, low, high, what
        As for :func:`check_number`.

    Raises
    ------
    InvalidParameter

    Examples
    --------
    >>> from meshlab_specsmooth.parameters import check_count
    >>> check_count("iterations", 3, 1, 10)
    3
    >>> check_count("iterations", 3.0, 1, 10)
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.InvalidParameter: iterations is 3.0; it must be a whole number from 1 to 10
    """
    given = _unwrapped(value)
    if _is_number(given) and isinstance(given, numbers.Integral) and low <= int(given) <= high:
        return int(given)
    raise InvalidParameter(f"{name} is {show(value)}; it must be {what or f'a whole number from {low} to {high}'}")


def check_choice(name: str, value: Choice, known: Iterable[str]) -> Choice:
    """One of the names known; raises :class:`InvalidParameter`.

    Examples
    --------
    >>> from meshlab_specsmooth.parameters import check_choice
    >>> check_choice("criterion", "speed", ["position", "normals"])
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.InvalidParameter: criterion is 'speed'; it must be one of 'position', 'normals'
    """
    names = tuple(known)
    if isinstance(value, str) and value in names:
        return cast(Choice, str(value))  # numpy's strings become plain ones
    raise InvalidParameter(f"{name} is {show(value)}; it must be one of {', '.join(map(repr, names))}")


def check_flag(name: str, value: object) -> bool:
    """True or False; raises :class:`InvalidParameter`."""
    given = _unwrapped(value)
    if isinstance(given, bool | np.bool_):
        return bool(given)
    raise InvalidParameter(f"{name} is {show(value)}; it must be True or False")


def check_function(name: str, value: Function) -> Function:
    """What can be called; raises :class:`InvalidParameter`."""
    if callable(value):
        return value
    raise InvalidParameter(f"{name} is {show(value)}; it must be a function")


def check_progress(value: Function | None) -> Function | None:
    """None, or a function of the fraction done; raises :class:`InvalidParameter`."""
    return None if value is None else check_function("progress", value)


def check_path(name: str, value: object) -> str:
    """A path as a string; raises :class:`InvalidParameter`.

    Examples
    --------
    >>> from pathlib import PurePosixPath
    >>> from meshlab_specsmooth.parameters import check_path
    >>> check_path("out", PurePosixPath("scans/smooth"))
    'scans/smooth'
    """
    path = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(path, str) or not path or "\0" in path:
        raise InvalidParameter(f"{name} is {show(value)}; it must be a path: a string, or a pathlib.Path")
    return path


def check_weights(name: str, given: object, count: int) -> npt.NDArray[np.float64]:
    """One weight in [0, 1] a vertex, as float64.

    Parameters
    ----------
    name : str
    given : (count,) array of bool, integers or floats
    count : int
        Of the vertices.

    Raises
    ------
    InvalidParameter
        Names the first vertex whose weight is none.
    """
    try:
        array = np.asarray(given)
    except MemoryError:
        raise
    except Exception as error:  # what an object's own __array__ raises may be anything
        raise InvalidParameter(f"{name} is no array of numbers ({error})") from error
    if array.shape != (count,):
        raise InvalidParameter(f"{name} has shape {array.shape}; pass one weight for each of the {count} vertices")
    if array.dtype.kind not in "biuf":
        raise InvalidParameter(f"{name} has dtype {array.dtype}; pass weights in [0, 1], or True and False")
    outside = ~((array >= 0) & (array <= 1))
    if outside.any():
        first = int(np.flatnonzero(outside)[0])
        raise InvalidParameter(f"{name}[{first}] is {array[first]}; weights lie in [0, 1]")
    return array.astype(np.float64)


def show(value: object) -> str:
    r"""A value on one short line, or its type; whatever its ``__repr__`` does.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.parameters import show
    >>> show(np.zeros(3)), show("a\nb"), show(10**5000), show(object())
    ('an array of shape (3,)', "'a\\nb'", 'an integer of 16610 bits', 'of type object')
    """
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    if type(value) is int and value.bit_length() > _SHOWN_BITS:
        return f"an integer of {value.bit_length()} bits"
    if value is None or type(value) in (bool, int, float, complex) or isinstance(value, np.number | np.bool_):
        return str(value)
    if type(value) in (str, bytes, np.str_):
        shown = repr(str(value) if isinstance(value, str) else value)
        return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."
    return f"of type {type(value).__name__}"


def _unwrapped(value: object) -> object:
    """What an array of no dimension holds; anything else as it is."""
    return value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value


def _is_number(value: object) -> bool:
    """Whether it is a real number; numpy's durations are integers by their type, and none by their meaning."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool | np.timedelta64)


def _as_float(value: object) -> float | None:
    """The value as a float, infinite where it is too large for one; None where it is no number."""
    given: Any = _unwrapped(value)
    if not _is_number(given):
        return None
    try:
        with np.errstate(over="ignore"):  # of long doubles
            return float(given)
    except OverflowError:  # of integers and fractions
        return np.inf if given > 0 else -np.inf
