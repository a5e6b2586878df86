"""A window with sliders for the parameters of the filter and a view of its result, drawn by Polyscope."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.errors import MissingExtra, NoDisplay
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.smoothing.filter import smooth_by_setting
from meshlab_specsmooth.smoothing.result import SmoothingResult
from meshlab_specsmooth.smoothing.settings import Region, Smoothing
from meshlab_specsmooth.spectral.low_pass import LOW_PASSES
from meshlab_specsmooth.spectral.response import RESPONSES

# Ranges of the sliders: wavelengths in mean edges and weights, both logarithmic, and gains
WAVELENGTHS, WEIGHTS, GAINS = (2.5, 200.0), (0.02, 10.0), (0.0, 3.0)

_COLOR = (0.85, 0.79, 0.66)
_NAME = "surface"


@dataclass(frozen=True)
class Sliders:
    """The positions of the sliders.

    Attributes
    ----------
    wavelength : float
        Shortest wavelength kept, in mean edges.
    weight : float
    response : str
    gain : float
        Gain of the features, if there are any.
    """

    wavelength: float
    weight: float
    response: str
    gain: float = 0.0


#: The action of a button: from the sliders and the result to a message.
Action = Callable[[Sliders, SmoothingResult], str]


def smooth_at(
    ops: Operators,
    setting: Sliders,
    features: Floats | None = None,
    start: SmoothingResult | None = None,
    workspace: Workspace | None = None,
) -> SmoothingResult:
    """Return the result at a setting; ``start``, the result of a similar setting, makes it faster."""
    edge = float(np.ldexp(ops.mean_edge, ops.exponent))
    low_pass = LOW_PASSES[setting.response](wavelength=setting.wavelength * edge)
    given = Smoothing(low_pass=low_pass, barycenter_weight=setting.weight)
    region = Region(features=features, feature_gain=setting.gain)
    return smooth_by_setting(ops, given, region, start=start, workspace=workspace)


def tune(
    ops: Operators,
    setting: Sliders,
    actions: Mapping[str, Action],
    *,
    features: Floats | None = None,
    screenshot: str | os.PathLike[str] | None = None,
) -> None:
    """Open the window until the user closes it, or write a PNG of it without a display.

    Raises
    ------
    MissingExtra
        Polyscope is not installed.
    NoDisplay
        There is no display.
    FileError
        The picture cannot be written.
    """
    try:
        import polyscope
    except ImportError as error:
        raise MissingExtra("a window", "view") from error
    if screenshot is None and sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys():
        raise NoDisplay("there is no display to open a window on; --screenshot FILE writes a picture of it instead")
    polyscope.set_verbosity(0)
    polyscope.set_use_prefs_file(False)
    polyscope.set_allow_headless_backends(screenshot is not None)
    polyscope.set_program_name("specsmooth tune")
    polyscope.set_ground_plane_mode("none")
    polyscope.init()
    try:
        frame = _frame(polyscope, ops, setting, actions, features)
        polyscope.set_user_callback(frame)
        if screenshot is None:
            polyscope.show()
        else:
            with atomic.atomic_write(screenshot) as part:
                polyscope.screenshot(str(part), transparent_bg=False, include_UI=True)
    finally:
        polyscope.clear_user_callback()
        polyscope.remove_all_structures()


def _frame(
    polyscope: Any, ops: Operators, setting: Sliders, actions: Mapping[str, Action], features: Floats | None
) -> Callable[[], None]:
    """Return the callback for each frame, which draws the sliders and updates the surface."""
    workspace = Workspace()
    result = smooth_at(ops, setting, features, workspace=workspace)
    mesh = polyscope.register_surface_mesh(_NAME, result.vertices, ops.surface.faces, color=_COLOR)
    mesh.set_smooth_shade(False)
    is_given_shown = False
    message = ""

    def frame() -> None:
        nonlocal setting, result, is_given_shown, message
        wanted = draw_sliders(polyscope.imgui, setting, with_gain=features is not None)
        has_moved = wanted != setting
        if has_moved:
            setting, result = wanted, smooth_at(ops, wanted, features, result, workspace)
        has_switched, is_given_shown = polyscope.imgui.Checkbox("as given", is_given_shown)
        if has_moved or has_switched:
            mesh.update_vertex_positions(ops.surface.vertices if is_given_shown else result.vertices)
        polyscope.imgui.TextUnformatted(describe_result(result))
        for label, action in actions.items():
            if polyscope.imgui.Button(label):
                message = action(setting, result)
        polyscope.imgui.TextUnformatted(message)

    return frame


def draw_sliders(imgui: Any, setting: Sliders, *, with_gain: bool) -> Sliders:
    """Draw the sliders and return their positions; ``setting`` itself if none was moved."""
    names = list(RESPONSES)
    flags, label = imgui.ImGuiSliderFlags_Logarithmic, "wavelengths kept (edges)"
    is_wavelength, wavelength = imgui.SliderFloat(label, setting.wavelength, *WAVELENGTHS, "%.1f", flags)
    is_weight, weight = imgui.SliderFloat("barycenter weight", setting.weight, *WEIGHTS, "%.3f", flags)
    is_response, at = imgui.Combo("response", names.index(setting.response), names)
    is_gain, gain = imgui.SliderFloat("feature gain", setting.gain, *GAINS) if with_gain else (False, setting.gain)
    if not (is_wavelength or is_weight or is_response or is_gain):
        return setting
    low, high = WAVELENGTHS
    return replace(
        setting,
        wavelength=float(np.clip(wavelength, low, high)),  # numbers can also be typed in
        weight=float(np.clip(weight, *WEIGHTS)),
        response=names[at],
        gain=max(0.0, float(gain)),
    )


def describe_result(result: SmoothingResult) -> str:
    """Return cut-off, displacement and cost of a result in three lines."""
    edges = result.displacement / result.mean_edge if result.mean_edge else 0.0
    return (
        f"{result.modes:.0f} modes kept, wavelengths above {result.wavelength:.4g}\n"
        f"vertices moved by {edges:.3f} mean edges (RMS)\n"
        f"degree {result.degree}, {sum(result.cg_iterations)} iterations, {1e3 * result.seconds:.0f} ms"
    )
