"""The spectrum of a surface as one PNG: power, number of modes, and the response of a filter."""

from __future__ import annotations

import os

import numpy as np

from meshlab_specsmooth.errors import MissingExtra
from meshlab_specsmooth.operators.reconstruction import transfer_function
from meshlab_specsmooth.power_spectrum import Spectrum
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.spectral.response import Response

_SIZE = (10.0, 7.5)  # inches


def spectrum_plot(
    path: str | os.PathLike[str], spectrum: Spectrum, mean_edge: float, response: Response, weight: float, title: str
) -> None:
    """Write a PNG.

    Parameters
    ----------
    path : str or path
    spectrum : Spectrum
    mean_edge : float
        In mesh units.
    response, weight
        Low-pass h and barycenter weight w of the filter whose responses are plotted.
    title : str

    Raises
    ------
    MissingExtra
        Matplotlib is not installed.
    FileError
        The file cannot be written.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a plot", "report") from error
    figure = Figure(figsize=_SIZE, dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    powers, gains = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    s = spectrum
    seen = (s.eigenvalue > 0) & (s.modes > 0)
    x, modes = s.eigenvalue[seen], s.modes[seen]
    # the sum over three coordinates; for the differential coordinates it is multiplied by lambda^2
    floor = np.full_like(x, 3 * s.noise_floor**2)
    curves = (
        (s.coordinate_power[seen] / modes, "C0", "coordinates, energy per mode"),
        (s.differential_power[seen] / modes, "C1", "differential coordinates, energy per mode"),
        (floor, "C0:", f"noise floor, {s.noise_floor:.3g} per coordinate"),
        (floor * x**2, "C1:", "noise floor of the differential coordinates"),
    )
    for power, style, label in curves:
        powers.plot(x, power, style, label=label)
    powers.set_xscale("log")
    if s.coordinate_power[seen].any():  # coincident points have no power, whose logarithm is not finite
        powers.set_yscale("log")
    powers.set(ylabel="squared mesh units", title=title)
    counted = powers.twinx()
    counted.loglog(x, np.cumsum(s.modes)[seen], "0.6", linewidth=1, label="modes below")
    counted.set_ylabel("modes below", color="0.4")
    powers.legend(fontsize=8, loc="lower right")
    fine = np.geomspace(x.min(), 2, 500)
    gains.semilogx(fine, response(fine), "C2", label=f"h, the low-pass of differential coordinates: {response.label}")
    whole = transfer_function(fine, response(fine), weight)
    gains.semilogx(fine, whole, "C3", label=f"H, the whole filter with barycenter weight {weight:.3g} (regular mesh)")
    gains.set(xlabel="eigenvalue of the Laplacian (squared frequency)", ylabel="fraction kept", ylim=(-0.05, 1.1))
    gains.legend(fontsize=8, loc="lower left")
    for axes in (powers, gains):
        axes.grid(visible=True, which="major", alpha=0.3)

    # lambda = (pi h / wavelength)^2; matplotlib also evaluates at 0
    length = np.pi * (mean_edge or 1.0)
    tiny = np.finfo(np.float64).tiny
    top = powers.secondary_xaxis(
        "top",
        functions=(
            lambda eigenvalue: length / np.sqrt(np.maximum(eigenvalue, tiny)),
            lambda wavelength: (length / np.maximum(wavelength, length * 1e-150)) ** 2,
        ),
    )
    top.set_xlabel("wavelength (mesh units)")
    with atomic.atomic_write(path) as part:
        figure.savefig(part, format="png")
