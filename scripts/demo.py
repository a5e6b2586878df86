#!/usr/bin/env python3
"""The demo: the Stanford bunny, noisy, smoothed by MeshLab's filters and ours, as a picture and a table.

python3 scripts/demo.py [--out DIR] [--noise X] [--seed N]
"""

import sys

import bootstrap

bootstrap.enter("demo")

from meshlab_specsmooth.cli import main  # noqa: E402 (it is importable only inside the environment)

sys.exit(main(["demo", "--out", str(bootstrap.ROOT / "demo"), *sys.argv[1:]]))
