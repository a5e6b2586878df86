"""The packages and their imports, from the code: docs/architecture.md and docs/architecture.svg.

Written by scripts/make_docs.py. It reads the files without importing them, so that whoever moves or renames something
runs it again in a second. Places are named by a package and a definition; the file is looked up.
"""

import ast
import functools
import itertools
import sys
import textwrap
from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NAME = "meshlab_specsmooth"
PACKAGE = ROOT / NAME

# dependencies that every package may use
COMMON = {"numpy", "scipy"}

#: What a reader wants to find or to add: the package and the definition where it is.
PLACES = [
    ("see where the weight (the strength) is chosen", "risk", "choose_weight"),
    ("see where the noise is measured", "noise", "estimate"),
    ("see where the cut-off is turned into an eigenvalue", "spectral", "design"),
    ("see where h(L) is applied without eigenvectors", "spectral", "ChebyshevSeries"),
    ("see where step 3, the least squares, is solved", "operators", "solve"),
    ("see where the boundary is handled", "operators", "BoundaryCurve"),
    ("see or change the parameters of a filter and their defaults", "smoothing", "Smoothing"),
    ("see where selections and features are handled", "smoothing", "ActiveRegion"),
    ("see where edge-aware settings are searched", "edge_aware", "search_settings"),
    ("see where an automatic result is checked against the noise", "noise", "compare_shapes"),
    ("see where bad input is refused", "geometry", "Surface"),
    ("see where a MeshSet is changed", "meshlab", "commit.write"),
    ("add an operator (weights of the Laplacian)", "operators", "LAPLACIANS"),
    ("add a response (transfer function)", "spectral", "RESPONSES"),
    ("add a filter on MeshSets", "meshlab", "mesh_filter"),
    ("add a kernel over all edges", "graph", "VertexKernels"),
    ("add a filter to the comparison", "comparison", "FILTER_SPECS"),
    ("add a measure to the comparison", "comparison", "MEASURES"),
    ("add a kind of mesh object that functions accept", "adapters", "_RECOGNIZERS"),
    ("add a subcommand", "cli", "_COMMANDS"),
]

#: The way of the vertices through ``specsmooth denoise in.ply out.ply``.
JOURNEY = [
    ("cli", "denoise.run", "reads the arguments and calls the steps below"),
    ("meshlab", "mesh_files.read", "loads the file with pymeshlab, once its header is checked"),
    ("meshlab", "mesh_filter", "checks the parameters and gets vertices (n, 3) and faces (m, 3) from the MeshSet"),
    ("edge_aware", "denoise_surface", "centers the vertices and scales them to units of the mean edge"),
    ("operators", "assemble", "builds the Laplacian and the barycenter term"),
    ("noise", "estimate", "estimates the noise: its kind, its level, its interval"),
    (
        "edge_aware",
        "search_settings",
        "runs candidate settings, isotropic and edge-aware, and estimates the error of each",
    ),
    ("operators", "solve", "computes the displacement of an isotropic run by conjugate gradients (step 3)"),
    ("meshlab", "commit.write", "puts the new positions into the MeshSet, or leaves it as it was"),
    ("meshlab", "mesh_files.write", "writes a temporary file and moves it to its place"),
]

TEXT = """# Architecture

Made from the code by `python3 scripts/make_docs.py`; a test compares this page with the code.

## The packages

An arrow points from a package to one that it imports. Imports that follow from others are left out: a package may
use everything below it that arrows lead to.{circles}
Libraries other than numpy and scipy are in blue; `import {name}` loads none of them.

![The packages and their imports](architecture.svg)

{packages}

## Where is it?

{places}

[CONTRIBUTING.md](../CONTRIBUTING.md) shows what to write there.

## From the file to the file

The vertices of `specsmooth denoise in.ply out.ply` pass through

{journey}

`mss.denoise(V, F)` is steps 4 to 8, the filter on a MeshSet steps 3 to 9.
"""


def page() -> str:
    """docs/architecture.md."""
    packages = table(
        ("package", "purpose", "files", "libraries"),
        (
            (f"`{name}`", purpose(name), str(len(files_of(name))), ", ".join(f"`{each}`" for each in libraries(name)))
            for row in rows(units())
            for unit in row
            for name in unit
        ),
    )
    places = table(
        ("I want to", "file", "look for"), ((what, f"`{find(*at)}`", f"`{short(at[1])}`") for what, *at in PLACES)
    )
    journey = [
        textwrap.fill(f"{number}. `{find(package, name)}`: `{short(name)}` {what}.", 118, subsequent_indent="   ")
        for number, (package, name, what) in enumerate(JOURNEY, 1)
    ]
    circles = " Packages in one box import each other." if any(len(unit) > 1 for unit in units()) else ""
    return TEXT.format(packages=packages, places=places, journey="\n".join(journey), name=NAME, circles=circles)


def short(name: str) -> str:
    """A definition without its module."""
    return name.rpartition(".")[2]


def table(head: Iterable[str], body: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    titles = list(head)
    lines = [titles, ["---"] * len(titles), *map(list, body)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


@functools.cache
def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def package_of(file: Path) -> str:
    """The package, or the module beside the packages, that a file belongs to."""
    return file.relative_to(PACKAGE).parts[0].removesuffix(".py")


def files_of(name: str) -> list[Path]:
    return [file for file in sources() if package_of(file) == name]


@functools.cache
def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


def purpose(name: str) -> str:
    """The first sentence of its docstring."""
    head = PACKAGE / name / "__init__.py" if (PACKAGE / name).is_dir() else PACKAGE / f"{name}.py"
    paragraph = (ast.get_docstring(tree(head)) or "").partition("\n\n")[0]
    return " ".join(paragraph.split()).partition(". ")[0].removesuffix(".").replace("``", "`")


def imported(file: Path) -> Iterator[str]:
    """Dotted names that a file imports, at any depth of its code."""
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def libraries(name: str) -> list[str]:
    """What it imports from outside, but for numpy and scipy."""
    first = {each.partition(".")[0] for file in files_of(name) for each in imported(file)}
    return sorted(first - COMMON - {NAME} - sys.stdlib_module_names)


def find(package: str, name: str) -> str:
    """The file, from the package's folder on, that defines a name at its top level.

    ``module.name`` says which module is meant, where several have one of that name.
    """
    module, _, own = name.rpartition(".")
    found = [
        file
        for file in files_of(package)
        if own in defined(file) and module in ("", file.stem if file.stem != "__init__" else package)
    ]
    if len(found) != 1:
        raise LookupError(f"{package} defines {name} in {len(found)} files, not in one: see {Path(__file__).name}")
    return found[0].relative_to(PACKAGE).as_posix()


def defined(file: Path) -> set[str]:
    names = set()
    for node in tree(file).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names.update(target.id for target in targets if isinstance(target, ast.Name))
    return names


Unit = tuple[str, ...]  # a package; several where they import each other in a circle
Graph = dict[Unit, set[Unit]]


@functools.cache
def units() -> Graph:
    """What each package imports directly."""
    names = {package_of(file) for file in sources()}
    direct: dict[str, set[str]] = {name: set() for name in names}
    for file in sources():
        for each in imported(file):
            parts = each.split(".")
            if parts[0] == NAME:
                used = parts[1] if parts[1] in names else "__init__"
                direct[package_of(file)] |= {used} - {package_of(file)}
    below = closure(direct)
    unit = {name: tuple(sorted({name} | {each for each in below[name] if name in below[each]})) for name in names}
    return {
        each: {unit[used] for name in each for used in direct[name]} - {each} for each in sorted(set(unit.values()))
    }


def closure(graph: dict) -> dict:
    """Everything that can be reached from each node."""
    reached = graph
    while True:
        further = {node: below.union(*(reached[each] for each in below)) for node, below in reached.items()}
        if further == reached:
            return reached
        reached = further


def reduction(graph: Graph) -> Graph:
    """The arrows that do not follow from others."""
    below = closure(graph)
    return {
        node: {each for each in used if not any(each in below[other] for other in used)} for node, used in graph.items()
    }


def rows(graph: Graph) -> list[list[Unit]]:
    """Rows from top to bottom: each package directly below the lowest one that imports it."""
    users = {node: {other for other, used in graph.items() if node in used} for node in graph}
    depth: dict[Unit, int] = {}

    def depth_of(node: Unit) -> int:
        if node not in depth:
            depth[node] = 1 + max(map(depth_of, users[node]), default=-1)
        return depth[node]

    deepest = max(map(depth_of, graph))
    return [[node for node in graph if depth[node] == level] for level in range(deepest + 1)]


WIDTH, BOX, GAP, LANE = 960, 212, 26, 26
LINE, PAD, BETWEEN = 14, 9, 34
LETTERS = 33  # in a line of a box


def drawing() -> str:
    """docs/architecture.svg."""
    graph = units()
    arrows = reduction(graph)
    levels = [list(row) for row in rows(graph)]
    depth = {node: level for level, row in enumerate(levels) for node in row}
    # an arrow past several rows runs through a lane of its own in each
    chains = []
    for node, used in arrows.items():
        for other in sorted(used):
            lanes = [(node, other, level) for level in range(depth[node] + 1, depth[other])]
            for lane in lanes:
                levels[lane[2]].append(lane)
            chains.append([node, *lanes, other])
    above: dict = {}
    for chain in chains:
        for upper, lower in itertools.pairwise(chain):
            above.setdefault(lower, []).append(upper)

    x: dict = {}
    top: dict = {}
    height: dict = {}
    y = 10.0
    for row in levels:
        row.sort(key=lambda item: sum(x[each] for each in above.get(item, ())) / max(1, len(above.get(item, ()))))
        left = (WIDTH - sum(BOX if item in graph else LANE for item in row) - GAP * (len(row) - 1)) / 2
        tallest = max(len(lines(item)) for item in row if item in graph) * LINE + 2 * PAD
        for item in row:
            wide = BOX if item in graph else LANE
            x[item] = left + wide / 2
            top[item] = y
            height[item] = len(lines(item)) * LINE + 2 * PAD if item in graph else tallest
            left += wide + GAP
        y += tallest + BETWEEN
    parts = [path(chain, x, top, height) for chain in chains]
    parts += [box(node, x[node], top[node], height[node]) for node in graph]
    return SVG.format(width=WIDTH, height=round(y - BETWEEN + 10), body="\n".join(parts))


SVG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">
<title>The packages of meshlab_specsmooth; an arrow points to what is imported</title>
<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto"><path \
d="M0 0L8 4L0 8z" fill="#57606a"/></marker></defs>
<style>
.box {{ fill: #f6f8fa; stroke: #57606a; }}
.arrow {{ fill: none; stroke: #57606a; stroke-width: 1.2; marker-end: url(#tip); }}
text {{ font: 11px sans-serif; fill: #24292f; text-anchor: middle; }}
.name {{ font: bold 12.5px monospace; }}
.library {{ fill: #0550ae; font-style: italic; }}
</style>
<rect width="100%" height="100%" fill="#ffffff"/>
{body}
</svg>
"""


def lines(unit: Unit) -> list[tuple[str, str]]:
    """The text of a box: class and text of each line."""
    written = []
    for name in unit:
        written.append(("name", name))
        written += [("", line) for line in textwrap.wrap(purpose(name).replace("`", ""), LETTERS)]
        written += [("library", line) for line in textwrap.wrap(", ".join(libraries(name)), LETTERS)]
    return written


def box(unit: Unit, x: float, y: float, height: float) -> str:
    text = [
        f'<text class="{kind}" x="{x:g}" y="{y + PAD + LINE * (number + 0.8):g}">{escape(line)}</text>'
        for number, (kind, line) in enumerate(lines(unit))
    ]
    rectangle = f'<rect class="box" x="{x - BOX / 2:g}" y="{y:g}" width="{BOX}" height="{height:g}" rx="5"/>'
    return "\n".join([rectangle, *text])


def path(chain: list, x: dict, top: dict, height: dict) -> str:
    """A curve from the bottom of the first box through the lanes to the top of the last."""
    at = [(x[chain[0]], top[chain[0]] + height[chain[0]])]
    for lane in chain[1:-1]:
        at += [(x[lane], top[lane]), (x[lane], top[lane] + height[lane])]
    at.append((x[chain[-1]], top[chain[-1]] - 1))
    drawn = f"M{at[0][0]:g} {at[0][1]:g}"
    for (x0, y0), (x1, y1) in itertools.pairwise(at):
        middle = (y0 + y1) / 2
        drawn += f"L{x1:g} {y1:g}" if x0 == x1 else f"C{x0:g} {middle:g} {x1:g} {middle:g} {x1:g} {y1:g}"
    return f'<path class="arrow" d="{drawn}"/>'
