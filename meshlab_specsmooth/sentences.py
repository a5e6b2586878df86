"""What was done to a surface, and why, in a sentence; and the rows that results have in common."""

from __future__ import annotations

from meshlab_specsmooth.describe import format_length
from meshlab_specsmooth.noise.estimate import Noise


def describe_unmoved(noise: Noise | None, warning: str | None) -> str:
    """Why nothing was moved, so far as that is known."""
    if noise is not None and noise.is_left_alone:
        return f"left as it is: {noise.summary}"
    return "left as it is" if warning is None else f"left as it is: {warning}"


def describe_strays(noise: Noise, strays: int) -> str:
    """That stray vertices alone were moved."""
    return f"{count_strays(strays)} put back; {noise.summary}"


def count_strays(strays: int) -> str:
    """How many stray vertices, in words."""
    return "1 stray vertex" if strays == 1 else f"{strays} stray vertices"


def moved_rows(
    displacement: float, edge: float, strays: int, welded: int, seconds: float, warning: str | None
) -> list[tuple[str, str]]:
    """The rows at the end of a result: how far vertices moved, and what is to be known besides."""
    rows = [("moved", f"{format_length(displacement, edge)} (RMS)")]
    if strays:
        rows.append(("put back", count_strays(strays)))
    if welded:
        rows.append(("welded", f"{welded} vertices move with another one at their place"))
    rows += [("mean edge", f"{edge:.4g}"), ("time", f"{seconds:.2f} s")]
    return rows if warning is None else [*rows, ("warning", warning)]
