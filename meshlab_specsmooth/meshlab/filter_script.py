"""The filter script of a MeshSet, read and replaced without printing anything."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pymeshlab

from meshlab_specsmooth.meshlab import native_output, records
from meshlab_specsmooth.meshlab.filter_script_text import remove_last, substitute_steps
from meshlab_specsmooth.meshlab.records import Placeholder, state_of
from meshlab_specsmooth.runtime import temporary
from meshlab_specsmooth.runtime.interrupts import DeferInterrupts

# pymeshlab's own methods, bound before they are wrapped here or replaced by register()
_NATIVE_LOAD, _NATIVE_SAVE = pymeshlab.MeshSet.load_filter_script, pymeshlab.MeshSet.save_filter_script


def get_script(ms: pymeshlab.MeshSet) -> str:
    """Return the filter script of a MeshSet, as pymeshlab writes it."""
    with DeferInterrupts():
        resolve_placeholders(ms)
        return _save(ms)


def set_script(ms: pymeshlab.MeshSet, text: str) -> None:
    """Replace the filter script of a MeshSet; pymeshlab's messages about it are suppressed."""
    state_of(ms).placeholders.clear()
    if "<filter " not in text:
        ms.clear_filter_script()
        return
    with DeferInterrupts(), temporary.folder() as folder:
        path = Path(folder) / "script.mlx"
        path.write_text(text, encoding="utf-8")
        with native_output.capture():
            ms.clear_filter_script()
            _NATIVE_LOAD(ms, str(path))


@contextlib.contextmanager
def preserve_script(ms: pymeshlab.MeshSet) -> Iterator[None]:
    """Restore the filter script at the end; use it within :class:`DeferInterrupts`.

    pymeshlab records every filter and cannot remove the last record, so the script is saved and loaded again. Saved
    scripts hold numbers with six digits, and so does the restored script.
    """
    script = get_script(ms)
    try:
        yield
    finally:
        set_script(ms, script)


def resolve_placeholders(ms: pymeshlab.MeshSet) -> None:
    """Replace the placeholder records in pymeshlab's script by the filters that they stand for."""
    if state_of(ms).placeholders:
        with DeferInterrupts():
            set_script(ms, substitute_steps(_save(ms), state_of(ms).placeholders))


def discard_records(ms: pymeshlab.MeshSet, used: list[Placeholder], earlier: int) -> None:
    """Remove the records of a failed call, and resolve the ``earlier`` placeholders, those of the calls before it."""
    script = remove_last(_save(ms), used)
    set_script(ms, substitute_steps(script, state_of(ms).placeholders[:earlier]))


def _save(ms: pymeshlab.MeshSet) -> str:
    with DeferInterrupts(), temporary.folder() as folder:
        path = Path(folder) / "script.mlx"
        _NATIVE_SAVE(ms, str(path))
        return path.read_text(encoding="utf-8")


records.wrap_methods(resolve_placeholders)
