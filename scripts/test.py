#!/usr/bin/env python3
"""The whole check: style, types, tests, doctests, the README, coverage, a new user's first hour.

python3 scripts/test.py             everything
python3 scripts/test.py PYTEST_ARGS pytest alone, with these arguments
"""

import signal
import subprocess
import sys

import bootstrap

bootstrap.enter("test")
bootstrap.provide("chromium", "chromium")  # the page is looked at in a real browser

CHECKS = {
    "lint": ["ruff", "check", "."],
    "format": ["ruff", "format", "--check", "."],
    "types": ["mypy"],
    "site": ["scripts/make_site.py", "--fresh"],
    # one process a processor; those that run dry take over from the others
    "tests": ["pytest", "-n", "auto", "--dist", "worksteal", "--cov", "--cov-report=term-missing"],
    "first hour": ["scripts/first_hour.py"],
}


def main() -> int:
    # in the background (nohup, &) they are ignored, and the tests' processes would inherit that
    for name, handler in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
        if hasattr(signal, name):  # Windows has no SIGHUP
            signal.signal(getattr(signal, name), handler)
    checks = {"tests": ["pytest", *sys.argv[1:]]} if sys.argv[1:] else CHECKS
    failed = []
    for name, command in checks.items():
        print(f"== {name}: {' '.join(command)}", flush=True)
        program = command if command[0].endswith(".py") else ["-m", *command]
        if subprocess.call([sys.executable, *program], cwd=bootstrap.ROOT):
            failed.append(name)
    print(f"== {'FAILED: ' + ', '.join(failed) if failed else 'all checks passed'}")
    return 1 if failed else 0


sys.exit(main())
