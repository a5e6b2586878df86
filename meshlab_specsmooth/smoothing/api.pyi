"""Types of ``meshlab_specsmooth.smoothing.api``, made from the settings by ``python3 scripts/make_docs.py``."""

import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.choices import AnyResponseName, Boundary, LaplacianKind, Method, ModeCount, ResponseName
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.runtime.workspace import Workspace
from meshlab_specsmooth.smoothing.choice import Choice
from meshlab_specsmooth.smoothing.labels import LabelResult
from meshlab_specsmooth.smoothing.result import SmoothingResult
from meshlab_specsmooth.smoothing.settings import Enhancement, LowPass, Region, Smoothing
from meshlab_specsmooth.spectral.low_pass import CutoffResponse
from meshlab_specsmooth.spectral.response import Family, Response

def smooth(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: Smoothing | None = None,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    response: AnyResponseName | CutoffResponse | Response | Family = "auto",
    barycenter_weight: float | Floats | None = None,
    spacing: float | tuple[float, float, float] | None = None,
    iterations: int = 1,
    method: Method = "auto",
    mode_count: ModeCount = "estimate",
    tolerance: float = 0.003,
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = 1.0,
    max_displacement: float | str | None = None,
    region: Region | None = None,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    start: SmoothingResult | None = None,
    workspace: Workspace | None = None,
    progress: Progress | None = None,
) -> SmoothingResult:
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
    modes : int, optional
        Number of modes kept, lowest first (the paper's f_a).
    wavelength : float, optional
        Shortest surface wave kept, in mesh units. Without this and ``modes``: 20 mean edge lengths.
    response : {"auto", "ideal", "butterworth", "gaussian", "heat"}, Response, or callable
        Shape of the low-pass: a name, a function from a cut-off eigenvalue to a
        :class:`meshlab_specsmooth.Response`, or a response with a cut-off of its own. ``"auto"`` is ideal where
        ``modes`` or ``wavelength`` is given, as in the paper. Otherwise it is heat, or, where the weight is chosen on a
        mesh of at most 100 000 vertices, heat or ideal by estimated error.
    barycenter_weight : float or (n,) array, optional
        w from 1.5e-8 to 6.7e7, dimensionless: how firmly the barycenters are held. It is the strength of the filter,
        more than the cut-off is: 1 is the paper, 0.3 suits noise of 0.2 edge lengths. An array holds the weight at each
        vertex, for noise that differs over the surface. If not given, the noise is estimated
        (:func:`meshlab_specsmooth.estimate_noise`), impulses are clipped, and the weight of least estimated error is
        used; ``result.noise`` is the estimate. Single stray vertices are put back first. Components of different scale
        or noise are smoothed one by one. Where noise and shape cannot be separated, nothing is moved, and where the
        shape would change by more than the noise explains, a weaker result or the input is returned; ``result.warning``
        says so.
    spacing : float or (3,) floats, optional
        Sides of the voxels, in mesh units and along x, y and z, where the surface was made from a binary mask: the
        weight is then the smallest with which nearly all vertices stay within about half a voxel of where they were.
        Recognized if not given, where the mesh is unchanged but for its position, orientation and scale.
    iterations : int
        How often the three steps are applied, each time to the last result; at most 1000.
    method : {"auto", "exact", "chebyshev"}
        How h(L) is applied: with eigenvectors, or with a polynomial; ``"auto"`` is exact up to 1000 vertices.
    mode_count : {"estimate", "exact"}
        How ``modes`` becomes a cut-off: from the density of modes, with the error that the result states, or by a few
        sparse factorizations; up to 1000 vertices it is always exact.
    tolerance : float
        Relative error of the displacement at which polynomials are cut off and the least squares end, from 1e-10 to
        0.1. The default, 0.003, does not show: noise of 0.2 edges is moved by at most 0.0006 edges differently.
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"fixed"``: it stays to the bit. ``"curve"``: it is smoothed
        along itself by the same three steps, except around small holes (shorter than the wavelength), which stay.
        ``"free"``: it is smoothed like the rest, which pulls it inward (the paper). ``"auto"`` is ``"fixed"``, unless
        the weight is chosen and the noise is correlated between neighbors: then the boundary moves as the rest does,
        but across the surface only.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them without a seam.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        Fraction of the removed detail that features keep: 0 smooths them like the rest, 1 keeps them, above 1 enhances
        them. Without ``features`` it has no effect.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
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

def choose(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: Smoothing | None = None,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    response: AnyResponseName | CutoffResponse | Response | Family = "auto",
    barycenter_weight: float | Floats | None = None,
    spacing: float | tuple[float, float, float] | None = None,
    iterations: int = 1,
    method: Method = "auto",
    mode_count: ModeCount = "estimate",
    tolerance: float = 0.003,
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = 1.0,
    region: Region | None = None,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    progress: Progress | None = None,
) -> Choice:
    """Choose the setting of least estimated error, without the truth to compare with.

    The mesh is taken as one, without the steps that :func:`meshlab_specsmooth.smooth` takes around an automatic choice:
    stray vertices, impulses, parts of different scale or noise, and the shape held against the noise.

    Parameters
    ----------
    mesh, faces, setting, region, laplacian, weld, progress
        As for :func:`meshlab_specsmooth.smooth`, and so are the fields of setting and region as keywords.
    modes : int, optional
        Number of modes kept, lowest first (the paper's f_a).
    wavelength : float, optional
        Shortest surface wave kept, in mesh units. Without this and ``modes``: 20 mean edge lengths.
    response : {"auto", "ideal", "butterworth", "gaussian", "heat"}, Response, or callable
        Shape of the low-pass: a name, a function from a cut-off eigenvalue to a
        :class:`meshlab_specsmooth.Response`, or a response with a cut-off of its own. ``"auto"`` is ideal where
        ``modes`` or ``wavelength`` is given, as in the paper. Otherwise it is heat, or, where the weight is chosen on a
        mesh of at most 100 000 vertices, heat or ideal by estimated error.
    barycenter_weight : float or (n,) array, optional
        w from 1.5e-8 to 6.7e7, dimensionless: how firmly the barycenters are held. It is the strength of the filter,
        more than the cut-off is: 1 is the paper, 0.3 suits noise of 0.2 edge lengths. An array holds the weight at each
        vertex, for noise that differs over the surface. If not given, the noise is estimated
        (:func:`meshlab_specsmooth.estimate_noise`), impulses are clipped, and the weight of least estimated error is
        used; ``result.noise`` is the estimate. Single stray vertices are put back first. Components of different scale
        or noise are smoothed one by one. Where noise and shape cannot be separated, nothing is moved, and where the
        shape would change by more than the noise explains, a weaker result or the input is returned; ``result.warning``
        says so.
    spacing : float or (3,) floats, optional
        Sides of the voxels, in mesh units and along x, y and z, where the surface was made from a binary mask: the
        weight is then the smallest with which nearly all vertices stay within about half a voxel of where they were.
        Recognized if not given, where the mesh is unchanged but for its position, orientation and scale.
    iterations : int
        How often the three steps are applied, each time to the last result; at most 1000.
    method : {"auto", "exact", "chebyshev"}
        How h(L) is applied: with eigenvectors, or with a polynomial; ``"auto"`` is exact up to 1000 vertices.
    mode_count : {"estimate", "exact"}
        How ``modes`` becomes a cut-off: from the density of modes, with the error that the result states, or by a few
        sparse factorizations; up to 1000 vertices it is always exact.
    tolerance : float
        Relative error of the displacement at which polynomials are cut off and the least squares end, from 1e-10 to
        0.1. The default, 0.003, does not show: noise of 0.2 edges is moved by at most 0.0006 edges differently.
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"fixed"``: it stays to the bit. ``"curve"``: it is smoothed
        along itself by the same three steps, except around small holes (shorter than the wavelength), which stay.
        ``"free"``: it is smoothed like the rest, which pulls it inward (the paper). ``"auto"`` is ``"fixed"``, unless
        the weight is chosen and the noise is correlated between neighbors: then the boundary moves as the rest does,
        but across the surface only.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them without a seam.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        Fraction of the removed detail that features keep: 0 smooths them like the rest, 1 keeps them, above 1 enhances
        them. Without ``features`` it has no effect.

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

def low_pass(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: LowPass | None = None,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    response: ResponseName | CutoffResponse | Response | Family = "ideal",
    method: Method = "auto",
    mode_count: ModeCount = "estimate",
    mask: npt.ArrayLike | None = None,
    max_displacement: float | str | None = None,
    region: Region | None = None,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Low-pass the coordinates themselves, V' = h(L) V: plain spectral smoothing, which the paper compares with.

    It is the limit of :func:`meshlab_specsmooth.smooth` for a barycenter weight of 0 (up to a shift of open components,
    whose mean over edges differs from that over faces); it removes all detail below the wavelength, and shrinks.

    Parameters
    ----------
    mesh, faces
        As for :func:`meshlab_specsmooth.smooth`.
    setting : LowPass, optional
        All parameters of the filter as a value, in place of the keywords up to ``mode_count``.
    modes : int, optional
        Number of modes kept, lowest first (the paper's f_a).
    wavelength : float, optional
        Shortest surface wave kept, in mesh units. Without this and ``modes``: 20 mean edge lengths.
    response : {"ideal", "butterworth", "gaussian", "heat"}, Response, or callable
        Shape of the low-pass, as for :func:`meshlab_specsmooth.smooth`.
    method, mode_count
        As for :class:`Smoothing`.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them without a seam.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
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

def smooth_labels(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: Smoothing | None = None,
    *,
    modes: int | None = None,
    wavelength: float | None = None,
    response: AnyResponseName | CutoffResponse | Response | Family = "auto",
    barycenter_weight: float | Floats | None = None,
    spacing: float | tuple[float, float, float] | None = None,
    iterations: int = 1,
    method: Method = "auto",
    mode_count: ModeCount = "estimate",
    tolerance: float = 0.003,
    max_displacement: float | str | None = None,
    region: Region | None = None,
    labels: npt.ArrayLike | str | None = None,
    laplacian: LaplacianKind = "uniform",
    progress: Progress | None = None,
) -> LabelResult:
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
    modes : int, optional
        Number of modes kept, lowest first (the paper's f_a).
    wavelength : float, optional
        Shortest surface wave kept, in mesh units. Without this and ``modes``: 20 mean edge lengths.
    response : {"auto", "ideal", "butterworth", "gaussian", "heat"}, Response, or callable
        Shape of the low-pass: a name, a function from a cut-off eigenvalue to a
        :class:`meshlab_specsmooth.Response`, or a response with a cut-off of its own. ``"auto"`` is ideal where
        ``modes`` or ``wavelength`` is given, as in the paper. Otherwise it is heat, or, where the weight is chosen on a
        mesh of at most 100 000 vertices, heat or ideal by estimated error.
    barycenter_weight : float or (n,) array, optional
        w from 1.5e-8 to 6.7e7, dimensionless: how firmly the barycenters are held. It is the strength of the filter,
        more than the cut-off is: 1 is the paper, 0.3 suits noise of 0.2 edge lengths. An array holds the weight at each
        vertex, for noise that differs over the surface. If not given, the noise is estimated
        (:func:`meshlab_specsmooth.estimate_noise`), impulses are clipped, and the weight of least estimated error is
        used; ``result.noise`` is the estimate. Single stray vertices are put back first. Components of different scale
        or noise are smoothed one by one. Where noise and shape cannot be separated, nothing is moved, and where the
        shape would change by more than the noise explains, a weaker result or the input is returned; ``result.warning``
        says so.
    spacing : float or (3,) floats, optional
        Sides of the voxels, in mesh units and along x, y and z, where the surface was made from a binary mask: the
        weight is then the smallest with which nearly all vertices stay within about half a voxel of where they were.
        Recognized if not given, where the mesh is unchanged but for its position, orientation and scale.
    iterations : int
        How often the three steps are applied, each time to the last result; at most 1000.
    method : {"auto", "exact", "chebyshev"}
        How h(L) is applied: with eigenvectors, or with a polynomial; ``"auto"`` is exact up to 1000 vertices.
    mode_count : {"estimate", "exact"}
        How ``modes`` becomes a cut-off: from the density of modes, with the error that the result states, or by a few
        sparse factorizations; up to 1000 vertices it is always exact.
    tolerance : float
        Relative error of the displacement at which polynomials are cut off and the least squares end, from 1e-10 to
        0.1. The default, 0.003, does not show: noise of 0.2 edges is moved by at most 0.0006 edges differently.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
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

def enhance(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: Enhancement | None = None,
    *,
    longest: float | None = None,
    shortest: float | None = None,
    gain: float = 2.0,
    response: ResponseName | Family = "butterworth",
    barycenter_weight: float = 0.1,
    method: Method = "auto",
    tolerance: float = 0.003,
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    max_displacement: float | str | None = None,
    region: Region | None = None,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    workspace: Workspace | None = None,
    progress: Progress | None = None,
) -> SmoothingResult:
    """Amplify a band of the surface's detail by the same three steps: delta' = delta + (gain - 1) band(L) delta.

    Parameters
    ----------
    mesh, faces
        As for :func:`meshlab_specsmooth.smooth`.
    setting : Enhancement, optional
        All parameters of the filter as a value, in place of the keywords up to ``method``.
    longest, shortest : float, optional
        The longest and the shortest wave of the band, in mesh units; 30 and 6 mean edge lengths by default.
    gain : float
        Factor for the band's differential coordinates: 1 changes nothing, 2 doubles, 0 removes.
    response : {"butterworth", "ideal", "gaussian", "heat"}, or callable
        Shape of the band's edges: a name, or a function from a cut-off eigenvalue to a
        :class:`meshlab_specsmooth.Response`.
    barycenter_weight : float
        w > 0: the barycenters hold waves back whose eigenvalue is below w, so it is smaller here than for smoothing.
    method : {"auto", "exact", "chebyshev"}
        As for :func:`meshlab_specsmooth.smooth`.
    tolerance : float
        As for :func:`meshlab_specsmooth.smooth`.
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"fixed"``: it stays to the bit. ``"curve"``: it is smoothed
        along itself by the same three steps, except around small holes (shorter than the wavelength), which stay.
        ``"free"``: it is smoothed like the rest, which pulls it inward (the paper). ``"auto"`` is ``"fixed"``, unless
        the weight is chosen and the noise is correlated between neighbors: then the boundary moves as the rest does,
        but across the surface only.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them without a seam.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
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
