"""Rounding of coordinates by file formats, of the input or the output.

Far from the origin, as in map coordinates, a format with seven digits or fewer silently changes the surface. The
rounding of each of pymeshlab's writers was measured; formats that are not listed here write all digits.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.errors import FileError

#: Rounding, in mean edges, above which it is reported, and above which the file is refused by default.
MAX_UNREPORTED, MAX_ACCEPTED = 0.01, 0.1

#: Largest coordinate that is rendered.
MAX_DRAWABLE = 1e18

# Minimum fraction of coordinates with a nonzero last bit as float32; none on integer grids
_MIN_FRACTION = 0.05


def output_rounding(vertices: Floats, faces: Integers, ending: str) -> float:
    """Return the largest change of a coordinate when a format is written, in mean edges.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    ending : str
        Suffix of the format, such as ``".stl"``.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.precision import output_rounding
    >>> V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) + 5e6 + 0.2, np.array([[0, 1, 2]])
    >>> output_rounding(V, F, ".ply"), output_rounding(V, F, ".stl") > 0.1
    (0.0, True)
    """
    rounded = _ROUNDED.get(ending.lower())
    used = _used(vertices, faces)
    if rounded is None or len(used) == 0:
        return 0.0
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        difference = np.abs(rounded(used) - used).max()
    return _in_edges(float(difference), vertices, faces)


def input_rounding(vertices: Floats, faces: Integers) -> float:
    """Estimate the rounding error of coordinates that were float32 before, in mean edges; otherwise 0.

    They were if all are representable as float32 and some have a nonzero last bit, which excludes integer grids.
    """
    used = _used(vertices, faces)
    if len(used) == 0 or np.abs(used).max() > np.finfo(np.float32).max:
        return 0.0
    with np.errstate(under="ignore"):
        single = used.astype(np.float32)
    if not np.array_equal(single, used):
        return 0.0
    largest = np.zeros(3)
    for axis in range(3):
        values = used[:, axis]
        step = np.spacing(np.abs(single[:, axis]).max()).astype(np.float64)
        top = np.abs(values) >= 0.5 * np.abs(values).max()  # with the largest or second largest spacing
        if step > 0 and np.mean(np.mod(values[top] / step, 2) != 0) > _MIN_FRACTION:
            largest[axis] = step / 2
    return _in_edges(float(largest.max()), vertices, faces)


def check_rounding(
    vertices: Floats, faces: Integers, source: str | Path, target: str | Path | None, force: bool
) -> list[str]:
    """Check the rounding of the coordinates by the formats of input and output.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    source, target : path
        Input and output file; the target is None if nothing is written.
    force : bool
        Only report, never refuse.

    Returns
    -------
    list of str
        Notices for the user, one line each.

    Raises
    ------
    FileError
        Coordinates are rounded by more than a tenth of a mean edge.
    """
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        return []  # not a valid mesh, which is reported elsewhere
    before = input_rounding(vertices, faces)
    found = [(before, f"{source}: its coordinates are float32, which this far from the origin rounded them by up to")]
    if target is not None:
        ending = Path(target).suffix.lower()
        after = output_rounding(vertices, faces, ending)
        found.append((after, f"{target}: {ending} has few digits, and this far from the origin rounds by up to"))
    remedies = (
        "export it with double precision, or subtract an offset (--force continues)",
        "write .ply or .obj, or subtract an offset first (--force writes it)",
    )
    notices = []
    for (size, text), remedy in zip(found, remedies, strict=False):
        if size > MAX_ACCEPTED and not force:
            raise FileError(f"{text} {size:.2g} mean edges; {remedy}")
        if size > MAX_UNREPORTED:
            notices.append(f"{text} {size:.2g} mean edges")
    return notices


def check_drawable(vertices: Floats, source: str | Path) -> None:
    """Refuse coordinates whose squares overflow in the renderer's float32; raises :class:`FileError`."""
    largest = np.abs(vertices[np.isfinite(vertices)]).max(initial=0.0)
    if largest > MAX_DRAWABLE:
        raise FileError(
            f"{source}: has coordinates of {largest:.2g}; pictures need at most {MAX_DRAWABLE:g}; scale it first"
        )


def _used(vertices: Floats, faces: Integers) -> Floats:
    """Return the finite vertices that faces use; all finite ones if there are no faces."""
    used = vertices[np.unique(faces)] if len(faces) else vertices
    return used[np.isfinite(used).all(axis=1)]


def _in_edges(distance: float, vertices: Floats, faces: Integers) -> float:
    if distance == 0 or len(faces) == 0:
        return 0.0
    _, exponent = np.frexp(np.abs(_used(vertices, faces)).max())
    V = np.ldexp(vertices, -exponent)  # squares must not overflow
    with np.errstate(invalid="ignore", over="ignore"):
        lengths = np.linalg.norm(V[faces] - V[np.roll(faces, 1, axis=1)], axis=2)
    edge = float(np.nanmean(lengths))
    return float(np.ldexp(distance, -exponent)) / edge if edge > 0 else np.inf


def _single(values: Floats) -> Floats:
    return values.astype(np.float32).astype(np.float64)


def _six_digits(values: Floats) -> Floats:
    """Round as ``%g`` does."""
    step = 10.0 ** (np.floor(np.log10(np.abs(values), where=values != 0, out=np.zeros_like(values))) - 5)
    return np.where(step > 0, np.rint(values / np.where(step > 0, step, 1)) * step, values)


def _six_decimals(values: Floats) -> Floats:
    """Round as ``%f`` does."""
    rounded = np.rint(values * 1e6) / 1e6
    return np.where(np.abs(values) < 1e9, rounded, values)  # larger doubles have no more decimals


def _single_decimals(values: Floats) -> Floats:
    return np.trunc(_single(values) * 1e6) / 1e6


_ROUNDED: dict[str, Callable[[Floats], Floats]] = {
    **dict.fromkeys((".stl", ".3ds", ".ctm", ".e57"), _single),
    **dict.fromkeys((".dae", ".wrl", ".x3d", ".json"), _six_digits),
    **dict.fromkeys((".xyz", ".dxf", ".idtf"), _six_decimals),
    ".3mf": _single_decimals,
}
