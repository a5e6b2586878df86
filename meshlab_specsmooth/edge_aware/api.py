"""The public functions of edge-aware smoothing. Their types stand in ``api.pyi``, made by ``scripts/make_docs.py``."""

from __future__ import annotations

from meshlab_specsmooth.adapters import accept_meshes
from meshlab_specsmooth.edge_aware.denoising import denoise_mesh
from meshlab_specsmooth.edge_aware.settings import Denoising, EdgeAware, EdgeAwareRegion
from meshlab_specsmooth.smoothing.calls import take_setting

_REGION = ("boundary", "mask", "features", "feature_gain", "max_displacement", "creases")


@accept_meshes
@take_setting(EdgeAware, EdgeAwareRegion, _REGION)
def smooth_edge_aware(mesh, faces, setting, region, *, weld=True, progress=None):
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
    {parameters}
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
    return denoise_mesh(mesh, faces, setting, region, False, weld, progress)


@accept_meshes
@take_setting(Denoising, EdgeAwareRegion, _REGION)
def denoise(mesh, faces, setting, region, *, weld=True, progress=None):
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
    {parameters}
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
    return denoise_mesh(mesh, faces, EdgeAware(), region, True, weld, progress, setting.spacing)
