"""The result of a comparison: its data, and what they mean in words and tables."""

from __future__ import annotations

import html
from dataclasses import dataclass

from meshlab_specsmooth.comparison import summary, tables
from meshlab_specsmooth.comparison.ranking import Ranking


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Ranking):
    """Filters side by side on one mesh; a notebook shows it as a table.

    The attributes are those of :class:`~meshlab_specsmooth.comparison.ranking.Ranking`.
    """

    def headline(self) -> str:
        """Return the recommended filter in one line, and whether the truth, if known, agrees."""
        return summary.headline(self)

    def reasons(self) -> tuple[str, ...]:
        """Return the reasons for the recommendation, in sentences."""
        return tuple(summary.list_reasons(self))

    def __repr__(self) -> str:
        return f"<Comparison: {len(self.rows) - 1} filters on {self.name}: {self.headline()}>"

    def __str__(self) -> str:
        return tables.text_table(self)

    def _repr_html_(self) -> str:
        reasons = html.escape(" ".join(self.reasons()))
        return f"<p><b>{html.escape(self.headline())}.</b> {reasons}</p>{tables.html_table(self)}"
