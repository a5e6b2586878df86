"""A window with sliders, live on the prepared filter; Polyscope draws it."""

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

# Ranges of the sliders: waves in mean edges, and weights, both logarithmic; gains
WAVES, WEIGHTS, GAINS = (2.5, 200.0), (0.02, 10.0), (0.0, 3.0)

_COLOUR = (0.85, 0.79, 0.66)
_NAME = "surface"


@dataclass(frozen=True)
class Setting:
    """Where the sliders stand.

    Attributes
    ----------
    wave : float
        The shortest wave kept, in mean edges.
    weight : float
    response : str
    gain : float
        Of features, if there are any.
    """

    wave: float
    weight: float
    response: str
    gain: float = 0.0


#: A button: from where the sliders stand, and the result there, to what is to be said of what was done.
Action = Callable[[Setting, SmoothingResult], str]


def smoothed(
    ops: Operators,
    setting: Setting,
    features: Floats | None = None,
    start: SmoothingResult | None = None,
    workspace: Workspace | None = None,
) -> SmoothingResult:
    """The surface at a setting; from the result before, as neighboring settings have neighboring results."""
    edge = float(np.ldexp(ops.mean_edge, ops.exponent))
    low_pass = LOW_PASSES[setting.response](wavelength=setting.wave * edge)
    given = Smoothing(low_pass=low_pass, barycenter_weight=setting.weight)
    region = Region(features=features, feature_gain=setting.gain)
    return smooth_by_setting(ops, given, region, start=start, workspace=workspace)


def tune(
    ops: Operators,
    setting: Setting,
    actions: Mapping[str, Action],
    *,
    features: Floats | None = None,
    screenshot: str | os.PathLike[str] | None = None,
) -> None:
    """Open the window, until it is closed; or write what it would show into a PNG, without a display.

    Raises
    ------
    MissingExtra
        Polyscope is not installed.
    NoDisplay
        There is nothing to open a window on.
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
    polyscope: Any, ops: Operators, setting: Setting, actions: Mapping[str, Action], features: Floats | None
) -> Callable[[], None]:
    """What is done for each picture: the sliders are drawn, and the surface where they stand."""
    workspace = Workspace()
    result = smoothed(ops, setting, features, workspace=workspace)
    mesh = polyscope.register_surface_mesh(_NAME, result.vertices, ops.surface.faces, color=_COLOUR)
    mesh.set_smooth_shade(False)
    noisy = False
    said = ""

    def frame() -> None:
        nonlocal setting, result, noisy, said
        wanted = sliders(polyscope.imgui, setting, with_gain=features is not None)
        has_moved = wanted != setting
        if has_moved:
            setting, result = wanted, smoothed(ops, wanted, features, result, workspace)
        has_switched, noisy = polyscope.imgui.Checkbox("as given", noisy)
        if has_moved or has_switched:
            mesh.update_vertex_positions(ops.surface.vertices if noisy else result.vertices)
        polyscope.imgui.TextUnformatted(told(result))
        for label, action in actions.items():
            if polyscope.imgui.Button(label):
                said = action(setting, result)
        polyscope.imgui.TextUnformatted(said)

    return frame


def sliders(imgui: Any, setting: Setting, *, with_gain: bool) -> Setting:
    """Draw the sliders, and return where they stand; the setting itself where none was moved."""
    names = list(RESPONSES)
    flags = imgui.ImGuiSliderFlags_Logarithmic
    is_wave, wave = imgui.SliderFloat("waves kept, in edges", setting.wave, *WAVES, "%.1f", flags)
    is_weight, weight = imgui.SliderFloat("barycenter weight", setting.weight, *WEIGHTS, "%.3f", flags)
    is_response, at = imgui.Combo("response", names.index(setting.response), names)
    is_gain, gain = imgui.SliderFloat("feature gain", setting.gain, *GAINS) if with_gain else (False, setting.gain)
    if not (is_wave or is_weight or is_response or is_gain):
        return setting
    low, high = WAVES
    return replace(
        setting,
        wave=float(np.clip(wave, low, high)),  # numbers can be typed in, too
        weight=float(np.clip(weight, *WEIGHTS)),
        response=names[at],
        gain=max(0.0, float(gain)),
    )


def told(result: SmoothingResult) -> str:
    """The evidence in three lines."""
    edges = result.displacement / result.mean_edge if result.mean_edge else 0.0
    return (
        f"{result.modes:.0f} modes kept, waves longer than {result.wavelength:.4g}\n"
        f"vertices moved by {edges:.3f} mean edges (RMS)\n"
        f"{result.degree} sweeps, {sum(result.cg_iterations)} iterations, {1e3 * result.seconds:.0f} ms"
    )
