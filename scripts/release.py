#!/usr/bin/env python3
"""Build the wheel and the source distribution, check them, and try them in empty environments.

python3 scripts/release.py                     everything; some minutes
python3 scripts/release.py --only build        build and check alone
python3 scripts/release.py --only lowest       the lowest versions that pyproject.toml names, with all extras for users
python3 scripts/release.py --only newest       the newest versions, likewise
python3 scripts/release.py --only pyvista      PyVista and the wheel alone: the namespace is there without an import

The files are left in dist/. Nothing is uploaded.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import bootstrap

bootstrap.enter("release")

from packaging.requirements import Requirement  # noqa: E402

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

DIST = bootstrap.ROOT / "dist"

#: Extras for users, which the lowest and the newest versions are tried with.
EXTRAS = ("completion", "fast", "progress", "pyvista", "report")

# What is tried: the filter on arrays and on a MeshSet, the command line, a picture
FILTERS = """
import numpy as np
import meshlab_specsmooth as mss
ms = mss.MeshSet()
ms.create_sphere(subdiv=4)
V, F = ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix()
rough = V + 0.01 * np.random.default_rng(0).standard_normal(V.shape)
for function in (mss.smooth, mss.denoise):
    error = np.abs(np.linalg.norm(function(rough, F).vertices, axis=1) - 1).mean()
    assert error < 0.004, (function, error)
assert mss.deviation((rough, F), V, tolerance="5%").is_within
print(mss.report())
"""
PICTURE = """
mss.draw_field("field.png", (V, F), V[:, 0])
mss.draw_deviation("deviation.png", mss.deviation((rough, F), V))
"""
COMMANDS = (
    ["demo", "--scan", "scan.ply"],
    ["denoise", "scan.ply", "smooth.ply"],
    ["deviation", "scan.ply", "smooth.ply", "--tolerance", "5%"],
)
ACCESSOR = """
import sys
import numpy as np
import pyvista as pv
mesh = pv.Icosphere(nsub=4)
mesh.points += 0.004 * np.random.default_rng(0).standard_normal(mesh.points.shape)
assert "meshlab_specsmooth" not in sys.modules
smooth = mesh.specsmooth.denoise()
assert smooth.specsmooth.result.noise.kind == "white"
print(mesh.specsmooth.estimate_noise())
print(smooth.specsmooth.summary)
print(smooth)
"""


def read_project() -> dict:
    """The table [project] of pyproject.toml."""
    return tomllib.loads((bootstrap.ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def list_lowest(project: dict, extras: "tuple[str, ...]" = EXTRAS) -> "list[str]":
    """The lowest version of each requirement of the package and of some extras, as constraints for pip."""
    named = [*project["dependencies"], *(line for extra in extras for line in project["optional-dependencies"][extra])]
    found: dict[str, str] = {}
    for line in named:
        requirement = Requirement(line)
        (lowest,) = (each.version for each in requirement.specifier if each.operator == ">=")
        # of two extras with the same package, the higher bound holds where both are installed
        earlier = found.get(requirement.name)
        if earlier is None or tuple(map(int, earlier.split("."))) < tuple(map(int, lowest.split("."))):
            found[requirement.name] = lowest
    # as of a release with a build number or a patch level, whatever pip finds of the version
    return [f"{name}=={version}.*" if name != "pymeshlab" else f"{name}=={version}" for name, version in found.items()]


def build() -> Path:
    """Build and check both files; returns the wheel."""
    shutil.rmtree(DIST, ignore_errors=True)
    run([sys.executable, "-m", "build", "--outdir", str(DIST), str(bootstrap.ROOT)])
    files = sorted(DIST.iterdir())
    run([sys.executable, "-m", "twine", "check", "--strict", *map(str, files)])
    (wheel,) = (file for file in files if file.suffix == ".whl")
    if not wheel.name.endswith("-py3-none-any.whl"):
        sys.exit(f"{wheel.name} is not a pure wheel")
    return wheel


def try_out(name: str, wheel: Path, extras: "tuple[str, ...]", constraints: "list[str]", code: str) -> None:
    """Install the wheel with extras into an empty environment, and run code and commands there."""
    print(f"== {name}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        venv.create(place / "env", with_pip=True)
        programs = place / "env" / ("Scripts" if sys.platform == "win32" else "bin")
        (place / "constraints.txt").write_text("\n".join(constraints) + "\n", encoding="utf-8")
        wanted = f"{wheel}[{','.join(extras)}]"
        install = [str(programs / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        run([*install, "--constraint", str(place / "constraints.txt"), wanted])
        run([str(programs / "python"), "-c", code], place)
        for command in COMMANDS:
            run([str(programs / "specsmooth"), *command], place)


def run(command: "list[str]", folder: "Path | None" = None) -> None:
    """Run a command, and stop where it fails."""
    if subprocess.call(command, cwd=folder) != 0:
        sys.exit(f"failed: {' '.join(command)[:200]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=["build", "lowest", "newest", "pyvista"], help="a part of it")
    only = parser.parse_args().only
    wheel = build()
    if only in (None, "lowest"):
        try_out("lowest versions", wheel, EXTRAS, list_lowest(read_project()), FILTERS + PICTURE)
    if only in (None, "newest"):
        try_out("newest versions", wheel, EXTRAS, [], FILTERS + PICTURE)
    if only in (None, "pyvista"):
        try_out("PyVista and the wheel alone", wheel, ("pyvista",), [], ACCESSOR)
    print("== done: " + ", ".join(str(file.relative_to(bootstrap.ROOT)) for file in sorted(DIST.iterdir())))


if __name__ == "__main__":
    main()
