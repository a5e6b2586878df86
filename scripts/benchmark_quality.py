#!/usr/bin/env python3
"""Quality: noisy meshes with a known truth through MeshLab's filters, tuned on it, and ours, without a parameter.

python3 scripts/benchmark_quality.py                          pairs made in code (see scripts/pairs.py)
python3 scripts/benchmark_quality.py --pairs DIR --json FILE  pairs NAME_noisy.obj, NAME_truth.obj (.ply, .off)
python3 scripts/benchmark_quality.py --peers                  filters of other packages too, which it installs first
python3 scripts/benchmark_quality.py --small                  whether it works, in a minute; the figures mean nothing

Writes quality.md, quality.json and a picture a pair into a folder (--out). Columns: theta, mean angle between the
normals of faces and the true ones, in degrees; Ev, distance of the vertices to the true surface, and RMS, distance to
their true places, both in mean edges; volume, its change in per cent, of closed meshes; flips, per cent of faces turned
over against the truth; seconds, from arrays to arrays. What is tuned has a row for its least theta and one for its
least Ev, each the best of a grid, which is stated below the tables.
"""

import argparse
import hashlib
import importlib.util
import json
import math
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import bootstrap

bootstrap.enter("demo")

import contenders  # noqa: E402
import numpy as np  # noqa: E402
import pairs  # noqa: E402
from contenders import Contender, Setting  # noqa: E402

import meshlab_specsmooth as mss  # noqa: E402
from meshlab_specsmooth.arrays import Floats  # noqa: E402
from meshlab_specsmooth.comparison import metrics  # noqa: E402
from meshlab_specsmooth.geometry.surface import Surface, is_closed, mean_edge_length  # noqa: E402
from meshlab_specsmooth.meshlab import mesh_files, meshset  # noqa: E402
from meshlab_specsmooth.report.pictures import Panel, front, picture  # noqa: E402
from meshlab_specsmooth.runtime import atomic  # noqa: E402

# further off than so many edges, a result is said to diverge and is measured no further
_ASTRAY = 10.0


@dataclass(frozen=True)
class Pair:
    """A noisy surface and its truth, the same faces."""

    name: str
    noisy: Surface
    truth: Surface

    @property
    def key(self) -> str:
        """The same for the same arrays."""
        arrays = (self.noisy.vertices, self.truth.vertices, self.truth.faces)
        return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()[:16]


@dataclass(frozen=True)
class Row:
    """A result, measured; what the columns mean is said at the top of this file."""

    method: str
    group: str
    chosen: str  # "default", or "theta" or "Ev": what the setting is the best for
    setting: Setting
    theta: "float | None" = None
    surface: "float | None" = None
    vertex: "float | None" = None
    volume: "float | None" = None
    flips: "float | None" = None
    seconds: "float | None" = None
    failure: str = ""


# --- pairs ---


def pairs_of(folder: Path, only: "Sequence[str] | None") -> "Iterator[Pair]":
    for noisy in sorted(folder.glob("*_noisy.*")):
        name, truth = noisy.stem.removesuffix("_noisy"), noisy.with_name(noisy.name.replace("_noisy", "_truth"))
        if noisy.suffix.lower() in {".obj", ".ply", ".off"} and truth.is_file() and (not only or name in only):
            both = [Surface(*meshset.get_arrays(mesh_files.read(file))) for file in (noisy, truth)]
            if not np.array_equal(both[0].faces, both[1].faces):
                sys.exit(f"{noisy} and {truth} do not have the same faces")
            yield Pair(name, *both)


def made_pairs(vertices: int, only: "Sequence[str] | None") -> "Iterator[Pair]":
    for name in only or pairs.PAIRS:
        yield Pair(name, *pairs.make(name, vertices))


def warm_up() -> None:
    """Load what is loaded once: compiled code, threads."""
    noisy, _ = pairs.make("torus_gaussian_0.3", 1500)
    mss.smooth(noisy.vertices, noisy.faces, modes=20)


# --- measuring ---

NOISY = Contender("noisy", "noisy", lambda vertices, faces: vertices)


def tried(pair: Pair, contender: Contender, setting: Setting) -> "tuple[Floats | None, float, str]":
    """The vertices, the seconds, and what went wrong."""
    start = time.perf_counter()
    try:
        vertices = contender.run(pair.noisy.vertices, pair.noisy.faces, **setting)
    except Exception as error:  # whatever a foreign filter raises is a row that says so
        return None, time.perf_counter() - start, f"fails: {' '.join(str(error).split())[:80] or type(error).__name__}"
    seconds = time.perf_counter() - start
    if not np.isfinite(vertices).all() or _off(vertices, pair) > _ASTRAY:
        return None, seconds, "diverges"
    return vertices, seconds, ""


def _off(vertices: Floats, pair: Pair) -> float:
    """As metrics.vertex_error, without a warning where the numbers are too large to be squared."""
    with np.errstate(over="ignore"):
        return float(np.abs(vertices - pair.truth.vertices).max(axis=1).mean()) / mean_edge_length(pair.truth)


def measured(pair: Pair, contender: Contender, chosen: str, setting: Setting) -> Row:
    vertices, seconds, failure = tried(pair, contender, setting)
    if vertices is None:
        return Row(contender.name, contender.group, chosen, setting, seconds=seconds, failure=failure)
    result, truth = Surface(vertices, pair.truth.faces), pair.truth
    return Row(
        contender.name,
        contender.group,
        chosen,
        setting,
        theta=metrics.normal_error(result, truth),
        surface=metrics.surface_error(result, truth),
        vertex=metrics.vertex_error(result, truth),
        volume=metrics.volume_change(result, truth) if is_closed(truth) else None,
        flips=metrics.flipped(result, truth),
        seconds=seconds,
    )


def rows_of(pair: Pair, contender: Contender) -> "list[Row]":
    """With its default, and with the settings of its grid that are best by theta and by Ev."""
    rows = [] if contender.default is None else [measured(pair, contender, "default", contender.default)]
    candidates = [measured(pair, contender, "", setting) for setting in contender.settings()]
    # the default is a setting as well, and may be the best of all
    worked = [row for row in candidates + rows if not row.failure]
    if contender.grid and worked:
        for chosen, by in (("theta", lambda row: row.theta), ("Ev", lambda row: row.surface)):
            rows.append(Row(**(asdict(min(worked, key=by)) | {"chosen": chosen})))
    return rows


class Reference:
    """Rows of what is tuned, kept in a file by what they were made from: the arrays, the method and its grid."""

    def __init__(self, path: "Path | None") -> None:
        self.path = path
        self.kept = json.loads(path.read_text(encoding="utf-8")) if path and path.is_file() else {}

    def rows(self, pair: Pair, contender: Contender) -> "list[Row]":
        if contender.group == "ours":
            return rows_of(pair, contender)
        facts = json.dumps([contender.name, contender.default, contender.grid])
        key = f"{pair.name} {pair.key} {contender.name} {hashlib.sha256(facts.encode()).hexdigest()[:16]}"
        if key not in self.kept:
            self.kept[key] = [asdict(row) for row in rows_of(pair, contender)]
            if self.path:
                atomic.write_text(self.path, json.dumps(self.kept, indent=1))
        return [Row(**row) for row in self.kept[key]]


# --- what is said of them ---


def best(rows: "Sequence[Row]", groups: "Sequence[str]", column: str) -> "Row | None":
    worked = [row for row in rows if row.group in groups and not row.failure]
    return min(worked, key=lambda row: getattr(row, column), default=None)


def table(pair: Pair, rows: "Sequence[Row]") -> "list[str]":
    """As Markdown, in columns that line up as text."""
    lines = [
        f"### {pair.name}: {len(pair.truth.vertices)} vertices",
        "",
        f"| {'':24} | {'best for':8} |  theta |     Ev |    RMS |  volume |  flips |      s | setting",
        f"|-{'-' * 24}-|-{'-' * 8}-|-{'-' * 6}:|-{'-' * 6}:|-{'-' * 6}:|-{'-' * 7}:|-{'-' * 6}:|-{'-' * 6}:|---",
    ]
    for row in rows:
        setting = ", ".join(f"{name}={value:.4g}" for name, value in row.setting.items())
        cells = [
            f"{row.method:24}",
            f"{row.chosen:8}",
            _cell(row.theta, "6.2f"),
            _cell(row.surface, "6.3f"),
            _cell(row.vertex, "6.3f"),
            _cell(row.volume, "+7.3f"),
            _cell(row.flips, "6.2f"),
            _cell(row.seconds, "6.2f"),
            row.failure or setting,
        ]
        lines.append(f"| {' | '.join(cells)}".rstrip())
    return [*lines, ""]


def _cell(value: "float | None", form: str) -> str:
    width = int(form.strip("+").split(".")[0])
    return " " * width if value is None else f"{value:{form}}"


def summary(results: "dict[str, list[Row]]", against: str, groups: "Sequence[str]") -> "list[str]":
    """Each of ours against the best of some groups for each pair: geometric means, worst, and how often not worse."""
    names = dict.fromkeys(row.method for rows in results.values() for row in rows if row.group == "ours")
    lines = []
    for name in names:
        for column, title in (("theta", "theta"), ("surface", "Ev")):
            ratios = {
                pair: getattr(row, column) / getattr(other, column)
                for pair, rows in results.items()
                for row in rows
                if row.method == name and not row.failure and (other := best(rows, groups, column))
            }
            if ratios:
                mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
                worst = max(ratios, key=lambda pair: ratios[pair])
                fine = sum(ratio <= 1 for ratio in ratios.values())
                lines.append(
                    f"| {name:24} | {against:8} | {title:5} | {mean:14.3f} | {fine:3d} of {len(ratios):<3d} | "
                    f"{ratios[worst]:6.3f} | {worst}"
                )
    return lines


def report(results: "dict[str, list[Row]]", found: "dict[str, Pair]", methods: "Sequence[Contender]") -> str:
    lines = [line for name, rows in results.items() for line in table(found[name], rows)]
    lines += [
        "### Ours / best of the tuned",
        "",
        f"| {'':24} | {'against':8} | {'':5} | geometric mean | no worse   |  worst | on",
        f"|-{'-' * 24}-|-{'-' * 8}-|-{'-' * 5}-|---------------:|------------|-------:|---",
    ]
    tuned = list(dict.fromkeys(c.group for c in methods if c.group != "ours"))
    for group in tuned:
        lines += summary(results, group, [group])
    lines += summary(results, "them all", tuned)
    lines += ["", "### Grids", ""]
    for contender in methods:
        if contender.grid:
            grid = "; ".join(f"{name}: {', '.join(map(str, values))}" for name, values in contender.grid.items())
            lines.append(f"- {contender.name}: {grid}")
    return "\n".join(lines)


def draw(pair: Pair, rows: "Sequence[Row]", methods: "Sequence[Contender]", place: Path) -> None:
    """Noisy, truth, the best of MeshLab's, the best of ours, by theta."""
    panels = [Panel(f"{pair.name}\nnoisy", pair.noisy), Panel("truth", pair.truth)]
    for group in ("MeshLab", "ours"):
        row = best(rows, [group], "theta")
        if row is not None:
            contender = next(c for c in methods if c.name == row.method)
            vertices = contender.run(pair.noisy.vertices, pair.noisy.faces, **row.setting)
            tuned = ", tuned" if row.chosen != "default" else ""
            title = f"{row.method}{tuned}\n{row.theta:.2f} degrees, {row.surface:.3f} edges"
            panels.append(Panel(title, Surface(vertices, pair.truth.faces)))
    picture(place, panels, [front(pair.truth)])


def install(packages: "dict[str, str]") -> None:
    """Those whose modules are missing; what cannot be installed is a row that fails, and no more.

    Into a folder of their own, and searched last: what they bring along must not get in the way of the package's tests.
    """
    folder = bootstrap.ENVIRONMENT / "peers"
    sys.path.append(str(folder))
    for module, package in packages.items():
        if importlib.util.find_spec(module) is None:
            print(f"installing {package} ...", flush=True)
            pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
            subprocess.run([*pip, "--upgrade", "--target", str(folder), package], check=False)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", metavar="DIR", type=Path, help="folder of pairs (default: pairs made in code)")
    parser.add_argument("--only", metavar="PAIR", action="append", help="this pair alone; repeatable")
    parser.add_argument("--methods", metavar="WORD", action="append", help="those with this in their names; repeatable")
    parser.add_argument("--peers", action="store_true", help=f"with those of {', '.join(contenders.PEER_PACKAGES)} too")
    parser.add_argument("--json", metavar="FILE", type=Path, help="all rows (default: quality.json in the folder)")
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("benchmark"), help="(default: benchmark)")
    parser.add_argument("--reference", metavar="FILE", type=Path, help="keep what was tuned in it, and take it from it")
    parser.add_argument("--vertices", metavar="N", type=int, default=6000, help="of pairs made in code (default: 6000)")
    parser.add_argument(
        "--small", action="store_true", help="two values of each parameter, on two made pairs of 600 vertices"
    )
    parser.add_argument("--no-pictures", action="store_true", help="tables only")
    given = parser.parse_args()
    if given.small and not given.pairs:
        given.vertices, given.only = 600, given.only or ["block_gaussian_0.3", "relief_quantized_0.5"]
    return given


def main() -> None:
    given = arguments()
    if given.peers:
        install(contenders.PEER_PACKAGES)
    wanted = [*contenders.MESHLAB, *contenders.PAPER, *(contenders.PEERS if given.peers else ()), *contenders.OURS]
    wanted = [c for c in wanted if not given.methods or any(word in c.name for word in given.methods)]
    if given.small:
        wanted = [contenders.coarse(c) for c in wanted]
    given.out.mkdir(parents=True, exist_ok=True)
    warm_up()
    reference = Reference(given.reference)
    results, found = {}, {}
    for pair in pairs_of(given.pairs, given.only) if given.pairs else made_pairs(given.vertices, given.only):
        rows = rows_of(pair, NOISY)
        for contender in wanted:
            rows += reference.rows(pair, contender)
        results[pair.name], found[pair.name] = rows, pair
        print("\n".join(table(pair, rows)), flush=True)
        if not given.no_pictures:
            draw(pair, rows, wanted, given.out / f"{pair.name}.png")
    if not results:
        sys.exit("no pairs")
    text = report(results, found, wanted)
    print(text[text.index("### Ours") :])
    atomic.write_text(given.out / "quality.md", text + "\n")
    data = {name: [asdict(row) for row in rows] for name, rows in results.items()}
    atomic.write_text(given.json or given.out / "quality.json", json.dumps(data, indent=1))


if __name__ == "__main__":
    main()
