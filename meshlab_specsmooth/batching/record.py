"""The outcome of one mesh, and the record of it beside its output, by which a later run skips what is done."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from meshlab_specsmooth.errors import FileError

#: What can become of a mesh: smoothed; smoothed by an earlier run; refused or failed; its process crashed; not begun.
STATUSES = DONE, SKIPPED, FAILED, CRASHED, NOT_RUN = "done", "skipped", "failed", "crashed", "not run"

#: Appended to the name of an output, it is the name of its record.
RECORD_ENDING = ".specsmooth.json"


@dataclass(frozen=True)
class Outcome:
    """What became of one mesh: a line of the summary.

    Attributes
    ----------
    input, output : str
        Paths; there is an output if the status is ``"done"`` or ``"skipped"``.
    status : str
        One of :data:`STATUSES`.
    reason : str
        Why there is no output, on one line.
    vertices : int or None
    noise : float or None
        Estimated level of the noise along the normals, in mesh units.
    cutoff : float or None
        Eigenvalue of the Laplacian.
    volume_change : float or None
        Relative; None for a surface that is not closed.
    seconds : float
        Wall time, including reading and writing; for a skipped mesh, of the run that smoothed it.
    warning : str
        Warnings of the filter and of the writer, on one line.
    """

    input: str
    output: str
    status: str
    reason: str = ""
    vertices: int | None = None
    noise: float | None = None
    cutoff: float | None = None
    volume_change: float | None = None
    seconds: float = 0.0
    warning: str = ""

    @property
    def is_there(self) -> bool:
        """Whether there is an output with the settings that were asked for."""
        return self.status in (DONE, SKIPPED)


@dataclass(frozen=True)
class Record:
    """Input, settings and outcome of an output; a JSON file beside it."""

    input_sha256: str
    filter_name: str
    settings: dict[str, Any]
    version: str
    output_sha256: str = ""
    outcome: dict[str, Any] | None = None

    def asks_the_same(self, other: Record) -> bool:
        """Whether both have the same input, filter, settings and version."""
        return asdict(replace(self, output_sha256="", outcome=None)) == asdict(other)

    def is_of(self, output: str) -> bool:
        """Whether the output is, bit for bit, the one that was recorded."""
        return Path(output).is_file() and compute_digest(output) == self.output_sha256


def read_record(output: str) -> Record | None:
    """Read the record of an output; None where there is none, or it is not valid."""
    try:
        record = Record(**json.loads(Path(output + RECORD_ENDING).read_text(encoding="utf-8")))
        Outcome(**record.outcome or {})
    except (OSError, ValueError, TypeError):
        return None
    return record


def compute_digest(path: str) -> str:
    """Return the SHA-256 of a file in hexadecimal digits; raises :class:`FileError`."""
    sha = hashlib.sha256()
    try:
        with Path(path).open("rb") as file:
            while block := file.read(2**20):
                sha.update(block)
    except FileNotFoundError as error:
        raise FileError(f"{path}: no such file") from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return sha.hexdigest()
