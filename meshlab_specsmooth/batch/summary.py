"""What became of each mesh, as an object and as files."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from meshlab_specsmooth.batch.work import STATUSES, Outcome
from meshlab_specsmooth.bridge import files
from meshlab_specsmooth.version import VERSION

#: Columns of the table.
COLUMNS = tuple(field.name for field in fields(Outcome))


@dataclass(frozen=True)
class BatchSummary:
    """What became of each mesh.

    Attributes
    ----------
    outcomes : tuple of Outcome
        In the order of the inputs.
    seconds : float
        Wall time of all of it.
    pictures : tuple of str
        Contact sheets.
    """

    outcomes: tuple[Outcome, ...]
    seconds: float
    pictures: tuple[str, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """How many meshes have each status, those that occur."""
        found = Counter(outcome.status for outcome in self.outcomes)
        return {status: found[status] for status in STATUSES if found[status]}

    @property
    def is_complete(self) -> bool:
        """Whether every output is there."""
        return all(outcome.is_there for outcome in self.outcomes)

    def write(self, out: Path) -> None:
        """Write ``summary.json`` and ``summary.csv``."""
        document = {
            "version": VERSION,
            "counts": self.counts,
            "seconds": self.seconds,
            "pictures": list(self.pictures),
            "meshes": [asdict(outcome) for outcome in self.outcomes],
        }
        files.write_text(out / "summary.json", json.dumps(document, indent=1) + "\n")
        table = io.StringIO()
        writer = csv.DictWriter(table, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {name: _writable(value) for name, value in asdict(outcome).items()} for outcome in self.outcomes
        )
        files.write_text(out / "summary.csv", table.getvalue())


def _writable(value: object) -> object:
    """A file's name need not be text: its odd bytes, which Python keeps as halves of characters, are spelled out."""
    return value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value
