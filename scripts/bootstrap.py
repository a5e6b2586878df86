"""The environment that the other scripts run in, made by Python's standard library alone.

A script calls ``enter(extra)`` first. Outside the environment (``.venv`` in the clone) this makes it, installs the
package with that extra, and starts the script again inside; inside, it returns at once if that extra is installed, and
installs it if not, as in an environment that was made by hand or for another script.
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


# an environment made for the tests serves the demo too
CONTAINED = {"demo": ("demo",), "peers": ("peers", "demo"), "release": ("release",), "test": ("test", "demo")}


def enter(extra: str) -> None:
    """Be in an environment where the package is installed with ``extra``."""
    if sys.version_info < (3, 10):
        sys.exit(f"Python 3.10 or newer is needed; this is {sys.version.split()[0]}")
    if inside() and stamp(extra).holds():
        return
    install_system_packages()
    python = make_environment(extra)
    # inside too: a Python that runs already does not see the package that was installed under it
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


def provide(program: str, package: str) -> None:
    """Install a program that some tests want, where that takes no asking; without it they are skipped and say so."""
    if shutil.which(program) or sys.platform != "linux" or shutil.which("apt-get") is None or os.geteuid() != 0:
        return
    print(f"Installing {package} ...", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["apt-get", "update"], ["apt-get", "install", "-y", "--no-install-recommends", package]):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"  without it: {(done.stderr or done.stdout).strip().splitlines()[-1:]}", flush=True)
            return


def needs(library: str) -> bool:
    """Whether a system library is wanted on this system and cannot be loaded."""
    if sys.platform != "linux":
        return False
    try:
        ctypes.CDLL(library)
    except OSError:
        return True
    return False


def inside() -> bool:
    """Whether this Python is the environment's."""
    return Path(sys.prefix).resolve() == ENVIRONMENT.resolve()


def make_environment(extra: str) -> Path:
    """The environment's Python; made and filled when it is not there or no longer fits, else left as it is."""
    python = ENVIRONMENT / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    made = Stamp("made-for", sys.version + sys.base_prefix)
    # an environment is not cleared by its own Python, whoever made it
    fits = inside() or (python.exists() and made.holds())
    if fits and stamp(extra).holds():
        return python
    print(f"Installing what is needed into {ENVIRONMENT} (once; a minute or two) ...", flush=True)
    if not fits:
        run([sys.executable, "-m", "venv", "--clear", str(ENVIRONMENT)])
    made.write()
    if inside() and importlib.util.find_spec("pip") is None:  # uv, for one, makes environments without
        run([str(python), "-m", "ensurepip"])
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    run([*pip, "--editable", f"{ROOT}[{extra}]"])
    for contained in CONTAINED[extra]:  # last, so that an interrupted installation is done again
        stamp(contained).write()
    return python


class Stamp:
    """A file in the environment that says what was done to it."""

    def __init__(self, name: str, state: str) -> None:
        self.path = ENVIRONMENT / name
        self.state = state

    def holds(self) -> bool:
        return self.path.exists() and self.path.read_text(encoding="utf-8") == self.state

    def write(self) -> None:
        self.path.write_text(self.state, encoding="utf-8")


def stamp(extra: str) -> Stamp:
    """That the package is installed with ``extra``; the same seen from outside and from inside."""
    facts = [sys.version, str(ROOT), (ROOT / "pyproject.toml").read_text(encoding="utf-8")]
    return Stamp(f"installed-{extra}", hashlib.sha256("\n".join(facts).encode()).hexdigest())


def run(command: "list[str]", environment: "dict[str, str] | None" = None) -> None:
    """Run a command quietly; if it fails, show what it said and stop."""
    done = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if done.returncode != 0:
        sys.exit(f"{done.stdout}\nFailed: {' '.join(command)}")
