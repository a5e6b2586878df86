#!/usr/bin/env python3
"""The pictures of the README: ``docs/bunny.png`` and ``docs/comparison.png``.

python3 scripts/screenshot.py
"""

import shutil
import tempfile
from pathlib import Path

import bootstrap

bootstrap.enter("test")
bootstrap.provide("chromium", "chromium")

from playwright.sync_api import sync_playwright  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.comparison.metrics import normal_error  # noqa: E402
from meshlab_specsmooth.comparison.noise import gaussian  # noqa: E402
from meshlab_specsmooth.meshlab import mesh_files, meshset  # noqa: E402
from meshlab_specsmooth.reports.pictures import Panel, front, picture  # noqa: E402

SIZE = {"width": 1360, "height": 1340}


def draw_bunny() -> None:
    """Before, after MeshLab's Taubin filter, and after denoising."""
    truth = mss.Surface(*meshset.get_arrays(mesh_files.read(mesh_files.sample("bunny.obj"))))
    noisy = mss.Surface(gaussian(truth, 0.2, 1), truth.faces)
    taubin = meshset.new(noisy.vertices, noisy.faces)
    taubin.apply_coord_taubin_smoothing()
    smoothed = mss.Surface(*meshset.get_arrays(taubin))
    denoised = mss.Surface(mss.denoise(noisy.vertices, noisy.faces).vertices, noisy.faces)
    named = (("noisy", noisy), ("MeshLab's Taubin", smoothed), ("mss.denoise(mesh)", denoised))
    panels = [
        Panel(f"{name}\nnormals off by {normal_error(surface, truth):.1f} deg", surface) for name, surface in named
    ]
    picture(bootstrap.ROOT / "docs" / "bunny.png", panels, [front(truth)])


def main() -> None:
    draw_bunny()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        bunny = mesh_files.read(mesh_files.sample("bunny.obj"))
        found = mss.compare(bunny, noise=0.2, out=folder, name="bunny.obj")
        print(found)
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
        )
        page = browser.new_page(viewport=SIZE)
        page.goto((Path(folder) / "comparison.html").as_uri())
        page.wait_for_function("window.specsmooth && specsmooth.state.frames > 0")
        page.screenshot(path=str(bootstrap.ROOT / "docs" / "comparison.png"))
        browser.close()


if __name__ == "__main__":
    main()
