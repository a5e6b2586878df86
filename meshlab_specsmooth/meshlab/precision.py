"""How far coordinates are rounded: by the format that they are written in, or by the one that they came in.

Far from the origin, as in map coordinates, a format of seven digits or less writes another surface without a word. What
each of pymeshlab's writers does was measured; those that are not named here write all digits.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.errors import FileError

#: Rounding, in mean edges, from which on it is said, and from which on nothing is written unless it is asked for.
TOLD, REFUSED = 0.01, 0.1

#: Coordinates beyond are not drawn.
LARGEST_DRAWN = 1e18

# the share of coordinates that must need the last bit of a float32: grids of whole numbers have none
_NEEDING = 0.05


def rounding(vertices: Floats, faces: Integers, ending: str) -> float:
    """The largest distance by which writing a format moves a vertex, in mean edges.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    ending : str
        Of the format, as ``".stl"``.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.precision import rounding
    >>> V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]) + 5e6 + 0.2, np.array([[0, 1, 2]])
    >>> rounding(V, F, ".ply"), rounding(V, F, ".stl") > 0.1
    (0.0, True)
    """
    rounded = _ROUNDED.get(ending.lower())
    used = _used(vertices, faces)
    if rounded is None or len(used) == 0:
        return 0.0
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        difference = np.abs(rounded(used) - used).max()
    return _in_edges(float(difference), vertices, faces)


def rounding_before(vertices: Floats, faces: Integers) -> float:
    """By how much coordinates were rounded that came as float32, in mean edges; 0 where they did not.

    They did where all are float32, and some need the last bit of one: not a grid of whole numbers.
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
        top = np.abs(values) >= 0.5 * np.abs(values).max()  # these have the coarsest steps, or the next
        if step > 0 and np.mean(np.mod(values[top] / step, 2) != 0) > _NEEDING:
            largest[axis] = step / 2
    return _in_edges(float(largest.max()), vertices, faces)


def check_rounding(
    vertices: Floats, faces: Integers, source: str | Path, target: str | Path | None, force: bool
) -> list[str]:
    """What is to be said before coordinates are smoothed, and written to a format.

    Parameters
    ----------
    vertices, faces : array
    source, target : path
        Files; None where nothing is written.
    force : bool
        Say, and do not refuse.

    Raises
    ------
    FileError
        They are rounded by more than a tenth of a mean edge.
    """
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        return []  # no mesh, which whoever works on it says
    before = rounding_before(vertices, faces)
    found = [(before, f"{source}: its coordinates are float32, and so far from the origin they were rounded by up to")]
    if target is not None:
        ending = Path(target).suffix.lower()
        after = rounding(vertices, faces, ending)
        found.append((after, f"{target}: {ending} has few digits, and so far from the origin it rounds by up to"))
    remedies = (
        "export it as double, or with an offset subtracted (--force goes on)",
        "write .ply or .obj, or subtract an offset first (--force writes it)",
    )
    notices = []
    for (size, text), remedy in zip(found, remedies, strict=False):
        if size > REFUSED and not force:
            raise FileError(f"{text} {size:.2g} mean edges; {remedy}")
        if size > TOLD:
            notices.append(f"{text} {size:.2g} mean edges")
    return notices


def check_drawable(vertices: Floats, source: str | Path) -> None:
    """Refuse coordinates whose squares a picture's float32 cannot hold; raises :class:`FileError`."""
    largest = np.abs(vertices[np.isfinite(vertices)]).max(initial=0.0)
    if largest > LARGEST_DRAWN:
        raise FileError(
            f"{source}: has coordinates of {largest:.2g}; pictures are drawn up to {LARGEST_DRAWN:g}; scale it first"
        )


def _used(vertices: Floats, faces: Integers) -> Floats:
    """The vertices that faces have; all where there are no faces."""
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
    """As ``%g`` prints."""
    step = 10.0 ** (np.floor(np.log10(np.abs(values), where=values != 0, out=np.zeros_like(values))) - 5)
    return np.where(step > 0, np.rint(values / np.where(step > 0, step, 1)) * step, values)


def _six_decimals(values: Floats) -> Floats:
    """As ``%f`` prints."""
    rounded = np.rint(values * 1e6) / 1e6
    return np.where(np.abs(values) < 1e9, rounded, values)  # beyond, doubles have no more


def _single_decimals(values: Floats) -> Floats:
    return np.trunc(_single(values) * 1e6) / 1e6


_ROUNDED: dict[str, Callable[[Floats], Floats]] = {
    **dict.fromkeys((".stl", ".3ds", ".ctm", ".e57"), _single),
    **dict.fromkeys((".dae", ".wrl", ".x3d", ".json"), _six_digits),
    **dict.fromkeys((".xyz", ".dxf", ".idtf"), _six_decimals),
    ".3mf": _single_decimals,
}
