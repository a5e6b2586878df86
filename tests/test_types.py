"""What type checkers, editors and notebooks see of the filters and of the names that parameters take."""

import inspect
import subprocess
import sys
import typing
from pathlib import Path

import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth import choices
from meshlab_specsmooth.meshlab import descriptors, signatures
from meshlab_specsmooth.meshlab.filters import FILTERS

ROOT = Path(__file__).parent.parent

# lines that end in "wrong" are to be found, and no others
CALLS = """
import meshlab_specsmooth as mss
V, F = [[0.0, 0.0, 0.0]], [[0, 0, 0]]
ms = mss.MeshSet()
mss.smooth(V, F, response="heat", spacing=(1.0, 1.0, 3.0), boundary="curve")
mss.smooth(ms).mesh
mss.smooth(V, F, response="foo")  # wrong
mss.smooth(V, F, modez=3)  # wrong
mss.denoise(V, F, spacing="wide")  # wrong
mss.smooth(mss.assemble(V, F), method="fast")  # wrong
mss.apply_coord_spectral_smoothing(ms, modes=200, response="ideal")["modes"]
mss.apply_coord_spectral_smoothing(ms, response="foo")  # wrong
mss.apply_coord_spectral_smoothing(ms, modez=200)  # wrong
mss.apply_coord_spectral_smoothing(ms, 200)  # wrong
mss.apply_coord_spectral_smoothing(ms, wavelength="3")  # wrong
ms.apply_coord_spectral_denoising(spacing=2.0, progress=print)["warning"]
ms.compute_scalar_by_estimated_error(after="speed")  # wrong
ms.get_spectrum(bands="many")  # wrong
"""


@pytest.mark.no_cover
def test_mypy_finds_invalid_arguments(tmp_path):
    """Of the functions on arrays, the filters, and the methods of our MeshSet."""
    pytest.importorskip("mypy")
    (tmp_path / "calls.py").write_text(CALLS)
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", ROOT / "pyproject.toml"]
    command += ["--cache-dir", ROOT / ".mypy_cache", "--no-error-summary", tmp_path / "calls.py"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    found = {int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line}
    wrong = {number for number, line in enumerate(CALLS.splitlines(), start=1) if line.endswith("# wrong")}
    assert found == wrong, done.stdout + done.stderr


def test_literals_are_the_values_of_the_descriptors():
    functions = {
        "apply_coord_spectral_smoothing": mss.smooth,
        "apply_coord_spectral_low_pass": mss.low_pass,
        "apply_coord_spectral_enhancement": mss.enhance,
        "apply_coord_edge_aware_smoothing": mss.smooth_edge_aware,
        "apply_coord_spectral_denoising": mss.denoise,
        "get_spectrum": mss.spectrum,
    }
    seen = 0
    for name, function in functions.items():
        fields = inspect.signature(function).parameters
        for parameter in descriptors.load(name).parameters:
            if parameter.type != "enum" or parameter.name in ("features", "creases"):  # arrays in these functions
                continue
            words = str(fields[parameter.name].annotation).split(" | ")
            for literal in (set(typing.get_args(getattr(choices, word))) for word in words if hasattr(choices, word)):
                assert literal - set(parameter.values) <= {"auto"}  # of enhancement, whose boundary is fixed by default
                assert set(parameter.values) <= literal
                seen += 1
    assert seen > 12


@pytest.mark.parametrize("name", FILTERS)
def test_signatures_have_the_parameters_of_the_descriptor(name):
    wanted = [parameter.name for parameter in descriptors.load(name).parameters]
    assert list(inspect.signature(getattr(mss, name)).parameters) == ["ms", *wanted, "progress"]
    assert list(inspect.signature(getattr(mss.MeshSet, name)).parameters) == ["self", *wanted, "progress"]
    assert getattr(signatures, name) is FILTERS[name] is getattr(mss, name)
    assert name in dir(mss.MeshSet())


def test_tab_completion_shows_the_filters_after_register():
    ms = pymeshlab.MeshSet()
    mss.unregister()
    assert not set(FILTERS) & set(dir(ms))
    mss.register()
    try:
        assert set(FILTERS) <= set(dir(ms))
        assert "modes" in inspect.signature(ms.apply_coord_spectral_smoothing).parameters
    finally:
        mss.unregister()
    assert not set(FILTERS) & set(dir(ms))
