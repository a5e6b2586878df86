"""The public functions of isotropic smoothing. Their types stand in ``api.pyi``, made by ``scripts/make_docs.py``."""

from __future__ import annotations

import time
from dataclasses import replace

from meshlab_specsmooth.adapters import accept_meshes
from meshlab_specsmooth.operators.assemble import as_operators
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import finish, subrange
from meshlab_specsmooth.smoothing import automatic
from meshlab_specsmooth.smoothing.calls import take_setting
from meshlab_specsmooth.smoothing.choice import Choice
from meshlab_specsmooth.smoothing.filter import enhance_by_setting, low_pass_by_setting
from meshlab_specsmooth.smoothing.labels import smooth_surfaces
from meshlab_specsmooth.smoothing.limit import limit_displacement
from meshlab_specsmooth.smoothing.settings import Enhancement, LowPass, Region, Smoothing

# Fraction of the time of a call that the operators take.
_ASSEMBLY = 0.25


@accept_meshes
@take_setting(Smoothing, Region, ("boundary", "mask", "features", "feature_gain", "max_displacement"))
def smooth(mesh, faces, setting, region, *, laplacian="uniform", weld=True, start=None, workspace=None, progress=None):
    """Smooth a surface with barycenter constraints: the paper's method.

    Step 1 takes the differential coordinates delta = L V (eq. 3-4), step 2 low-passes them, delta' = h(L) delta, and
    step 3 finds the surface that has them and keeps its face barycenters: the V' that minimizes
    ``|L V' - delta'|^2 + w^2 |C V' - C V|^2`` (eq. 5-6).

    Parameters
    ----------
    mesh : (n, 3) real array, a mesh of any kind, or Operators
        Vertices, in mesh units; or, without ``faces``, a mesh of pymeshlab (a MeshSet's current mesh), trimesh,
        PyVista, Open3D, meshio or vedo, a tuple of vertices and faces, the path of a file, or what
        :func:`meshlab_specsmooth.assemble` returned. Never changed; ``result.mesh`` is one of the same kind.
    faces : (m, 3) integer array, optional
        Never changed. Quads and polygons are split into triangles for the computation.
    setting : Smoothing, optional
        All parameters of the filter as a value, in place of the keywords up to ``mode_count``.
    {parameters}
    region : Region, optional
        ``boundary``, ``mask``, ``features``, ``feature_gain`` and ``max_displacement`` as a value, in place of these.
    laplacian : {"uniform", "cotangent"}
        Weights of the edges: all 1 (the paper, eq. 1), or by the cotangents of the opposite angles.
    weld : bool
        Whether vertices at one place move as one, as along texture seams and in triangle soups. Without, each copy is a
        vertex of its own, and the surface ends at its edges.
    start : SmoothingResult, optional
        An earlier result for this surface with a similar setting, as a slider has it: the least squares start from it,
        which saves iterations and changes the result only within their tolerance.
    workspace : Workspace, optional
        Work arrays of earlier calls for the same operators, used again.
    progress : callable, optional
        Called with the fraction done, rising to 1.

    Returns
    -------
    SmoothingResult
        ``vertices`` and the evidence.

    Raises
    ------
    InvalidSurface
        The arrays do not form a triangle mesh.
    InvalidParameter
        A parameter is out of range, or modes and wavelength are both given.
    NotConverged
        The least squares did not reach their tolerance.
    TooLarge
        The mesh would not fit in memory, or its eigenvectors would not, with ``method="exact"``.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> octahedron = np.vstack([np.eye(3), -np.eye(3)])
    >>> faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> result = mss.smooth(octahedron, faces, modes=4)
    >>> result.method, result.modes, np.allclose(result.vertices, octahedron)
    ('exact', 4, True)
    >>> setting = mss.Smoothing(low_pass=mss.Ideal(modes=4), barycenter_weight=1.0)
    >>> mss.smooth(octahedron, faces, setting).setting == setting
    True
    """
    began = time.perf_counter()
    progress = begin(progress, "assembling")
    ops = as_operators(mesh, faces, laplacian, weld=weld, progress=subrange(progress, 0.0, _ASSEMBLY))
    report = subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY)
    result = automatic.smooth_operators(ops, setting, region, start=start, workspace=workspace, progress=report)
    if setting.barycenter_weight is not None:
        result = automatic.warn_of_change(ops, result)
    result = limit_displacement(result, region, ops)
    finish(progress)
    return replace(result, source=ops.source, seconds=time.perf_counter() - began)


@accept_meshes
@take_setting(Smoothing, Region, ("boundary", "mask", "features", "feature_gain"))
def choose(mesh, faces, setting, region, *, laplacian="uniform", weld=True, progress=None):
    """Choose the setting of least estimated error, without the truth to compare with.

    The mesh is taken as one, without the steps that :func:`meshlab_specsmooth.smooth` takes around an automatic choice:
    stray vertices, impulses, parts of different scale or noise, and the shape held against the noise.

    Parameters
    ----------
    mesh, faces, setting, region, laplacian, weld, progress
        As for :func:`meshlab_specsmooth.smooth`, and so are the fields of setting and region as keywords.
    {parameters}

    Returns
    -------
    Choice
        ``setting``, the noise, and ``considered``: all settings that were evaluated, with their estimated errors.

    Raises
    ------
    InvalidSurface, InvalidParameter
        As for :func:`meshlab_specsmooth.smooth`; the barycenter weight must not be given.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    >>> at = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    >>> faces = np.concatenate([np.c_[at, at + 1, at + 41], np.c_[at, at + 41, at + 40]])
    >>> rough = np.c_[x, y, 0.2 * np.random.default_rng(0).standard_normal(1600)]
    >>> ops = mss.assemble(rough, faces)
    >>> choice = mss.choose(ops)
    >>> mss.smooth(ops, choice.setting).setting == choice.setting
    True
    """
    progress = begin(progress, "assembling")
    ops = as_operators(mesh, faces, laplacian, weld=weld, progress=subrange(progress, 0.0, _ASSEMBLY))
    choice = Choice.of(ops, setting, region, subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY))
    finish(progress)
    return choice


@accept_meshes
@take_setting(LowPass, Region, ("mask", "max_displacement"))
def low_pass(mesh, faces, setting, region, *, laplacian="uniform", weld=True, progress=None):
    """Low-pass the coordinates themselves, V' = h(L) V: plain spectral smoothing, which the paper compares with.

    It is the limit of :func:`meshlab_specsmooth.smooth` for a barycenter weight of 0 (up to a shift of open components,
    whose mean over edges differs from that over faces); it removes all detail below the wavelength, and shrinks.

    Parameters
    ----------
    mesh, faces
        As for :func:`meshlab_specsmooth.smooth`.
    setting : LowPass, optional
        All parameters of the filter as a value, in place of the keywords up to ``mode_count``.
    {parameters}
    region, laplacian, weld, progress
        As for :func:`meshlab_specsmooth.smooth`; so are returns and errors.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> triangle = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
    >>> mss.low_pass(triangle, [[0, 1, 2]], modes=1).vertices.round(12)  # the constant mode: the center
    array([[1., 1., 0.],
           [1., 1., 0.],
           [1., 1., 0.]])
    """
    began = time.perf_counter()
    progress = begin(progress, "assembling")
    ops = as_operators(mesh, faces, laplacian, weld=weld, progress=subrange(progress, 0.0, _ASSEMBLY))
    result = low_pass_by_setting(ops, setting, region, progress=subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY))
    result = limit_displacement(result, region, ops)
    finish(progress)
    return replace(result, source=ops.source, seconds=time.perf_counter() - began)


@accept_meshes
@take_setting(Smoothing, Region, ("max_displacement",))
def smooth_labels(mesh, faces, setting, region, *, labels=None, laplacian="uniform", progress=None):
    """Smooth the surfaces of several labels at once: tissues, grains, materials.

    The surfaces are one mesh with labels of its faces, or several meshes whose vertices coincide where they touch.
    Vertices at one place move as one, so that neither gaps nor overlaps appear. Where more than two surfaces meet, or
    the labels change, runs a border: it is smoothed along itself, as a boundary is with ``boundary="curve"``, and the
    surfaces between borders are smoothed as by :func:`meshlab_specsmooth.smooth`. An open boundary stays.

    Parameters
    ----------
    mesh : (n, 3) real array, a mesh of any kind, or a list of meshes
        See :func:`meshlab_specsmooth.smooth`. The meshes of a list have the labels 0, 1, ...
    faces : (m, 3) integer array, optional
    setting : Smoothing, optional
        All parameters of the filter as a value, in place of the keywords up to ``mode_count``.
    {parameters}
    region : Region, optional
        ``max_displacement`` as a value.
    labels : (m,) or (m, 2) integer array, or str
        One label of each face; a face between two bodies is there twice then, once for either. Or two labels of each
        face: of the body behind it, against its normal, and of that in front of it, 0 for none. Or the name of a face
        property: of a PLY file (extra ``labels``), of ``cell_data`` or ``face_attributes`` of a mesh object, or of a
        custom attribute of pymeshlab. Needed unless the mesh is a list.
    laplacian, progress
        As for :func:`meshlab_specsmooth.smooth`; so are the errors.

    Returns
    -------
    LabelResult
        ``mesh`` or ``meshes``, the volumes of all labels, and the number of vertices that are shared.

    Examples
    --------
    Two boxes of voxels that touch, as quads between voxels of different labels:

    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> from meshlab_specsmooth.adapters.polygons import triangulate
    >>> voxels = np.zeros((12, 12, 22), dtype=int)
    >>> voxels[1:-1, 1:-1, 1:11], voxels[1:-1, 1:-1, 11:-1] = 1, 2
    >>> corners, pairs = [], []
    >>> for axis, square in enumerate(([1, 2], [2, 0], [0, 1])):
    ...     back, front = np.delete(voxels, -1, axis), np.delete(voxels, 0, axis)
    ...     at = np.argwhere(back != front) + np.eye(3, dtype=int)[axis]
    ...     u, v = np.eye(3, dtype=int)[square]
    ...     corners.append(np.stack([at, at + u, at + u + v, at + v], axis=1))
    ...     pairs.append(np.stack([back[back != front], front[back != front]], axis=1))
    >>> V, quads = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    >>> result = mss.smooth_labels(V, quads.reshape(-1, 4), labels=np.concatenate(pairs), barycenter_weight=0.3)
    >>> [(each.label, round(each.before, 6)) for each in result.labels], result.shared == result.still_shared
    ([(1, 1000.0), (2, 1000.0)], True)
    """
    return smooth_surfaces(mesh, faces, setting, region, labels, laplacian, progress)


@accept_meshes
@take_setting(Enhancement, Region, ("boundary", "mask", "features", "max_displacement"))
def enhance(mesh, faces, setting, region, *, laplacian="uniform", weld=True, workspace=None, progress=None):
    """Amplify a band of the surface's detail by the same three steps: delta' = delta + (gain - 1) band(L) delta.

    Parameters
    ----------
    mesh, faces
        As for :func:`meshlab_specsmooth.smooth`.
    setting : Enhancement, optional
        All parameters of the filter as a value, in place of the keywords up to ``method``.
    {parameters}
    region, laplacian, weld, workspace, progress
        As for :func:`meshlab_specsmooth.smooth`; so are returns and errors. The result's cut-off is that of the
        shortest wave.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> octahedron = np.vstack([np.eye(3), -np.eye(3)])
    >>> faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> np.allclose(mss.enhance(octahedron, faces, gain=1).vertices, octahedron)
    True
    """
    began = time.perf_counter()
    progress = begin(progress, "assembling")
    ops = as_operators(mesh, faces, laplacian, weld=weld, progress=subrange(progress, 0.0, _ASSEMBLY))
    report = subrange(progress, _ASSEMBLY, 1 - _ASSEMBLY)
    result = enhance_by_setting(ops, setting, region, workspace=workspace, progress=report)
    result = limit_displacement(result, region, ops)
    finish(progress)
    return replace(result, source=ops.source, seconds=time.perf_counter() - began)
