"""Random calls for fuzz.py, each determined by the seed and its number."""

import pathlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pymeshlab
from fuzz_meshes import Odd, Rng, contained, hostile_faces, hostile_vertices, mesh_of
from fuzz_parameters import (
    ALL,
    EDGE_AWARE,
    ENHANCE,
    ERROR,
    FILTERS,
    LOW_PASS,
    PROGRESS,
    SMOOTH,
    WEIGHT,
    choice,
    parameters,
    wrong,
)

import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import descriptors, filters

TYPED = (mss.SpecsmoothError, pymeshlab.PyMeshLabException, pymeshlab.InvalidEnumException)
MESHSETS = 0.12  # fraction of the calls


class Call(NamedTuple):
    """A call: a description, and the function to run."""

    text: str
    run: Callable[[], object]


class ChangedError(Exception):
    """Data that must not change has changed."""


def make_call(seed: int, number: int) -> Call:
    """Make the call with a number."""
    rng = np.random.default_rng([seed, number])
    if rng.random() < MESHSETS:
        return call_on_meshset(rng)
    if rng.random() < 0.02:
        return call_with_invalid_parameter(rng)
    return call_on_arrays(rng)


def _text(name: str, V: Any, F: Any, given: dict[str, Any]) -> str:
    def shown(value: Any) -> str:
        try:
            text = (
                f"{type(value).__name__} {np.array2string(value, threshold=200)}"
                if isinstance(value, np.ndarray)
                else repr(value)
            )
        except Exception:
            return f"<{type(value).__name__}>"
        return " ".join(text.split())[:1500]

    words = [shown(V), shown(F), *(f"{key}={shown(value)}" for key, value in given.items())]
    return f"{name}({', '.join(words)})"


def call_on_arrays(rng: Rng) -> Call:
    """Make a call of a function on arrays."""
    V, F = mesh_of(rng)
    n = len(V)
    vertices, faces = contained(V, F, rng)
    if rng.random() < 0.06:
        vertices = hostile_vertices(V, rng)
    elif rng.random() < 0.06:
        faces = hostile_faces(F, n, rng)
    name, known = FUNCTIONS[rng.integers(len(FUNCTIONS))]
    given = parameters(known, n, rng)
    positional: list[Any] = [vertices, faces]
    if name == "estimate_error":
        positional.insert(0, wrong(rng) if rng.random() < 0.1 else FILTERS(rng))
    if name == "smooth" and "barycenter_weight" not in given and rng.random() < 0.5:
        given["barycenter_weight"] = WEIGHT(rng)  # faster than choosing the weight
    before = _bytes(vertices), _bytes(faces)

    def run() -> object:
        try:
            if name.startswith("operators."):
                own = {key: value for key, value in given.items() if key != "laplacian"}
                ops = mss.assemble(*positional, **{k: given[k] for k in given if k == "laplacian"})
                function = getattr(mss, name.partition(".")[2])
                first = function(ops, **own)
                if name == "operators.smooth":
                    return [first, function(ops, **own, start=first)]
                return first
            return getattr(mss, name)(*positional, **given)
        finally:
            if before != (_bytes(vertices), _bytes(faces)):
                raise ChangedError("the input was changed")

    return Call(_text(name, vertices, faces, given), run)


FUNCTIONS: list[tuple[str, dict[str, Callable[[Rng], Any]]]] = [
    *[("smooth", ALL | SMOOTH)] * 4,
    *[("operators.smooth", ALL | SMOOTH)] * 2,
    *[("low_pass", ALL | LOW_PASS)] * 2,
    ("operators.low_pass", ALL | LOW_PASS),
    *[("enhance", ALL | ENHANCE)] * 2,
    ("operators.enhance", ALL | ENHANCE),
    *[("smooth_edge_aware", EDGE_AWARE)] * 3,
    ("denoise", {"spacing": SMOOTH["spacing"], "progress": PROGRESS}),
    ("estimate_noise", {}),
    *[("estimate_error", ERROR)] * 2,
    ("spectrum", ALL | {"bands": choice(2, 3, 64)}),
    ("self_intersecting_faces", {}),
    ("assemble", ALL),
    ("Surface", {}),
]


def _bytes(array: Any) -> bytes | None:
    return array.tobytes() if type(array) is np.ndarray and array.dtype != object else None


def call_on_meshset(rng: Rng) -> Call:
    """Make a call of a filter on a MeshSet, in one of the possible ways."""
    V, F = mesh_of(rng)
    V, F = np.array(V, dtype=np.float64), np.array(F, dtype=np.int32)
    name = list(filters.FILTERS)[rng.integers(len(filters.FILTERS))]
    given = {}
    for parameter in descriptors.load(name).parameters:
        if rng.random() < 0.25:
            given[parameter.name] = wrong(rng) if rng.random() < 0.3 else _value(parameter, rng)
    if rng.random() < 0.03:
        given["unknown"] = 1
    if rng.random() < 0.05:
        given["progress"] = wrong(rng, "progress")
    how = int(rng.integers(0, 12))
    marks = rng.random(len(V)) < 0.5 if rng.random() < 0.3 else None
    quality = rng.random(len(V)) if rng.random() < 0.3 else None

    def run() -> object:
        ms = mss.MeshSet()
        if how != 0:
            more = {} if quality is None else {"v_scalar_array": quality}
            ms.add_mesh(pymeshlab.Mesh(V, F if how != 1 else np.empty((0, 3), dtype=np.int32), **more))
        if marks is not None and how > 1:
            ms.set_selection_all()
        if how == 2:
            return getattr(mss, name)(wrong(np.random.default_rng(len(V))), **given)
        before = _state(ms)
        try:
            if how == 3:
                result = ms.apply_filter(name, **given)
            elif how == 4:
                result = ms.filter_parameter_values(name, **given)
            elif how == 5:
                result = getattr(ms, name)(**given)
            else:
                result = getattr(mss, name)(ms, **given)
        except TYPED as error:
            if not _same(before, _state(ms)):
                raise ChangedError(
                    f"the MeshSet was changed by a call that ended with {type(error).__name__}"
                ) from error
            raise
        after = _state(ms)
        if not np.array_equal(before["faces"], after["faces"]) or before["number"] != after["number"]:
            raise ChangedError("more than the vertices of the MeshSet was changed")
        return [result, after["vertices"], after["quality"]]

    words = {0: "empty", 1: "no faces", 2: "not a MeshSet", 3: "apply_filter", 4: "filter_parameter_values"}
    note = f"{words.get(how, 'direct')}, {'all' if marks is not None else 'nothing'} selected"
    return Call(f"MeshSet ({note}): {_text(name, V, F, given)}", run)


def _value(parameter: descriptors.Parameter, rng: Rng) -> Any:
    """Choose a valid value of a parameter, or an extreme one."""
    if parameter.type == "enum":
        return parameter.values[rng.integers(len(parameter.values))]
    if parameter.type == "bool":
        return bool(rng.integers(2))
    if parameter.type == "int":
        return int(rng.integers(max(parameter.minimum, 0), min(parameter.maximum, 5) + 1))
    if parameter.type == "length" and rng.random() < 0.5:
        if rng.random() < 0.5:
            return pymeshlab.PercentageValue(choice(0.0, 1e-30, 1.0, 10.0, 100.0)(rng))
        return pymeshlab.PureValue(choice(0.0, 1.0, 1e300, 1e-300, -1.0, float("nan"), float("inf"))(rng))
    return float(rng.choice([parameter.minimum, 0.01, 0.1, 1.0, 2.0, min(parameter.maximum, 1e300)]))


def _state(ms: pymeshlab.MeshSet) -> dict[str, Any]:
    if ms.mesh_number() == 0:
        return {"number": 0, "vertices": np.empty(0), "faces": np.empty(0), "quality": None}
    mesh = ms.current_mesh()
    return {
        "number": ms.mesh_number(),
        "current": ms.current_mesh_id(),
        "vertices": mesh.vertex_matrix(),
        "faces": mesh.face_matrix(),
        "selected vertices": mesh.vertex_selection_array(),
        "selected faces": mesh.face_selection_array(),
        "quality": mesh.vertex_scalar_array() if mesh.has_vertex_scalar() else None,
    }


def _same(before: dict[str, Any], after: dict[str, Any]) -> bool:
    return all(np.array_equal(before[name], after[name]) for name in before)


def call_with_invalid_parameter(rng: Rng) -> Call:
    """Make a call of a function that starts processes or writes files, with one invalid parameter."""
    bad = (None, 3.5, 10**400, b"x", 1j, float("nan"), object(), Odd(), np.ones(3), -1, {}, "a\0b", -(10**5000))
    value = bad[rng.integers(len(bad))]
    mesh = (np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    which = int(rng.integers(3))
    if which == 0:
        names = ["mesh", "seed", "ground_truth", "noise", "filters", "out", "progress", "name"]
        name = names[rng.integers(len(names))]
        optional = {"ground_truth", "noise", "filters", "out", "progress", "name"}
        if (value is None and name in optional) or (name == "noise" and value is bad[1]) or isinstance(value, str):
            value = Odd()
        given: dict[str, Any] = {"mesh": mesh, name: value}
        return Call(_text("compare", mesh, None, given), lambda: mss.compare(given.pop("mesh"), **given))
    if which == 1:
        names = ["paths", "out", "filter_name", "scheduler", "workers", "time_limit", "resume", "ending", "pictures"]
        names += ["progress", "each", "iterations", "barycenter_weight", "unknown"]
        name = names[rng.integers(len(names))]
        if value is None or (name == "time_limit" and isinstance(value, int | float)) or isinstance(value, str):
            value = Odd()
        if name == "barycenter_weight" and value is bad[1]:
            value = -1
        given = {"paths": "nothing.ply", "out": pathlib.Path("/proc/nowhere"), name: value}
        return Call(
            _text("batch", "nothing.ply", None, given), lambda: mss.batch(given.pop("paths"), given.pop("out"), **given)
        )
    fields = ["name", "filter", "parameters", "times", "strength", "holds", "notes", "key"]
    given = {"name": "a", "filter": "apply_coord_taubin_smoothing", fields[rng.integers(len(fields))]: value}
    return Call(_text("FilterSpec", None, None, given), lambda: mss.FilterSpec(**given).call)
