"""Inputs of the filters that are taken from the MeshSet: selections, features, creases."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pymeshlab

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.meshlab.creases import selected_edges
from meshlab_specsmooth.smoothing.region import ALL_KEPT, NOTHING_SELECTED


def keyword_arguments(ms: pymeshlab.MeshSet, values: dict[str, Any], *optional: str) -> dict[str, Any]:
    """Convert the values of a filter to keyword arguments of its function on arrays.

    Every parameter of a filter has a value; for those listed as ``optional``, zero means that it is not given.
    """
    given = {name: value for name, value in values.items() if name not in optional or value != 0}
    across, slices = given.pop("spacing", 0), given.pop("slice_spacing", 0)
    if across or slices:
        if not across:
            raise InvalidParameter(f"slice_spacing is {slices:g} without a spacing; give both")
        given["spacing"] = (across, across, slices or across)
    if given.pop("selected", False):
        given["mask"] = _selected(ms, "vertex_selection") | _selected(ms, "face_selection")
    if "features" in given:
        given["features"] = features_of(ms, given["features"])
    return given


def creases_of(ms: pymeshlab.MeshSet, source: str, angle: float) -> Integers | float | None:
    """Return vertex pairs, an angle in degrees, or None if neither is given."""
    if source == "none":
        return angle or None
    if angle:
        raise InvalidParameter(f"creases is {source!r} and crease_angle {angle:g}; give one of them")
    pairs = selected_edges(ms)
    if len(pairs) == 0:
        raise InvalidParameter(f"creases is {source!r}, but no edge is selected")
    return pairs


def features_of(ms: pymeshlab.MeshSet, source: str) -> Floats | None:
    """Return the feature weights of the vertices, (n,) float64, or None."""
    if source == "none":
        return None
    mesh = ms.current_mesh()
    if source == "vertex_quality":
        if not mesh.has_vertex_scalar():
            raise InvalidParameter("features is 'vertex_quality', but the current mesh has no vertex quality")
        return np.asarray(mesh.vertex_scalar_array(), dtype=np.float64)
    marked = _selected(ms, source)
    if not marked.any():
        raise InvalidParameter(f"features is {source!r}, but nothing is selected")
    return marked.astype(np.float64)


def _selected(ms: pymeshlab.MeshSet, what: str) -> npt.NDArray[np.bool_]:
    """Return a mask of the selected vertices, or of the vertices of selected faces."""
    mesh = ms.current_mesh()
    if what == "vertex_selection":
        return np.asarray(mesh.vertex_selection_array(), dtype=np.bool_)
    mask = np.zeros(mesh.vertex_number(), dtype=np.bool_)
    mask[mesh.face_matrix()[np.asarray(mesh.face_selection_array(), dtype=np.bool_)]] = True
    return mask


def describe_restriction(ms: pymeshlab.MeshSet, values: dict[str, Any], is_default: bool) -> str | None:
    """Return a warning if a selection restricts the filter by default, or leaves nothing to move."""
    mesh = ms.current_mesh()
    if values.get("selected"):
        counts = {
            "faces": (mesh.selected_face_number(), mesh.face_number()),
            "vertices": (mesh.selected_vertex_number(), mesh.vertex_number()),
        }
        if not any(selected for selected, _ in counts.values()):
            return NOTHING_SELECTED
        if is_default and all(selected < total for selected, total in counts.values()):
            listed = [f"{k:,} of {n:,} {name}".replace(",", " ") for name, (k, n) in counts.items() if k]
            return f"{' and '.join(listed)} are selected: only these are smoothed; selected=False for all"
    if values.get("feature_gain"):
        features = features_of(ms, values["features"])
        if features is not None and (features == 1).all():
            if values["feature_gain"] == 1:
                return ALL_KEPT
            return "all vertices are features, so the feature gain applies to the whole mesh"
    return None
