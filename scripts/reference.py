"""The public names of the package, from their docstrings: docs/reference.md. Written by scripts/make_docs.py."""

import inspect
import re
import textwrap

import meshlab_specsmooth as mss

HEAD = """# API reference

Made from the docstrings by `python3 scripts/make_docs.py`. `mss` is `meshlab_specsmooth`. The filters on MeshSets have
a page of their own, [filters.md](filters.md).
"""
WIDTH = 118


def page() -> str:
    """docs/reference.md."""
    public = {name: getattr(mss, name) for name in mss.__all__ if not name.startswith("__")}
    filters = {name for name in public if name in vars(mss.MeshSet)}
    functions = {name: each for name, each in public.items() if inspect.isfunction(each) and name not in filters}
    classes = {name: each for name, each in public.items() if inspect.isclass(each)}
    errors = {name: each for name, each in classes.items() if issubclass(each, Exception)}
    parts = [HEAD.strip(), "## Functions"]
    parts += [entry(name, each) for name, each in functions.items()]
    parts.append("## Classes")
    parts += [entry(name, each) for name, each in classes.items() if name not in errors]
    parts.append("## Errors and warnings")
    rows = [f"| `{name}` | {bases(each)} | {first_sentence(each)} |" for name, each in errors.items()]
    parts.append("\n".join(["| name | is a | |", "|---|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def entry(name: str, each: object) -> str:
    """A heading, the signature of a function, the docstring, and what a class has besides its attributes."""
    parts = [f"### {name}"]
    if inspect.isfunction(each):
        parts.append(f"```py\n{signature(name, each)}\n```")
    parts.append(markdown(inspect.getdoc(each) or ""))
    members = own_members(each) if inspect.isclass(each) else []
    if members:
        parts.append("**Methods and properties**")
        parts.append("\n".join(bullet(f"`{member}`", first_sentence(value)) for member, value in members))
    return "\n\n".join(part for part in parts if part)


def signature(name: str, function: object) -> str:
    """The call, on one line or one parameter a line, without annotations: the docstring has the types."""
    found = inspect.signature(function)
    bare = [each.replace(annotation=inspect.Parameter.empty) for each in found.parameters.values()]
    line = f"mss.{name}{found.replace(parameters=bare, return_annotation=inspect.Signature.empty)}"
    if len(line) <= WIDTH:
        return line
    before, _, after = line.partition("(")
    return f"{before}(\n{textwrap.fill(after[:-1], WIDTH, initial_indent='    ', subsequent_indent='    ')}\n)"


def own_members(each: type) -> list[tuple[str, object]]:
    """Public methods and properties that are defined in this package."""
    members = {}
    for base in reversed(each.__mro__):
        if base.__module__.startswith(mss.__name__):
            members |= {
                name: value
                for name, value in vars(base).items()
                if not name.startswith("_") and (isinstance(value, property) or inspect.isfunction(value))
            }
    filters = set(vars(mss.MeshSet)) if each is mss.MeshSet else set()
    return [(name, value) for name, value in members.items() if value.__doc__ and name not in filters]


def bases(each: type) -> str:
    return ", ".join(f"`{base.__name__}`" for base in each.__bases__)


def first_sentence(each: object) -> str:
    paragraph = " ".join((inspect.getdoc(each) or "").partition("\n\n")[0].split())
    return inline(re.split(r"(?<=\.)\s", paragraph)[0])


def markdown(docstring: str) -> str:
    """A docstring in numpy's style as Markdown."""
    text, *sections = re.split(r"^(\w[\w ]*)\n-{3,}\n", docstring, flags=re.MULTILINE)
    parts = [prose(text)]
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        parts.append(f"**{title}**")
        parts.append(f"```pycon\n{body.strip()}\n```" if title == "Examples" else items(body))
    return "\n\n".join(part for part in parts if part)


def prose(text: str) -> str:
    """Paragraphs filled; those that are indented, formulas, as they stand."""
    paragraphs = text.strip("\n").split("\n\n")
    return "\n\n".join(each if each.startswith("    ") else fill(inline(each)) for each in paragraphs).strip()


def items(body: str) -> str:
    """``name : type`` with an indented description, as bullets."""
    bullets = []
    for found in re.finditer(r"^(\S.*)\n?((?:(?:[ ]{4}.*)?\n?)*?)(?=^\S|\Z)", body.strip("\n"), flags=re.MULTILINE):
        name, _, kind = found[1].partition(" : ")
        head = f"`{name}`" + (f": {inline(kind)}" if kind else "")
        bullets.append(bullet(head, inline(" ".join(found[2].split()))))
    return "\n".join(bullets)


def bullet(head: str, text: str) -> str:
    return fill(f"- {head}. {text}" if text else f"- {head}", "  ")


def inline(text: str) -> str:
    """Roles and literals of reStructuredText as code."""
    text = re.sub(r":\w+:`~?(?:meshlab_specsmooth\.)?([^`]+)`", r"`\1`", text)
    return text.replace("``", "`")


def fill(text: str, indent: str = "") -> str:
    flat = " ".join(text.split())
    return textwrap.fill(flat, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
