#!/usr/bin/env python3
"""Write docs/filters.md, every filter and parameter, from the descriptors.

python3 scripts/make_docs.py
"""

import bootstrap

bootstrap.enter("demo")

from meshlab_specsmooth import descriptors  # noqa: E402

HEAD = """# The filters

Made from the descriptors in `filters_xml/` by `python3 scripts/make_docs.py`.

Each is a function of a MeshSet, `mss.NAME(ms, ...)`, a method of `mss.MeshSet`, and after `mss.register()` a method of
`pymeshlab.MeshSet`, `ms.NAME(...)`. All take keywords only, and a `progress` callback besides. Those that move vertices
return their evidence as a dict: cut-off, modes, wavelength, iterations, residual, displacement, seconds.
"""


def page() -> str:
    parts = [HEAD]
    for name in descriptors.names():
        filter_ = descriptors.load(name)
        parts += [f"## {name}", f"**{filter_.name}** ({filter_.category}). {filter_.help}"]
        rows = ["| parameter | type | default | |", "|---|---|---|---|"]
        for p in filter_.parameters:
            kind = p.kind.replace("|", "\\|")
            rows.append(f"| `{p.name}` | {kind} | {p.shown_default} | {p.help} |")
        parts.append("\n".join(rows))
    return "\n\n".join(part.strip() for part in parts) + "\n"


if __name__ == "__main__":
    (bootstrap.ROOT / "docs" / "filters.md").write_text(page(), encoding="utf-8")
