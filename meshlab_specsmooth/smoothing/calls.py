"""Functions that take a setting, or its fields as keywords: signatures and documentation are made from the settings."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any, TypeVar

from meshlab_specsmooth.errors import InvalidParameter, suggest
from meshlab_specsmooth.operators.assemble import Operators
from meshlab_specsmooth.smoothing.settings import Region, Setting
from meshlab_specsmooth.spectral.low_pass import CutoffResponse

F = TypeVar("F", bound=Callable[..., Any])

# Types of the keywords that stand for a low-pass, by their defaults.
_ANNOTATIONS = {
    ("modes", None): "int | None",
    ("wavelength", None): "float | None",
    ("response", "auto"): "AnyResponseName | CutoffResponse | Response | Family",
    ("response", "ideal"): "ResponseName | CutoffResponse | Response | Family",
}

# Keywords that only say how operators are assembled.
_OF_ASSEMBLY = ("laplacian", "weld")


def take_setting(
    kind: type[Setting], region: type[Region], region_fields: Iterable[str]
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a function of (mesh, faces, setting, region, keywords) so that it takes the fields as keywords too.

    The decorated function is called as ``f(mesh, faces, field=...)``, ``f(mesh, faces, setting)`` or, for operators and
    meshes with faces of their own, ``f(mesh, setting)``. ``{parameters}`` in its docstring is replaced by the
    documentation of the fields.

    Parameters
    ----------
    kind, region : type
        Classes of the setting and of the region.
    region_fields : iterable of str
        Fields of the region that the function uses.
    """
    of_setting = get_parameters(kind)
    of_region = {name: each for name, each in get_parameters(region).items() if name in region_fields}

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        own = inspect.signature(function).parameters
        rest = {name: each for name, each in own.items() if each.kind is inspect.Parameter.KEYWORD_ONLY}
        known = {*of_setting, *of_region, *rest}

        @functools.wraps(function)
        def call(mesh: Any, faces: Any = None, setting: Any = None, *, region: Any = None, **given: Any) -> Any:
            for name in given:
                if name not in known:
                    raise TypeError(f"{function.__name__}() has no parameter {name}.{suggest(name, [*known])}")
            if isinstance(faces, Setting):
                faces, setting = None, faces
            if isinstance(mesh, Operators):
                _check_operators(faces, given)
            made = _make("setting", kind, setting, {name: given.pop(name) for name in of_setting if name in given})
            where = _make("region", region_type, region, {name: given.pop(name) for name in of_region if name in given})
            return function(mesh, faces, made, where, **given)

        region_type = region
        positional = [
            inspect.Parameter("mesh", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation="Mesh"),
            inspect.Parameter(
                "faces", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=None, annotation="npt.ArrayLike | None"
            ),
            inspect.Parameter(
                "setting", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=None, annotation=f"{kind.__name__} | None"
            ),
        ]
        whole = inspect.Parameter(
            "region", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=f"{region.__name__} | None"
        )
        parameters = [*positional, *of_setting.values(), *of_region.values(), whole, *rest.values()]
        signature = inspect.signature(function).replace(parameters=parameters)
        call.__signature__ = signature  # type: ignore[attr-defined]
        documented = get_documentation(kind) | get_documentation(region)
        listed = "\n".join(dict.fromkeys(documented[name] for name in (*of_setting, *of_region)))
        call.__doc__ = (function.__doc__ or "").replace("    {parameters}", listed)
        return call

    return decorate


def get_parameters(kind: type[Setting]) -> dict[str, inspect.Parameter]:
    """The keywords of a call for a setting: its fields, or what stands for them."""
    found = {}
    for each in fields(kind):
        for name, default in kind.replaced.get(each.name, {each.name: each.default}).items():
            annotation = _ANNOTATIONS[name, default] if each.name in kind.replaced else str(each.type)
            found[name] = inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
            )
    return found


def get_documentation(kind: type) -> dict[str, str]:
    """The entries of the sections of parameters in the docstring of a class, indented for a function."""
    entries: dict[str, str] = {}
    for source in (*kind.__mro__[::-1], CutoffResponse):
        text = inspect.cleandoc(source.__dict__.get("__doc__") or "")
        for section in re.findall(r"(?:^|\n)(?:Other )?Parameters\n-+\n(.*?)(?=\n\n\S|\Z)", text, re.DOTALL):
            for entry in re.split(r"\n(?=\S)", section):
                names = entry.partition("\n")[0].partition(" :")[0]
                block = "\n".join(f"    {line}".rstrip() for line in entry.split("\n"))
                for name in names.split(", "):
                    if source is not CutoffResponse or name in ("modes", "wavelength"):
                        entries[name] = block
    return entries


def _make(name: str, kind: type[Setting], given: Any, keywords: dict[str, Any]) -> Setting:
    if given is None:
        return kind.of(**keywords)
    if not isinstance(given, kind):
        raise InvalidParameter(f"{name} is of type {type(given).__name__}; it must be {kind.__name__}(...)")
    if keywords:
        raise InvalidParameter(f"{next(iter(keywords))} is given beside a {name} that has it; give one of them")
    return given


def _check_operators(faces: Any, given: dict[str, Any]) -> None:
    if faces is not None:
        raise InvalidParameter("faces are given beside operators, which have their own")
    for name in _OF_ASSEMBLY:
        if name in given:
            raise InvalidParameter(f"{name} is given beside operators, which were assembled with one")
