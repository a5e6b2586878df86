#!/usr/bin/env python3
"""The picture of a comparison in the README: ``docs/comparison.png``.

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
from meshlab_specsmooth.bridge import files  # noqa: E402

SIZE = {"width": 1360, "height": 1340}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        bunny = files.read(files.sample("bunny.obj"))
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
