"""What is installed here: versions, platform, extras and processors, for reports of bugs."""

from __future__ import annotations

import importlib.metadata
import platform
import re
from dataclasses import dataclass, fields
from typing import Any

from meshlab_specsmooth.describe import Described, Rows
from meshlab_specsmooth.isolation import fork
from meshlab_specsmooth.runtime import blocks, memory
from meshlab_specsmooth.runtime.backend import is_compiled
from meshlab_specsmooth.version import VERSION

_DISTRIBUTION = "meshlab-specsmooth"

# Extras that nothing is drawn, filtered or shown by
_OF_DEVELOPERS = ("demo", "peers", "test", "docs", "release")


@dataclass(frozen=True, repr=False)
class Installation(Described):
    """Versions and properties of this installation.

    Attributes
    ----------
    version : str
        Of this package.
    python : str
        Version and implementation of Python.
    platform : str
        System and processor architecture.
    processors : int
        Number that this process may use.
    memory : float
        Free memory in GiB.
    kernels : str
        What sweeps over meshes: ``"numba"`` or ``"scipy"``.
    isolation : bool
        Whether commands read and write files in a process of their own.
    required : dict of str to str or None
        Version of each required package, None where it is missing.
    extras : dict of str to dict
        The same for each extra.
    """

    version: str
    python: str
    platform: str
    processors: int
    memory: float
    kernels: str
    isolation: bool
    required: dict[str, str | None]
    extras: dict[str, dict[str, str | None]]

    @property
    def summary(self) -> str:
        """Summary in one sentence."""
        return f"meshlab_specsmooth {self.version}, Python {self.python}, {self.platform}"

    def rows(self) -> Rows:
        """Return names and values to display below the summary."""
        return [
            ("processors", f"{self.processors}, {self.memory:.1f} GiB of memory free"),
            ("kernels", self.kernels),
            ("isolation", "commands run in a fork" if self.isolation else "commands run in this process"),
            ("required", _list_versions(self.required)),
            *((f"[{extra}]", _list_versions(versions)) for extra, versions in self.extras.items()),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as a dict for JSON."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


def report() -> Installation:
    """Return versions, platform, extras and processors of this installation; paste it into a report of a bug.

    Nothing is sent anywhere, and no name of a user, host or path is included.

    Returns
    -------
    Installation

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> print(mss.report())
    meshlab_specsmooth ..., Python ...
      processors  ...
      required    pymeshlab ..., numpy ..., scipy ...
      ...
    """
    required, extras = _find_requirements()
    return Installation(
        version=VERSION,
        python=f"{platform.python_version()} ({platform.python_implementation()})",
        platform=f"{platform.system()} {platform.release()} {platform.machine()}",
        processors=blocks.threads(),
        memory=memory.available() / 2**30,
        kernels="numba" if is_compiled() else "scipy",
        isolation=fork.can_fork(),
        required=required,
        extras=extras,
    )


def _find_requirements() -> tuple[dict[str, str | None], dict[str, dict[str, str | None]]]:
    """Versions of the required packages and of those of each extra, as the metadata of this package list them."""
    try:
        listed = importlib.metadata.requires(_DISTRIBUTION) or []
    except importlib.metadata.PackageNotFoundError:  # a clone that is not installed
        listed = ["pymeshlab", "numpy", "scipy"]
    required: dict[str, str | None] = {}
    extras: dict[str, dict[str, str | None]] = {}
    for line in listed:
        match = re.match(r"[A-Za-z0-9._-]+", line)
        name = match.group() if match else line
        extra = re.search(r"extra == ['\"]([^'\"]+)", line)
        if extra is None:
            required[name] = _find_version(name)
        elif extra.group(1) not in _OF_DEVELOPERS and name != _DISTRIBUTION:
            extras.setdefault(extra.group(1), {})[name] = _find_version(name)
    return required, extras


def _find_version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _list_versions(versions: dict[str, str | None]) -> str:
    return ", ".join(f"{name} {version or '(not installed)'}" for name, version in versions.items())
