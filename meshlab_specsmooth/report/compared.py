"""Filters side by side, in one call."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace

import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, accept_meshes, recognize
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.competitors import Competitor
from meshlab_specsmooth.comparison.experiment import experiment
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.surface import Surface
from meshlab_specsmooth.parameters import MAX_SEED, check_count, check_path, show
from meshlab_specsmooth.report import page
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import Progress, subrange

# The share of the time that the page takes
_PAGE = 0.15


@accept_meshes
def compare(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    ground_truth: Mesh | None = None,
    noise: float | None = None,
    seed: int = 1,
    filters: Iterable[str | Competitor] | None = None,
    out: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    name: str | None = None,
) -> Comparison:
    """Run MeshLab's smoothing filters and ours on a mesh, and say which comes closest to the true surface.

    The error of each is estimated without the truth (:func:`meshlab_specsmooth.estimate_error`), with its uncertainty;
    and each is swept over its own strength. Filters run in a process of their own: one that crashes or diverges is a
    row that says so. Of meshes of more than 60 000 vertices, strengths are swept on a part.

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`. Of a MeshSet the current mesh, all of it; nothing is changed.
    ground_truth : mesh of any kind, optional
        The true surface, in the same order of vertices and faces, or any mesh of it: then what needs vertices that
        correspond is left out.
    noise : float, optional
        Standard deviation of white noise to add on every coordinate, in mean edges; the mesh is then the truth.
    seed : int
        Of that noise.
    filters : iterable of str or Competitor, optional
        Short names (``"laplacian"``, ``"taubin"``, ``"edge-aware"``, ...), names of filters, or calls such as
        ``"apply_coord_taubin_smoothing(stepsmoothnum=20)"``. By default all short names, ``"denoise"`` first, but the
        slow ones.
    out : path, optional
        A folder for ``comparison.html`` (the extra ``report``), ``comparison.mlp``, a MeshLab project with a layer a
        result, ``comparison.json`` and ``comparison.txt``.
    progress : callable, optional
        Called with the fraction done, rising to 1; what it raises ends the call.
    name : str, optional
        Of the mesh, for the page; a MeshSet's is its label.

    Returns
    -------
    Comparison
        Which a notebook shows as a table.

    Raises
    ------
    InvalidSurface
        The mesh has no faces, or is none.
    InvalidParameter
        Both a ground truth and noise, noise below 0, or filters that are no names.
    MissingExtra
        ``out`` without the extra ``report``; nothing has been run by then.
    FileError
        ``out`` cannot be written.

    Examples
    --------
    >>> import pymeshlab
    >>> import meshlab_specsmooth as mss
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_sphere(subdiv=4)
    >>> found = mss.compare(ms, noise=0.2, filters=["laplacian", "automatic"])
    >>> found.headline()
    'Take specsmooth automatic; the truth agrees'
    """
    progress = begin(progress, "comparing")
    seed = check_count("seed", seed, 0, MAX_SEED)
    if name is not None and not isinstance(name, str):
        raise InvalidParameter(f"name is {show(name)}; it must be a string")
    if out is not None:
        page.check_extra()
        page.check_folder(check_path("out", out))
    source = recognize(mesh, faces)
    found = experiment(
        source.surface(),
        truth=None if ground_truth is None else surface_of(ground_truth, "ground_truth"),
        added=noise,
        seed=seed,
        filters=filters,
        name=name or _label(source.given),
        progress=subrange(progress, 0.0, 1.0 if out is None else 1.0 - _PAGE),
    )
    found = with_colors(found, source.given)
    if out is not None:
        page.write(found, out)
    if progress is not None:
        progress(1.0)
    return found


def surface_of(mesh: Mesh, name: str = "mesh") -> Surface:
    """The surface of a mesh of any kind."""
    return recognize(mesh, name=name).surface()


def with_colors(found: Comparison, mesh: Mesh) -> Comparison:
    """The comparison with the colors of a MeshSet's current mesh; arrays have none."""
    if not hasattr(mesh, "current_mesh"):
        return found
    current = mesh.current_mesh()
    return replace(
        found,
        vertex_colors=_several(current.vertex_color_matrix()) if current.has_vertex_color() else None,
        face_colors=_several(current.face_color_matrix()) if current.has_face_color() else None,
    )


def _several(colors: Floats) -> Floats | None:
    """Colors without their opacity; None where all are one: so pymeshlab colors a mesh that has none."""
    return colors[:, :3] if len(colors) and (colors != colors[0]).any() else None


def _label(mesh: Mesh) -> str:
    label = mesh.current_mesh().label() if hasattr(mesh, "current_mesh") else ""
    return str(label) or "mesh"
