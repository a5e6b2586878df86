"""The environment that the other scripts run in, made by Python's standard library alone.

A script calls ``enter(extra)`` first. Outside the environment (``.venv`` in the clone) this makes it, installs the
package with that extra, and starts the script again inside; inside, it returns at once.
"""

import ctypes
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = ROOT / ".venv"

# what pymeshlab and the renderer load, and the Debian package that has it
SYSTEM_LIBRARIES = {"libGL.so.1": "libgl1", "libOpenGL.so.0": "libopengl0", "libEGL.so.1": "libegl1"}


def enter(extra: str) -> None:
    """Be in an environment where the package is installed with ``extra``."""
    if Path(sys.prefix).resolve() == ENVIRONMENT.resolve():
        return
    if sys.version_info < (3, 10):
        sys.exit(f"Python 3.10 or newer is needed; this is {sys.version.split()[0]}")
    install_system_packages()
    python = make_environment(extra)
    command = [str(python), *sys.argv]
    if os.name == "nt":
        sys.exit(subprocess.call(command))
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606


def install_system_packages() -> None:
    """Install the missing system packages where that is possible, else stop with the command that does it."""
    missing = [package for library, package in SYSTEM_LIBRARIES.items() if needs(library)]
    if importlib.util.find_spec("ensurepip") is None:
        missing.append("python3-venv")
    if not missing:
        return
    install = ["apt-get", "install", "-y", *missing]
    if shutil.which("apt-get") is None or os.geteuid() != 0:
        sys.exit(
            f"Missing: {', '.join(missing)}. Type this, then start again:\n"
            f"  sudo apt-get update && sudo {' '.join(install)}"
        )
    print(f"Installing {', '.join(missing)} ...", flush=True)
    for command in (["apt-get", "update"], install):
        run(command, {**os.environ, "DEBIAN_FRONTEND": "noninteractive"})


def needs(library: str) -> bool:
    """Whether a system library is wanted on this system and cannot be loaded."""
    if sys.platform != "linux":
        return False
    try:
        ctypes.CDLL(library)
    except OSError:
        return True
    return False


def make_environment(extra: str) -> Path:
    """The environment's Python; made and filled when it is not there or no longer fits, else left as it is."""
    python = ENVIRONMENT / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    facts = [sys.version, sys.base_prefix, str(ROOT), (ROOT / "pyproject.toml").read_text(encoding="utf-8")]
    state = hashlib.sha256("\n".join(facts).encode()).hexdigest()
    # written last, so that an interrupted installation is done again
    stamp = ENVIRONMENT / f"installed-{extra}"
    if python.exists() and stamp.exists() and stamp.read_text(encoding="utf-8") == state:
        return python
    print(f"Making the environment in {ENVIRONMENT} (once; a minute or two) ...", flush=True)
    made = ENVIRONMENT / "made-for"
    if not (python.exists() and made.exists() and made.read_text(encoding="utf-8") == facts[0] + facts[1]):
        run([sys.executable, "-m", "venv", "--clear", str(ENVIRONMENT)])
        made.write_text(facts[0] + facts[1], encoding="utf-8")
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    run([*pip, "--editable", f"{ROOT}[{extra}]"])
    stamp.write_text(state, encoding="utf-8")
    return python


def run(command: "list[str]", environment: "dict[str, str] | None" = None) -> None:
    """Run a command quietly; if it fails, show what it said and stop."""
    done = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if done.returncode != 0:
        sys.exit(f"{done.stdout}\nFailed: {' '.join(command)}")
