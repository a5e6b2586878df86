"""Add our filters to pymeshlab: by patching it, or by a subclass of MeshSet."""

from __future__ import annotations

import contextlib
import inspect
import re
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pymeshlab
from pymeshlab import PyMeshLabException

from meshlab_specsmooth.errors import SpecsmoothError, suggest
from meshlab_specsmooth.meshlab import descriptors, scripts
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.parameters import resolve

_lock = threading.Lock()
_undo: list[Callable[[], None]] = []


class MeshSet(pymeshlab.MeshSet):  # type: ignore[misc]  # pymeshlab has no types
    """A pymeshlab MeshSet with our filters as methods, without :func:`register`.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> ms = mss.MeshSet()
    >>> ms.create_sphere()
    >>> ms.apply_coord_spectral_smoothing(barycenter_weight=0.3)["barycenter_weight"]
    0.3
    """


def register() -> None:
    """Add our filters to pymeshlab itself, as if one of its plugins provided them.

    ``MeshSet`` gets one method for each filter; ``apply_filter``, ``filter_parameter_values``, ``load_filter_script``,
    ``apply_filter_script``, ``pymeshlab.filter_list``, ``search``, ``print_filter_list`` and
    ``print_filter_parameter_list`` include them. Calling it twice has no further effect; :func:`unregister` undoes it.
    All other behavior of pymeshlab is unchanged.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> mss.register()
    >>> "apply_coord_spectral_smoothing" in pymeshlab.filter_list()
    True
    >>> mss.unregister()
    >>> "apply_coord_spectral_smoothing" in pymeshlab.filter_list()
    False
    """
    with _lock:
        if _undo:
            return
        for target, functions in ((pymeshlab.MeshSet, _methods()), (pymeshlab, _module_functions())):
            for name, function in functions.items():
                _replace(target, name, function)


def unregister() -> None:
    """Remove our filters from pymeshlab; without a preceding :func:`register` this has no effect."""
    with _lock:
        while _undo:
            _undo.pop()()


def _replace(target: Any, name: str, function: Any) -> None:
    """Set an attribute, and note how to restore the previous object or its absence."""
    if name in vars(target):
        before = vars(target)[name]
        _undo.append(lambda: setattr(target, name, before))
    else:
        _undo.append(lambda: delattr(target, name))
    setattr(target, name, function)


def _methods() -> dict[str, Any]:
    """Return methods of a MeshSet that include our filters and otherwise call the current ones of pymeshlab."""
    native = {
        name: getattr(pymeshlab.MeshSet, name)
        for name in ("apply_filter", "filter_parameter_values", "load_filter_script", "apply_filter_script")
    }

    def apply_filter(self: Any, filter_name: str, **kwargs: Any) -> Any:
        if isinstance(filter_name, str) and filter_name in FILTERS:
            return FILTERS[filter_name](self, **kwargs)
        try:
            return native["apply_filter"](self, filter_name, **kwargs)
        except PyMeshLabException as error:
            is_unknown = isinstance(filter_name, str) and filter_name not in pymeshlab.filter_list()
            remedy = suggest(filter_name, FILTERS) if is_unknown else ""
            if not remedy:
                raise
            raise PyMeshLabException(f"{error}{remedy}") from error

    def filter_parameter_values(self: Any, filter_name: str, **kwargs: Any) -> Any:
        if isinstance(filter_name, str) and filter_name in FILTERS:
            return resolve(descriptors.load(filter_name), kwargs, self)
        return native["filter_parameter_values"](self, filter_name, **kwargs)

    def load_filter_script(self: Any, file_name: str) -> None:
        with _as_pymeshlab_errors():
            script = scripts.read(file_name)
            if scripts.has_ours(script):
                scripts.load(self, script)
                return
        native["load_filter_script"](self, file_name)

    def apply_filter_script(self: Any) -> None:
        with _as_pymeshlab_errors():
            script = scripts.script_of(self)
            scripts.check(script)
            if scripts.has_ours(script):
                scripts.run(self, script, FILTERS)
                return
        # called directly, as pymeshlab's own scripts keep all digits while they are in memory
        native["apply_filter_script"](self)

    methods = {f.__name__: f for f in (apply_filter, filter_parameter_values, load_filter_script, apply_filter_script)}
    return methods | {name: _method(name) for name in FILTERS}


def _method(name: str) -> Callable[..., Any]:
    """Return a method that calls one of our filters, as pymeshlab has one for each of its own."""

    def method(self: Any, **kwargs: Any) -> Any:
        return FILTERS[name](self, **kwargs)

    method.__name__ = method.__qualname__ = name
    method.__doc__ = FILTERS[name].__doc__
    _, *parameters = inspect.signature(FILTERS[name]).parameters.values()
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = inspect.Signature([own, *parameters])  # type: ignore[attr-defined]
    return method


for _name, _function in _methods().items():
    setattr(MeshSet, _name, _function)


def _module_functions() -> dict[str, Any]:
    """Return functions of the pymeshlab module that list filters, ours included."""
    native = {
        name: getattr(pymeshlab, name)
        for name in ("filter_list", "search", "print_filter_list", "print_filter_parameter_list")
    }

    def filter_list() -> list[str]:
        return sorted([*native["filter_list"](), *FILTERS])

    def search(keyword: str) -> None:
        native["search"](keyword)
        found = [descriptor for descriptor in map(descriptors.load, FILTERS) if _matches(descriptor, keyword)]
        width = max((len(descriptor.function) for descriptor in found), default=0)
        for descriptor in found:
            # in the format of pymeshlab's own function
            print(f"{descriptor.function:{width}} : help(meshlab_specsmooth.{descriptor.function})")  # noqa: T201

    def print_filter_list() -> None:
        native["print_filter_list"]()
        for name in FILTERS:
            print(f"\t{name}")  # noqa: T201

    def print_filter_parameter_list(filter_name: str) -> None:
        if not isinstance(filter_name, str) or filter_name not in FILTERS:
            native["print_filter_parameter_list"](filter_name)
            return
        print(f"{filter_name} filter - list of parameter names:")  # noqa: T201
        for parameter in descriptors.load(filter_name).parameters:
            print(f"\t{parameter.name} : {parameter.kind} = {parameter.shown_default}")  # noqa: T201

    return {f.__name__: f for f in (filter_list, search, print_filter_list, print_filter_parameter_list)}


def _matches(descriptor: descriptors.Descriptor, keyword: str) -> bool:
    """Whether all words of the keyword occur in the names, class or help of a filter, also across word boundaries."""
    text = f"{descriptor.function} {descriptor.name} {descriptor.category} {descriptor.help}".lower()
    joined = re.sub(r"[^a-z0-9]", "", text)
    words = re.findall(r"[a-z0-9]+", keyword.lower())
    return all(word in text or word in joined for word in words)


@contextlib.contextmanager
def _as_pymeshlab_errors() -> Iterator[None]:
    """Raise our errors as PyMeshLabException, as pymeshlab's own methods do."""
    try:
        yield
    except SpecsmoothError as error:
        raise PyMeshLabException(str(error)) from error
