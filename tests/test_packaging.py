"""What people install."""

import subprocess
import sys
import zipfile
from importlib.metadata import requires
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_the_wheel_holds_the_package_its_command_and_the_descriptors_and_nothing_else(tmp_path):
    command = ["pip", "--disable-pip-version-check", "wheel", "--no-deps", "--no-build-isolation", "--quiet"]
    subprocess.run([sys.executable, "-m", *command, "--wheel-dir", tmp_path, ROOT], check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shipped = {f"meshlab_specsmooth/{path.relative_to(ROOT)}" for path in (ROOT / "filters_xml").glob("*.xml")}
    assert len(shipped) >= 2
    assert shipped <= names
    assert "meshlab_specsmooth/py.typed" in names
    assert any(name.endswith("LICENSE") for name in names)
    assert {name.split("/")[0].split("-")[0] for name in names} == {"meshlab_specsmooth", "specsmooth.py"}
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "meshlab_specsmooth").rglob("*.py")}
    assert modules <= names


def test_only_three_libraries_are_required():
    required = [r for r in requires("meshlab-specsmooth") if "extra ==" not in r]
    assert sorted(r.split(">")[0] for r in required) == ["numpy", "pymeshlab", "scipy"]
