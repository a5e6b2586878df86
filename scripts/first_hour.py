#!/usr/bin/env python3
"""A new user's first hour, in an empty folder: the wheel, all kinds of meshes, the noise, a notebook, the page.

python3 scripts/first_hour.py              prints a transcript; exit code 1 if a check fails
python3 scripts/first_hour.py --out DIR    keeps the page, its screenshots at three widths and the notebook in DIR
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import bootstrap

bootstrap.enter("test")
bootstrap.provide("chromium", "chromium")

import nbclient  # noqa: E402
import nbformat  # noqa: E402
from playwright.sync_api import sync_playwright  # noqa: E402

WIDTHS = (1400, 800, 400)

KINDS = """
import importlib.util, numpy as np, pymeshlab, meshlab_specsmooth as mss
ms = pymeshlab.MeshSet()
ms.load_new_mesh("scan.ply")
V, F = ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix()
kinds = {"arrays": (V, F), "tuple": ((V, F),), "MeshSet": (ms,), "Mesh": (ms.current_mesh(),), "path": ("scan.ply",)}
if importlib.util.find_spec("trimesh"):
    import trimesh
    kinds["trimesh"] = (trimesh.Trimesh(V, F, process=False),)
if importlib.util.find_spec("meshio"):
    import meshio
    kinds["meshio"] = (meshio.Mesh(V, [("triangle", F)]),)
if importlib.util.find_spec("pyvista"):
    import pyvista
    kinds["PyVista"] = (pyvista.PolyData.from_regular_faces(V, F),)
expected = mss.smooth(V, F).vertices
for name, mesh in kinds.items():
    result = mss.smooth(*mesh)
    assert np.array_equal(result.vertices, expected), name
    print(f"{name:8} in, {type(result.mesh).__module__}.{type(result.mesh).__name__} out")
"""

NOISE = """
import pymeshlab, meshlab_specsmooth as mss
ms = pymeshlab.MeshSet()
ms.load_new_mesh("scan.ply")
sources = {
    "estimate_noise": mss.estimate_noise("scan.ply"), "smooth": mss.smooth("scan.ply").noise,
    "denoise": mss.denoise("scan.ply").noise, "spectrum": mss.spectrum("scan.ply").noise,
    "MeshSet": mss.apply_coord_spectral_smoothing(ms)["noise"],
}
for name, noise in sources.items():
    print(f"{name:15} {noise.level / noise.mean_edge:.4f} mean edges, {noise.kind}")
assert len({round(noise.level / noise.mean_edge, 6) for noise in sources.values()}) == 1
"""

IMPORTS = """
import subprocess, sys, time
def seconds(code):
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)
    return time.perf_counter() - start
bare = min(seconds("pass") for _ in range(3))
for code in ("import meshlab_specsmooth", "import numpy, scipy.sparse"):
    print(f"{code:28} {min(seconds(code) for _ in range(3)) - bare:.3f} s")
"""

NOTEBOOK = (
    "import meshlab_specsmooth as mss",
    'result = mss.denoise("scan.ply")\nresult',
    "print(result)",
    "result.noise",
    'mss.compare("scan.ply", filters=["laplacian", "taubin", "automatic"])',
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", metavar="DIR", help="keep all files in this folder")
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder) / "an empty folder"
        work.mkdir()
        python = install(Path(folder))
        print_section("import", run(python, work, IMPORTS))
        commands(python, work)
        print_section("all kinds of meshes", run(python, work, KINDS))
        print_section("the same noise from every function", run(python, work, NOISE))
        print_section("a notebook", notebook(work))
        print_section("the page", page(python, work))
        if out is not None:
            shutil.copytree(work, out, dirs_exist_ok=True)
    print("== all checks passed")
    return 0


def install(folder: Path) -> Path:
    """Install the wheel into a new environment, which also finds the other packages of this one; returns its Python."""
    source = folder / "source"
    shutil.copytree(
        bootstrap.ROOT, source, ignore=shutil.ignore_patterns(".*", "build", "*.egg-info", "demo", "__pycache__")
    )
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    here = {"cwd": folder, "check": True}
    subprocess.run([*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", folder, source], **here)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], **here)
    python = folder / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    (packages,) = {Path(path) for path in site_packages(python)}
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", "--no-deps", "--target", packages, wheel], **here)
    # after the wheel, so that the package of the clone is not found first
    (packages / "others.pth").write_text("\n".join(site_packages(Path(sys.executable))) + "\n", encoding="utf-8")
    output = run(python, folder, "import meshlab_specsmooth as mss; print(mss.__file__)")
    expect(str(packages) in output, output)
    print_section("the wheel", f"{wheel.name}, {wheel.stat().st_size // 1024} KiB")
    return python


def site_packages(python: Path) -> list[str]:
    code = "import sys; print('\\n'.join(p for p in sys.path if p.endswith('site-packages')))"
    return subprocess.check_output([python, "-c", code], text=True).split("\n")[:-1]


def run(python: Path, work: Path, code: str) -> str:
    """Run code and return its output; exit with its output if it fails."""
    done = subprocess.run([python, "-c", code], cwd=work, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{code}\n{done.stdout}{done.stderr}")
    return done.stdout


def commands(python: Path, work: Path) -> None:
    for arguments in (
        ["demo", "--scan", "bunny.ply"],
        ["denoise", "bunny.ply", "smooth.ply"],
        ["denoise", "bunny.ply"],
        ["smooth", "bunny.ply", "smooth.ply", "--baricenter-weight", "0.3"],
        ["smooth", "no such file.ply", "smooth.ply"],
    ):
        command = [python, "-m", "meshlab_specsmooth", *arguments]
        done = subprocess.run(command, cwd=work, capture_output=True, text=True, check=False)
        output = done.stdout + done.stderr
        expect("Traceback" not in output, output)
        print_section("$ specsmooth " + " ".join(arguments), f"{output.strip()}\n[exit code {done.returncode}]")
    small = "import pymeshlab; ms = pymeshlab.MeshSet(); ms.create_sphere(subdiv=4);"
    small += "ms.apply_coord_random_displacement(displacement=pymeshlab.PercentageValue(0.4));"
    small += "ms.save_current_mesh('scan.ply')"
    run(python, work, small)


def notebook(work: Path) -> str:
    cells = [nbformat.v4.new_code_cell(cell) for cell in NOTEBOOK]
    document = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(document, timeout=300, resources={"metadata": {"path": str(work)}}).execute()
    nbformat.write(document, work / "first hour.ipynb")
    shown = document.cells[1].outputs[-1]["data"]
    expect("<img" in shown["text/html"], shown["text/html"])
    printed = "".join(output.get("text", "") for output in document.cells[2].outputs)
    expect(len(printed) < 1500, printed)
    return f"{shown['text/plain']}\n{printed}"


def page(python: Path, work: Path) -> str:
    arguments = [
        "compare",
        "scan.ply",
        "--out",
        "comparison",
        "--filters",
        "denoise",
        "laplacian",
        "taubin",
        "automatic",
    ]
    done = subprocess.run(
        [python, "-m", "meshlab_specsmooth", *arguments], cwd=work, capture_output=True, text=True, check=False
    )
    expect(done.returncode == 0, done.stderr)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
        )
        problems: list[str] = []
        for width in WIDTHS:
            view = browser.new_page(viewport={"width": width, "height": 1000})
            view.on("pageerror", lambda error: problems.append(str(error)))
            view.goto((work / "comparison" / "comparison.html").as_uri())
            view.wait_for_function("window.specsmooth && specsmooth.state.frames > 0")
            wider = view.evaluate("document.documentElement.scrollWidth - window.innerWidth")
            expect(wider <= 0, f"at {width} pixels the page is {wider} pixels wider than the window")
            view.screenshot(path=str(work / f"page {width}.png"))
        browser.close()
    expect(not problems, str(problems))
    return done.stdout.strip().splitlines()[0]


def expect(holds: bool, output: str) -> None:
    """Exit with a message if a check fails."""
    if not holds:
        sys.exit(f"check failed: {output}")


def print_section(title: str, output: str) -> None:
    print(f"== {title}\n{textwrap.indent(output.rstrip(), '   ')}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
