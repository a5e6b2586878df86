"""Types of ``meshlab_specsmooth.edge_aware.api``, made from the settings by ``python3 scripts/make_docs.py``."""

import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh
from meshlab_specsmooth.choices import Boundary
from meshlab_specsmooth.edge_aware.result import EdgeAwareResult
from meshlab_specsmooth.edge_aware.settings import Denoising, EdgeAware, EdgeAwareRegion
from meshlab_specsmooth.runtime.progress import Progress

def smooth_edge_aware(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: EdgeAware | None = None,
    *,
    strength: float | None = None,
    range_sigma: float | None = None,
    iterations: int | None = None,
    start: str = "auto",
    barycenter_weight: float | None = None,
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = 1.0,
    max_displacement: float | str | None = None,
    creases: npt.ArrayLike | float | None = None,
    region: EdgeAwareRegion | None = None,
    weld: bool = True,
    progress: Progress | None = None,
) -> EdgeAwareResult:
    """Smooth a surface and keep its edges; without parameters, as strongly as the noise asks for.

    The three steps act on the unit normals N of the faces. Step 2 low-passes them, (A + t L_w)^-1 A N, on the graph of
    faces that share a vertex; A are the faces' areas, and the weights of L_w fall with the distance of the centroids
    and with the angle between guiding normals, those of the isotropically smoothed surface first, then those of the
    result so far. Step 3 moves the vertices toward the filtered normals (Sun, Rosin, Martin, Langbein, *Fast and
    effective feature-preserving mesh denoising*, TVCG 2007).

    Parameters
    ----------
    mesh : (n, 3) real array, a mesh of any kind, or Operators
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    setting : EdgeAware, optional
        All parameters of the filter as a value, in place of the keywords up to ``barycenter_weight``.
    strength : float, optional
        t, from 2.2e-16 to 4.5e15; 0.1 is gentle, 2 to 6 suits hard edges under much noise. Chosen by estimated error if
        not given.
    range_sigma : float, optional
        Standard deviation of the weights over the distance of unit normals, from 2.2e-16 to 6.7e7: 0.2 for hard edges,
        0.6 for organic shapes. Chosen if not given.
    iterations : int, optional
        0 to 100; 0 is the isotropic filter alone. Chosen if not given.
    start : {"auto", "given", "smoothed", "clipped"}
        What the first iteration filters: the surface as given, for hard edges, or the isotropically smoothed one, for
        organic shapes. ``"auto"`` chooses; if nothing else is left to be chosen, it is as given. ``"clipped"``, with 0
        iterations, is the isotropic filter after clipping impulses.
    barycenter_weight : float, optional
        w > 0 of the isotropic filter, which guides the first iteration, or which it starts from. By the noise if not
        given.
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"auto"``: it follows the normals of its faces, and is not pulled
        inward. ``"fixed"``: it stays to the bit, so that tiles with a common edge still fit. ``"curve"``: it is
        smoothed along itself, as by :func:`meshlab_specsmooth.smooth`. ``"free"``: it is treated like the rest.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them over four rings of edges. Where there are 200 or more, the noise is estimated and the setting
        chosen on these alone.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        A feature's displacement is multiplied by 1 - feature_gain * weight: 0 smooths it like the rest, 1 keeps it
        where it is, above 1 enhances what smoothing would remove. Without ``features`` it has no effect.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
    creases : (k, 2) array of integers, or float, optional
        Edges that nothing crosses: as pairs of vertices, or all edges whose faces' normals differ by more than an angle
        in degrees. Faces on opposite sides exchange no normals: two faces are neighbors only where they are linked
        around a common vertex without crossing a crease, and never if they share a crease. The isotropic guide leaves
        the creases' vertices in place and is computed on each side by itself; afterward these vertices follow the faces
        of both sides. The choice and the units are common to the whole surface. The angle is measured on the surface as
        given where that has no noise, else between normals after a first edge-aware low-pass, as noise tilts faces by
        more than the angle of many edges. That finds hard edges, of 45 degrees and more; those of a smaller angle are
        better given as pairs.
    region : EdgeAwareRegion, optional
        ``boundary``, ``mask``, ``features``, ``feature_gain``, ``max_displacement`` and ``creases`` as a value, in
        place of these.
    weld : bool
        Whether vertices at one place move as one, as for :func:`meshlab_specsmooth.smooth`.
    progress : callable, optional
        Called with the fraction done, rising to 1; an exception that it raises ends the call.

    Returns
    -------
    EdgeAwareResult
        ``considered`` is the table of all settings that were tried.

    Raises
    ------
    InvalidSurface
        The arrays do not form a triangle mesh.
    InvalidParameter
        Names the parameter.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = mss.smooth_edge_aware(flat, [[0, 1, 2], [0, 2, 3]])
    >>> bool(abs(result.vertices - flat).max() < 1e-12)
    True
    """

def denoise(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    setting: Denoising | None = None,
    *,
    spacing: float | tuple[float, float, float] | None = None,
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = 1.0,
    max_displacement: float | str | None = None,
    creases: npt.ArrayLike | float | None = None,
    region: EdgeAwareRegion | None = None,
    weld: bool = True,
    progress: Progress | None = None,
) -> EdgeAwareResult:
    """Smooth a surface by the filter of least estimated error: isotropic, or edge-aware with any setting.

    Where noise and shape cannot be separated, nothing is moved; where the shape would change by more than the noise
    explains, a weaker result or the input is returned. ``result.warning`` says so.

    Parameters
    ----------
    mesh : (n, 3) real array, a mesh of any kind, or Operators
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    setting : Denoising, optional
        ``spacing`` as a value.
    spacing : float or (3,) floats, optional
        Sides of the voxels, in mesh units and along x, y and z, where the surface was made from a binary mask: it is
        then smoothed as far as nearly all vertices stay within about half a voxel of where they were. Recognized if not
        given, where the mesh is unchanged but for its position, orientation and scale.
    boundary : {"auto", "fixed", "curve", "free"}
        Treatment of the boundary of an open surface. ``"auto"``: it follows the normals of its faces, and is not pulled
        inward. ``"fixed"``: it stays to the bit, so that tiles with a common edge still fit. ``"curve"``: it is
        smoothed along itself, as by :func:`meshlab_specsmooth.smooth`. ``"free"``: it is treated like the rest.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them over four rings of edges. Where there are 200 or more, the noise is estimated and the setting
        chosen on these alone.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        A feature's displacement is multiplied by 1 - feature_gain * weight: 0 smooths it like the rest, 1 keeps it
        where it is, above 1 enhances what smoothing would remove. Without ``features`` it has no effect.
    max_displacement : float or str, optional
        Limit of the distance that a vertex may move, as a length in mesh units or as a percentage of the bounding-box
        diagonal, ``"0.1%"``. Vertices around those that reach it follow, so that no kinks appear; ``result.limited``
        is the number that reach it. No limit if not given.
    creases : (k, 2) array of integers, or float, optional
        Edges that nothing crosses: as pairs of vertices, or all edges whose faces' normals differ by more than an angle
        in degrees. Faces on opposite sides exchange no normals: two faces are neighbors only where they are linked
        around a common vertex without crossing a crease, and never if they share a crease. The isotropic guide leaves
        the creases' vertices in place and is computed on each side by itself; afterward these vertices follow the faces
        of both sides. The choice and the units are common to the whole surface. The angle is measured on the surface as
        given where that has no noise, else between normals after a first edge-aware low-pass, as noise tilts faces by
        more than the angle of many edges. That finds hard edges, of 45 degrees and more; those of a smaller angle are
        better given as pairs.
    region, weld, progress
        As for :func:`smooth_edge_aware`. Where creases are given, the isotropic filter is not considered: it would
        round them.

    Returns
    -------
    EdgeAwareResult
        ``considered`` is the table of all settings that were tried; 0 iterations is the isotropic filter.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = mss.denoise(flat, [[0, 1, 2], [0, 2, 3]])
    >>> bool(abs(result.vertices - flat).max() < 1e-12)
    True
    """
