#!/usr/bin/env python3
"""Write the documents that are made from the code and the descriptors.

docs/filters.md (every filter and parameter), docs/architecture.md with its
drawing, and the type stubs of the filters and of the functions that take settings.

python3 scripts/make_docs.py
"""

import textwrap
from pathlib import Path

import architecture
import bootstrap

bootstrap.enter("demo")

import stubs  # noqa: E402

from meshlab_specsmooth.meshlab import descriptors  # noqa: E402
from meshlab_specsmooth.meshlab.descriptors import Descriptor, Parameter  # noqa: E402

HEAD = """# The filters

Made from the descriptors in `filters_xml/` by `python3 scripts/make_docs.py`.

Each filter is a function of a MeshSet, `mss.NAME(ms, ...)`, a method of `mss.MeshSet`, and after `mss.register()` a
method of `pymeshlab.MeshSet`, `ms.NAME(...)`. All take keyword arguments only, and in addition a `progress` callback.
Those that move vertices return a dict of diagnostics: cut-off, modes, wavelength, iterations, residual, displacement,
seconds.
"""

STUB_HEAD = '''"""The filters on MeshSets and their parameters, for type checkers and editors.

Made from the descriptors in ``filters_xml/`` by ``python3 scripts/make_docs.py``.
"""

from collections.abc import Callable
from typing import Literal, Protocol

import pymeshlab

from meshlab_specsmooth.describe import Report

class _Value(Protocol):
    """pymeshlab's PercentageValue (of the bounding-box diagonal) and PureValue."""

    def value(self) -> float: ...
'''


def page() -> str:
    parts = [HEAD]
    for name in descriptors.names():
        filter_ = descriptors.load(name)
        parts += [f"## {name}", textwrap.fill(f"**{filter_.name}** ({filter_.category}). {filter_.help}", 118)]
        rows = ["| parameter | type | default | |", "|---|---|---|---|"]
        for p in filter_.parameters:
            kind = p.kind.replace("|", "\\|")
            rows.append(f"| `{p.name}` | {kind} | {p.shown_default} | {p.help} |")
        parts.append("\n".join(rows))
    return "\n\n".join(part.strip() for part in parts) + "\n"


def stub() -> str:
    filters = [descriptors.load(name) for name in descriptors.names()]
    functions = "\n".join(function(filter_, "ms: pymeshlab.MeshSet") for filter_ in filters)
    methods = "\n".join(textwrap.indent(function(filter_, "self"), "    ") for filter_ in filters)
    own = '''class MeshSet(pymeshlab.MeshSet):  # type: ignore[misc]
    """A pymeshlab MeshSet that knows our filters, without ``register``."""
'''
    return f"{STUB_HEAD}\n{functions}\n{own}\n{methods}"


def function(filter_: Descriptor, first: str) -> str:
    parameters = [f"    {p.name}: {type_of(p)} = {default_of(p)}," for p in filter_.parameters]
    documentation = [f"{filter_.name}, in place on the current mesh.", "", *textwrap.wrap(filter_.help, 112), ""]
    documentation += ["Parameters", "----------"]
    for p in filter_.parameters:
        documentation.append(f"{p.name} : {p.kind}, default {p.shown_default}")
        documentation += textwrap.wrap(p.help, 108, initial_indent="    ", subsequent_indent="    ")
    return "\n".join(
        [
            f"def {filter_.function}(",
            f"    {first},",
            "    *,",
            *parameters,
            "    progress: Callable[[float], object] | None = None,",
            ") -> Report:",
            f'    """{documentation[0]}',
            *(f"    {line}".rstrip() for line in documentation[1:]),
            '    """',
            "",
        ]
    )


def type_of(parameter: Parameter) -> str:
    if parameter.type == "enum":
        return f"Literal[{', '.join(map(quoted, parameter.values))}]"
    return {"length": "float | _Value"}.get(parameter.type, parameter.type)


def default_of(parameter: Parameter) -> str:
    """The default as it stands; one that depends on the mesh is left out."""
    if isinstance(parameter.default, str):
        return quoted(parameter.default)
    return repr(parameter.default) if isinstance(parameter.default, bool | int | float) else "..."


def quoted(text: str) -> str:
    return f'"{text}"'


def documents() -> dict[Path, str]:
    """The text of each file."""
    docs = bootstrap.ROOT / "docs"
    return {
        docs / "filters.md": page(),
        docs / "architecture.md": architecture.page(),
        docs / "architecture.svg": architecture.drawing(),
        bootstrap.ROOT / "meshlab_specsmooth" / "meshlab" / "signatures.pyi": stub(),
        stubs.path_of("__init__"): stubs.make_package_stub(),
        **{stubs.path_of(module): stubs.make_stub(module) for module in stubs.MODULES},
    }


if __name__ == "__main__":
    for file, text in documents().items():
        file.write_text(text, encoding="utf-8")
