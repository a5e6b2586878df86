"""Type stubs of the functions whose parameters are made from settings: what a checker and an editor show."""

import importlib
import inspect
import re
import textwrap
from pathlib import Path

import bootstrap

#: Modules of functions that are decorated by ``take_setting``, below the package.
MODULES = ("smoothing.api", "edge_aware.api")

HEAD = '''"""Types of {module}, made from the settings by ``python3 scripts/make_docs.py``."""

{imports}

'''

# Where the names in annotations come from.
NAMES = {
    "npt": "import numpy.typing as npt",
    **dict.fromkeys(
        ("AnyResponseName", "Boundary", "LaplacianKind", "Method", "ModeCount", "ResponseName", "Start"),
        "choices",
    ),
    "Mesh": "adapters",
    "Floats": "arrays",
    "Progress": "runtime.progress",
    "Workspace": "runtime.workspace",
    "Family": "spectral.response",
    "Response": "spectral.response",
    "CutoffResponse": "spectral.low_pass",
    **dict.fromkeys(("Smoothing", "LowPass", "Enhancement", "Region"), "smoothing.settings"),
    "SmoothingResult": "smoothing.result",
    "Choice": "smoothing.choice",
    "LabelResult": "smoothing.labels",
    **dict.fromkeys(("Denoising", "EdgeAware", "EdgeAwareRegion"), "edge_aware.settings"),
    "EdgeAwareResult": "edge_aware.result",
}

# Of keywords that are not fields of a setting.
ANNOTATIONS = {
    "labels": "npt.ArrayLike | str | None",
    "laplacian": "LaplacianKind",
    "weld": "bool",
    "start": "SmoothingResult | None",
    "workspace": "Workspace | None",
    "progress": "Progress | None",
}


def path_of(module: str) -> Path:
    """The stub beside a module."""
    return bootstrap.ROOT / "meshlab_specsmooth" / Path(*module.split(".")).with_suffix(".pyi")


def make_package_stub() -> str:
    """The text of the package's stub: its public names, imported where they are defined."""
    import meshlab_specsmooth as mss

    lines = [
        wrap_import(f"from meshlab_specsmooth.{module} import", [f"{name} as {name}"])
        for module, names in sorted(mss._NAMES.items())
        for name in sorted(names.split())
    ]
    head = '"""Types of the public names, made by ``python3 scripts/make_docs.py``."""'
    version = "__version__: str"
    return "\n".join([head, "", *lines, "", version, ""])


def make_stub(module: str) -> str:
    """The text of one stub."""
    loaded = importlib.import_module(f"meshlab_specsmooth.{module}")
    functions = [
        each
        for each in vars(loaded).values()
        if inspect.isfunction(each) and each.__module__ == loaded.__name__ and not each.__name__.startswith("_")
    ]
    bodies = "\n".join(make_function(each) for each in functions)
    words = set(re.findall(r"\w+", re.sub(r'""".*?"""', "", bodies, flags=re.DOTALL)))
    lines, by_module = [], {}
    for name, source in NAMES.items():
        if name in words:
            if source.startswith("import"):
                lines.append(source)
            else:
                by_module.setdefault(source, []).append(name)
    own = [wrap_import(f"from meshlab_specsmooth.{source} import", names) for source, names in by_module.items()]
    blocks = [each for each in ("\n".join(lines), "\n".join(sorted(own))) if each]
    return HEAD.format(module=f"``meshlab_specsmooth.{module}``", imports="\n\n".join(blocks)) + bodies


def wrap_import(start: str, names: list[str]) -> str:
    """An import as the formatter leaves it."""
    line = f"{start} {', '.join(sorted(names))}"
    if len(line) <= 120:
        return line
    rows = "".join(f"    {name},\n" for name in sorted(names))
    return f"{start} (\n{rows})"


def make_function(function) -> str:
    """A function with its parameters and its documentation."""
    signature = inspect.signature(function)
    lines, has_star = [], False
    for each in signature.parameters.values():
        if each.kind is inspect.Parameter.KEYWORD_ONLY and not has_star:
            lines.append("    *,")
            has_star = True
        annotation = each.annotation
        if annotation is inspect.Parameter.empty:
            annotation = ANNOTATIONS[each.name]
        default = "" if each.default is inspect.Parameter.empty else f" = {shown(each.default)}"
        lines.append(f"    {each.name}: {annotation}{default},")
    documentation = textwrap.indent(inspect.cleandoc(function.__doc__ or ""), "    ").strip()
    documentation = "\n".join(line.rstrip() for line in documentation.split("\n"))
    returned = re.search(r"Returns\n\s+-+\n\s+(\w+)", function.__doc__ or "")
    result = returned[1] if returned else "SmoothingResult"
    quotes = 'r"""' if "\\" in documentation else '"""'
    body = f'    {quotes}{documentation}\n    """'
    return "\n".join([f"def {function.__name__}(", *lines, f") -> {result}:", body, ""])


def shown(default: object) -> str:
    """A default as one would write it."""
    return f'"{default}"' if isinstance(default, str) else repr(default)
