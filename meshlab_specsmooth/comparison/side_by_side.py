"""The same noisy surface through several filters, measured against the truth."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.columns import MEASURES
from meshlab_specsmooth.comparison.filter_specs import FilterSpec
from meshlab_specsmooth.comparison.metrics import measure_errors
from meshlab_specsmooth.comparison.rows import Row
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.meshlab import isolated_filter

#: The columns of these rows.
COLUMNS = tuple(MEASURES[key] for key in ("normal_error", "vertex_error", "volume", "seconds"))


def run_side_by_side(truth: Surface, noisy: Floats, specs: Iterable[FilterSpec]) -> Iterator[Row]:
    """Yield the row of the noisy surface, then one for each filter as it finishes, with the values of :data:`COLUMNS`.

    All filters run in this process on MeshSets, MeshLab's and this package's alike.

    Raises
    ------
    FilterFailed
        A filter raised an error, changed the faces or diverged.
    """
    yield _row(None, Surface(noisy, truth.faces), truth, 0.0)
    for spec in specs:
        ran = isolated_filter.run(noisy, truth.faces, spec.filter, spec.parameters, spec.times)
        yield _row(spec, Surface(ran.vertices, truth.faces), truth, ran.seconds)


def _row(spec: FilterSpec | None, surface: Surface, truth: Surface, seconds: float) -> Row:
    errors = measure_errors(surface, truth)
    values = {"seconds": seconds, **errors}
    return Row(spec, surface, values={column.key: values[column.key] for column in COLUMNS if column.key in values})
