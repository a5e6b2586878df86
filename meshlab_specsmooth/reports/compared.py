"""The public function that compares filters on a mesh."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace

import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, accept_meshes, recognize
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.experiment import experiment
from meshlab_specsmooth.comparison.filter_specs import FilterSpec
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.parameters import MAX_SEED, check_count, check_path, show
from meshlab_specsmooth.reports import export
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import Progress, subrange

# Fraction of the run time that writing takes
_WRITING = 0.15


@accept_meshes
def compare(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    ground_truth: Mesh | None = None,
    noise: float | None = None,
    seed: int = 1,
    filters: Iterable[str | FilterSpec] | None = None,
    out: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    name: str | None = None,
) -> Comparison:
    """Compare MeshLab's smoothing filters and this package's on a mesh by their distance from the true surface.

    The error of each filter is estimated without a ground truth (:func:`meshlab_specsmooth.estimate_error`), with its
    uncertainty, and each filter is swept over its strength parameter. Filters run in a process of their own, so that
    one that crashes or diverges is reported in its row. On meshes with more than 60 000 vertices strengths are swept on
    a part of the mesh.

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`. Of a MeshSet the whole current mesh is used; nothing is changed.
    ground_truth : mesh of any kind, optional
        The true surface, with the same vertices and faces in the same order, or any other mesh of it. With another
        mesh, measures that need corresponding vertices are left out.
    noise : float, optional
        Standard deviation of white noise to add to every coordinate, in mean edges; the mesh is then the truth.
    seed : int
        Seed of the added noise.
    filters : iterable of str or FilterSpec, optional
        Short names (``"laplacian"``, ``"taubin"``, ``"edge-aware"``, ...), names of filters, or calls such as
        ``"apply_coord_taubin_smoothing(stepsmoothnum=20)"``. By default all short names but the slowest.
    out : path, optional
        Folder for ``comparison.html`` (needs the extra ``report``), ``comparison.mlp`` (a MeshLab project with one
        layer for each result), ``comparison.json`` and ``comparison.txt``.
    progress : callable, optional
        Called with the fraction done, increasing to 1; an exception that it raises ends the call.
    name : str, optional
        Name of the mesh for the page; by default the label of a MeshSet's current mesh.

    Returns
    -------
    Comparison

    Raises
    ------
    InvalidSurface
        The mesh has no faces, or the arrays do not form a triangle mesh.
    InvalidParameter
        Both a ground truth and noise are given, the noise is negative, or a filter is not known.
    MissingExtra
        ``out`` is given but the extra ``report`` is not installed; this is raised before any filter runs.
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
        export.check_extra()
        export.check_folder(check_path("out", out))
    source = recognize(mesh, faces)
    found = experiment(
        source.surface(),
        truth=None if ground_truth is None else recognize(ground_truth, name="ground_truth").surface(),
        added=noise,
        seed=seed,
        filters=filters,
        name=name or _label(source.given),
        progress=subrange(progress, 0.0, 1.0 if out is None else 1.0 - _WRITING),
    )
    found = with_colors(found, source.given)
    if out is not None:
        export.write(found, out)
    if progress is not None:
        progress(1.0)
    return found


def with_colors(found: Comparison, mesh: Mesh) -> Comparison:
    """Return the comparison with the colors of a MeshSet's current mesh; other meshes have none."""
    if not hasattr(mesh, "current_mesh"):
        return found
    current = mesh.current_mesh()
    return replace(
        found,
        vertex_colors=_varying(current.vertex_color_matrix()) if current.has_vertex_color() else None,
        face_colors=_varying(current.face_color_matrix()) if current.has_face_color() else None,
    )


def _varying(colors: Floats) -> Floats | None:
    """Colors without opacity; None if all are the same, as pymeshlab has it for a mesh without colors."""
    return colors[:, :3] if len(colors) and (colors != colors[0]).any() else None


def _label(mesh: Mesh) -> str:
    label = mesh.current_mesh().label() if hasattr(mesh, "current_mesh") else ""
    return str(label) or "mesh"
