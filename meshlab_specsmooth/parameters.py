"""Check parameters: each function takes a name and a value, and returns a plain Python value or raises an error.

Numbers may be Python's or numpy's integers and floats of any width, fractions, or 0-d arrays. Booleans, strings,
complex numbers and decimals are not accepted as numbers.
"""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Callable, Iterable
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.errors import InvalidParameter

Function = TypeVar("Function", bound=Callable[..., Any])
Choice = TypeVar("Choice", bound=str)

# Machine epsilon of float64
_EPSILON = 2.0**-52

# The normal equations of the reconstruction are L^T L + w^2 C^T C, where both terms have norm about 1. If w^2 is below
# machine epsilon, the second term is lost in rounding; if it is above its reciprocal, the first one is.
BARYCENTER_WEIGHT_BOUNDS = (2.0**-26, 2.0**26)

# The low-pass of normals is (A + t L_w)^-1 A, where both terms have norm about 1 in units of the mean area. Beyond
# these bounds one of them is lost in rounding.
STRENGTH_BOUNDS = (_EPSILON, 1 / _EPSILON)

# The range weight is a function of |n_i - n_j|^2 / sigma^2 <= 4 / sigma^2. Above the upper bound all weights are 1 to
# two units in the last place; below the lower bound, the differences compared are rounding errors of the normals.
RANGE_SIGMA_BOUNDS = (_EPSILON, 2.0**26)

# A gain amplifies rounding errors as well: at the upper bound half of the digits are lost
GAIN_BOUNDS = (0.0, 2.0**26)

# Noise level in units of the extent of the mesh: above the upper bound the mesh is lost in rounding
NOISE_BOUNDS_IN_EXTENTS = (0.0, 1 / _EPSILON)

# Relative error of a displacement: below, it is lost in the rounding of the least squares; above, the result would not
# be that of the filter
TOLERANCE_BOUNDS = (1e-10, 0.1)

#: Of the sides of voxels: their squares are normal numbers.
SPACING_BOUNDS = (2.0**-500, 2.0**500)

MAX_ITERATIONS = 1000
MAX_FACE_ITERATIONS = 100
BAND_BOUNDS = (2, 4096)
MAX_PROBES = 10_000
MAX_TIMES = 10_000
MAX_WORKERS = 4096
# Accepted by every random number generator
MAX_SEED = 2**63 - 1

_MAX_SHOWN_LENGTH = 60
_MAX_SHOWN_BITS = 128


def check_number(name: str, value: object, low: float, high: float, what: str = "") -> float:
    """Return a number within inclusive bounds, as a float.

    Parameters
    ----------
    name : str
        Name of the parameter, for the error message.
    value : object
    low, high : float
        Inclusive bounds.
    what : str, optional
        The requirement as stated in the error message; by default the bounds.

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
    number = _to_float(value)
    if number is None or not low <= number <= high:
        wanted = what or f"one number from {low:.3g} to {high:.3g}"
        raise InvalidParameter(f"{name} is {show(value)}; it must be {wanted}")
    return number


def check_length(name: str, value: object) -> float:
    """Return a positive length in mesh units, as a float, or raise :class:`InvalidParameter`."""
    limits = np.finfo(np.float64)
    return check_number(
        name, value, float(limits.smallest_subnormal), float(limits.max), "a positive length in mesh units"
    )


def check_extent(name: str, value: object) -> float | str:
    """Return a positive length in mesh units, or a percentage of the bounding-box diagonal such as ``"0.5%"``.

    Raises
    ------
    InvalidParameter

    Examples
    --------
    >>> from meshlab_specsmooth.parameters import check_extent
    >>> check_extent("max_displacement", 2), check_extent("max_displacement", "0.5 %")
    (2.0, '0.5%')
    """
    if not isinstance(value, str):
        return check_length(name, value)
    try:
        percent = float(value.strip().removesuffix("%")) if value.strip().endswith("%") else math.nan
    except ValueError:
        percent = math.nan
    if not 0 < percent < math.inf:
        raise InvalidParameter(
            f"{name} is {show(value)}; it must be a positive length in mesh units, or a percentage of the bounding-box "
            "diagonal such as '0.5%'"
        )
    return f"{percent:g}%"


def resolve_length(value: float | str, V: npt.NDArray[np.float64]) -> float:
    """Return a length in mesh units for what :func:`check_extent` returned, for vertices (n, 3)."""
    if not isinstance(value, str):
        return value
    finite = V[np.isfinite(V).all(axis=1)]
    low, high = finite.min(axis=0, initial=np.inf), finite.max(axis=0, initial=-np.inf)
    return resolve_extent(value, math.hypot(*(high - low)) if len(finite) else 0.0)


def resolve_extent(value: float | str, diagonal: float) -> float:
    """Return the same for a bounding box with this diagonal."""
    return float(value.removesuffix("%")) / 100 * diagonal if isinstance(value, str) else value


def check_barycenter_weight(value: object) -> float:
    """Return the weight of the barycenter constraints, one number, or raise :class:`InvalidParameter`."""
    low, high = BARYCENTER_WEIGHT_BOUNDS
    return check_number(
        "barycenter_weight", value, low, high, f"one number from {low:.2g} to {high:.2g} (for the limit 0, low_pass)"
    )


def check_count(name: str, value: object, low: int, high: int, what: str = "") -> int:
    """Return an integer within inclusive bounds, as an int; floats are refused even if they are integral.

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
    meshlab_specsmooth.errors.InvalidParameter: iterations is 3.0; it must be an integer from 1 to 10
    """
    given = _unwrap(value)
    if _is_number(given) and isinstance(given, numbers.Integral) and low <= int(given) <= high:
        return int(given)
    raise InvalidParameter(f"{name} is {show(value)}; it must be {what or f'an integer from {low} to {high}'}")


def check_choice(name: str, value: Choice, known: Iterable[str]) -> Choice:
    """Return one of the known names, or raise :class:`InvalidParameter`.

    Examples
    --------
    >>> from meshlab_specsmooth.parameters import check_choice
    >>> check_choice("method", "speed", ["exact", "chebyshev"])
    Traceback (most recent call last):
    ...
    meshlab_specsmooth.errors.InvalidParameter: method is 'speed'; it must be one of 'exact', 'chebyshev'
    """
    names = tuple(known)
    if isinstance(value, str) and value in names:
        return cast(Choice, str(value))  # a plain str, also for np.str_
    raise InvalidParameter(f"{name} is {show(value)}; it must be one of {', '.join(map(repr, names))}")


def check_flag(name: str, value: object) -> bool:
    """Return True or False, or raise :class:`InvalidParameter`."""
    given = _unwrap(value)
    if isinstance(given, bool | np.bool_):
        return bool(given)
    raise InvalidParameter(f"{name} is {show(value)}; it must be True or False")


def check_function(name: str, value: Function) -> Function:
    """Return a callable, or raise :class:`InvalidParameter`."""
    if callable(value):
        return value
    raise InvalidParameter(f"{name} is {show(value)}; it must be a function")


def check_progress(value: Function | None) -> Function | None:
    """Return None or a callable for the fraction done, or raise :class:`InvalidParameter`."""
    return None if value is None else check_function("progress", value)


def check_path(name: str, value: object) -> str:
    """Return a path as a string, or raise :class:`InvalidParameter`.

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
    """Return one weight in [0, 1] for each vertex, as float64.

    Parameters
    ----------
    name : str
    given : (count,) array of bool, integers or floats
    count : int
        Number of vertices.

    Raises
    ------
    InvalidParameter
        Wrong shape or dtype, or a value outside [0, 1]; the message names the first one.
    """
    try:
        array = np.asarray(given)
    except MemoryError:
        raise
    except Exception as error:  # an object's __array__ may raise anything
        raise InvalidParameter(f"{name} is not an array of numbers ({error})") from error
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
    r"""Format a value on one short line, or only its type; never calls ``__repr__`` of a foreign class.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.parameters import show
    >>> show(np.zeros(3)), show("a\nb"), show(10**5000), show(object())
    ('an array of shape (3,)', "'a\\nb'", 'an integer of 16610 bits', 'of type object')
    """
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    if type(value) is int and value.bit_length() > _MAX_SHOWN_BITS:
        return f"an integer of {value.bit_length()} bits"
    if value is None or type(value) in (bool, int, float, complex) or isinstance(value, np.number | np.bool_):
        return str(value)
    if type(value) in (str, bytes, np.str_):
        shown = repr(str(value) if isinstance(value, str) else value)
        return shown if len(shown) <= _MAX_SHOWN_LENGTH else f"{shown[:_MAX_SHOWN_LENGTH]}..."
    return f"of type {type(value).__name__}"


def _unwrap(value: object) -> object:
    """Return the element of a 0-d array, or any other value unchanged."""
    return value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value


def _is_number(value: object) -> bool:
    """Whether a value is a real number; np.timedelta64 is registered as an integer but is a duration."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool | np.timedelta64)


def _to_float(value: object) -> float | None:
    """Convert to float, infinite on overflow; None if the value is not a number."""
    given: Any = _unwrap(value)
    if not _is_number(given):
        return None
    try:
        with np.errstate(over="ignore"):  # long doubles
            return float(given)
    except OverflowError:  # integers and fractions
        return np.inf if given > 0 else -np.inf
