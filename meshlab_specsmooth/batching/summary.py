"""The summary of a batch, as an object and as files."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from meshlab_specsmooth.batching.record import STATUSES, Outcome
from meshlab_specsmooth.describe import Described, Rows
from meshlab_specsmooth.runtime import atomic
from meshlab_specsmooth.version import VERSION

# Maximum number of meshes that are listed
_SHOWN = 20

#: Columns of the table.
COLUMNS = tuple(field.name for field in fields(Outcome))


@dataclass(frozen=True, repr=False)
class BatchSummary(Described):
    """The outcome of each mesh of a batch.

    Attributes
    ----------
    outcomes : tuple of Outcome
        In the order of the inputs.
    seconds : float
        Total wall time.
    pictures : tuple of str
        Files of the contact sheets.
    """

    outcomes: tuple[Outcome, ...]
    seconds: float
    pictures: tuple[str, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """Number of meshes by status, without those that do not occur."""
        found = Counter(outcome.status for outcome in self.outcomes)
        return {status: found[status] for status in STATUSES if found[status]}

    @property
    def summary(self) -> str:
        """Number of meshes by status, on one line."""
        count = len(self.outcomes)
        counts = ", ".join(f"{number} {status}" for status, number in self.counts.items())
        return f"{count} mesh{'' if count == 1 else 'es'}: {counts or 'nothing to do'}; {self.seconds:.1f} s"

    def rows(self) -> Rows:
        """The first meshes, of which those without an output come first."""
        ordered = sorted(self.outcomes, key=lambda outcome: outcome.is_there)
        rows = [(outcome.status, _line(outcome)) for outcome in ordered[:_SHOWN]]
        more = len(ordered) - len(rows)
        return [*rows, ("...", f"and {more} more, in summary.csv")] if more else rows

    @property
    def is_complete(self) -> bool:
        """Whether every mesh has its output."""
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
        atomic.write_text(out / "summary.json", json.dumps(document, indent=1) + "\n")
        table = io.StringIO()
        writer = csv.DictWriter(table, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {name: _writable(value) for name, value in asdict(outcome).items()} for outcome in self.outcomes
        )
        atomic.write_text(out / "summary.csv", table.getvalue())


def _line(outcome: Outcome) -> str:
    """Describe a mesh on one line."""
    if not outcome.is_there:
        return f"{_writable(outcome.input)}: {outcome.reason}"
    return f"{_writable(outcome.output)}{f' ({outcome.warning})' if outcome.warning else ''}"


def _writable(value: object) -> object:
    """Escape the bytes of a file name that are not text, which Python represents by surrogates."""
    return value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value
