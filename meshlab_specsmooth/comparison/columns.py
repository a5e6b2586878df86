"""The columns of a comparison: what is measured, and how values are printed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Measure:
    """A column of the tables: a quantity with its unit and formula, and the direction in which it improves.

    Attributes
    ----------
    key, label, unit, help : str
    better : {"low", "high", "zero", ""}
        ``""`` for neither.
    digits : int
        Number of decimals.
    """

    key: str
    label: str
    unit: str
    help: str
    better: str = "low"
    digits: int = 3


MEASURES = {
    measure.key: measure
    for measure in (
        Measure(
            "estimated_error",
            "estimated error",
            "edges",
            "Root mean square distance from the unknown true surface along its normals, estimated from the noisy mesh "
            "alone: Stein's unbiased risk estimate in its Monte-Carlo form (Ramani, Blu, Unser 2008). "
            "The uncertainty is its standard error due to the random perturbations and the noise level.",
        ),
        Measure(
            "true_error",
            "true error",
            "edges",
            "The same measured against the truth: root mean square of n . (v - truth) over the vertices, with n the "
            "normals of a smoothed guide surface.",
        ),
        Measure(
            "normal_error",
            "normal error",
            "degrees",
            "Mean angle between the face normals of result and truth (Zhang et al. 2015).",
            digits=2,
        ),
        Measure(
            "seconds",
            "time",
            "s",
            "Run time of the filter alone, after a first run on a small mesh, so that one-time loading and compilation "
            "are not timed; it depends on the load of this machine at that moment.",
            digits=2,
        ),
        Measure(
            "surface_error",
            "E_v",
            "edges",
            "Vertex-to-surface error sqrt(sum A_i d_i^2 / (3 sum A_f)), d_i the exact distance of vertex i to the "
            "truth (Sun et al. 2007; Zheng et al. 2011).",
        ),
        Measure(
            "vertex_error",
            "vertex RMS",
            "edges",
            "Root mean square distance of corresponding vertices, including movement along the surface.",
        ),
        Measure(
            "hausdorff",
            "Hausdorff",
            "edges",
            "MeshLab's Hausdorff distance to the truth, the larger of both directions.",
        ),
        Measure(
            "noise_removed",
            "noise removed",
            "%",
            "Decrease of the median of |n . L^2 V|, which responds to noise and hardly to shape.",
            "high",
            1,
        ),
        Measure(
            "feature_loss",
            "feature loss",
            "edges",
            "Root mean square displacement along the normals of the surface averaged over about three edges, at the "
            "tenth of the vertices where its curvature is largest.",
        ),
        Measure(
            "volume",
            "volume",
            "%",
            "Change of the enclosed volume relative to the truth, or to the mesh as given; closed meshes only.",
            "zero",
        ),
        Measure(
            "offset",
            "mean offset",
            "edges",
            "Mean displacement along the normals (swept volume per area) relative to the truth, or to the mesh as "
            "given; negative is inward. Also defined for open meshes.",
            "zero",
        ),
        Measure(
            "area", "area", "%", "Change of the area relative to the mesh as given; noise itself adds area.", "", 2
        ),
        Measure("boundary", "boundary", "%", "Change of the boundary length relative to the mesh as given.", "", 2),
        Measure("displacement", "displacement", "edges", "Root mean square displacement of the vertices.", ""),
        Measure("dihedral", "dihedral", "degrees", "Mean angle between the normals of neighboring faces.", "", 2),
        Measure(
            "quality",
            "triangle quality",
            "",
            "Mean of 2 r / R, with r the inscribed and R the circumscribed radius of each face: 1 if equilateral.",
            "high",
        ),
        Measure(
            "flips",
            "flipped faces",
            "%",
            "Faces whose normal differs by more than 90 degrees from that of the truth, or of the mesh as given.",
            digits=2,
        ),
        Measure(
            "intersections", "self-intersecting", "%", "Faces that intersect another face, found by MeshLab.", digits=2
        ),
    )
}


def format_number(value: float, digits: int, signed: bool = False) -> str:
    """Format a number with ``digits`` decimals; a value that rounds to zero has no sign.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.columns import format_number
    >>> format_number(-0.0004, 3), format_number(0.0126, 3, signed=True), format_number(-0.0126, 2)
    ('0.000', '+0.013', '-0.01')
    """
    text = f"{value:{'+' if signed else ''}.{digits}f}"
    return text if float(text) else f"{0:.{digits}f}"


def is_bound(error: float, uncertainty: float) -> bool:
    """Whether an estimated error is smaller than its uncertainty, so that only an upper bound is known."""
    return error < uncertainty


def format_estimate(error: float, uncertainty: float, *, with_uncertainty: bool = True) -> str:
    """Format an estimated error with or without its uncertainty; below its uncertainty it becomes an upper bound.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.columns import format_estimate
    >>> format_estimate(0.072, 0.007), format_estimate(0.0, 0.038)
    ('0.072 ± 0.007', 'at most 0.038')
    """
    if not math.isfinite(error):
        return ""
    if is_bound(error, uncertainty) or error < 0.0005:
        return f"at most {format_number(max(error + np.nan_to_num(uncertainty), 0.001), 3)}"
    value = format_value(MEASURES["estimated_error"], error)
    return f"{value} ± {format_number(uncertainty, 3)}" if with_uncertainty and math.isfinite(uncertainty) else value


def format_value(measure: Measure, value: float) -> str:
    """Format a value as its column prints it.

    Examples
    --------
    >>> from meshlab_specsmooth.comparison.columns import MEASURES, format_value
    >>> [format_value(MEASURES[key], x) for key, x in (("volume", -0.0123), ("normal_error", 4.189), ("area", 12345.6))]
    ['-0.012', '4.19', '1e+04']
    """
    if not math.isfinite(value):
        return ""
    if abs(value) >= 9999:
        return f"{value:.0e}"
    return format_number(value, measure.digits, signed=measure.better == "zero")
