"""The paper's three steps on face normals: noise goes, creases stay; every strength chosen by its estimated error.

1. The signal is the unit normals N of the faces instead of the differential coordinates of the vertices.
2. Its low-pass is (A + t L_w)^-1 A N on the graph of faces that share a vertex, A the faces' areas and L_w the
   Laplacian with weights that fall with the distance of the centroids and with the angle between *guiding* normals:
   those of the isotropically smoothed surface first, then those of the result so far. So nothing flows across a crease.
3. The vertices follow the filtered normals by gradient steps on sum_f (n_f . (c_f - v))^2 over the vertices' faces
   (Sun, Rosin, Martin, Langbein, *Fast and effective feature-preserving mesh denoising*, TVCG 2007), stopped early, so
   that triangles keep their shape.

The mean squared error along the normals of any setting is estimated from the noisy surface alone (Stein 1981; by Monte
Carlo: Ramani, Blu, Unser 2008), and the setting with the least is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, accept_meshes, recognize
from meshlab_specsmooth.choices import Boundary, Criterion, Start
from meshlab_specsmooth.edge_aware.denoising import CRITERIA, denoised
from meshlab_specsmooth.edge_aware.regions import region_of
from meshlab_specsmooth.edge_aware.result import Considered, EdgeAwareResult, Setting
from meshlab_specsmooth.edge_aware.search import Fixed
from meshlab_specsmooth.parameters import (
    MAX_FACE_ITERATIONS,
    RANGE_SIGMA_BOUNDS,
    STRENGTH_BOUNDS,
    check_barycenter_weight,
    check_choice,
    check_count,
    check_flag,
    check_number,
)
from meshlab_specsmooth.runtime.bars import begin
from meshlab_specsmooth.runtime.progress import Progress, finish

STARTS = ("auto", "given", "smoothed")

__all__ = ["CRITERIA", "STARTS", "Considered", "EdgeAwareResult", "Setting", "denoise", "smooth_edge_aware"]


@accept_meshes
def smooth_edge_aware(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    criterion: Criterion = "position",
    strength: float | None = None,
    range_sigma: float | None = None,
    iterations: int | None = None,
    start: Start = "auto",
    barycenter_weight: float | None = None,
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = 1.0,
    creases: npt.ArrayLike | float | None = None,
    weld: bool = True,
    progress: Progress | None = None,
) -> EdgeAwareResult:
    """Smooth a surface and keep its edges; without parameters, as strongly as the noise asks for.

    Parameters
    ----------
    mesh : (n, 3) array of real numbers, or a mesh of any kind
    faces : (m, 3) array of integers, optional
        As for :func:`meshlab_specsmooth.smooth`.
    criterion : {"position", "normals"}
        Whether the error of positions is to be least, or rather that of the normals: then the noise is taken for 1.4
        times as high.
    strength : float, optional
        t, from 2.2e-16 to 4.5e15; 0.1 is gentle, 2 to 6 suits hard edges under much noise. Chosen by estimated
        error if not given.
    range_sigma : float, optional
        Between unit normals, from 2.2e-16 to 6.7e7: 0.2 for hard edges, 0.6 for organic shapes. Chosen if not given.
    iterations : int, optional
        1 to 100. Chosen if not given.
    start : {"auto", "given", "smoothed"}
        What the first pass filters: the surface as given, for hard edges, or the isotropically smoothed one, for
        organic shapes. ``"auto"`` chooses, unless nothing else is left to be chosen: then it is as given.
    barycenter_weight : float, optional
        w > 0 of the isotropic filter, which the first pass is guided by or starts from. By the noise if not given.
    boundary : {"auto", "fixed", "curve", "free"}
        What happens at the boundary of an open surface. ``"auto"``: it follows the normals of its faces, and is not
        drawn inward. ``"fixed"``: it stays to the bit, so that tiles with a common edge still fit. ``"curve"``: it is
        smoothed along itself, as by :func:`meshlab_specsmooth.smooth`. ``"free"``: it is treated like the rest.
    mask : (n,) array of weights in [0, 1] or of bool, optional
        Vertices that may move: those whose weight is above 0. The others stay to the bit, and the displacement fades
        out toward them over four rings of edges. Where there are 200 or more, the noise is measured and the setting
        chosen on these alone.
    features : (n,) array of weights in [0, 1] or of bool, optional
        Vertices whose detail is to be kept or enhanced.
    feature_gain : float
        A feature's displacement is multiplied by 1 - feature_gain * weight: 0 smooths it as the rest, 1 keeps it where
        it is, above 1 enhances what smoothing would remove. Without ``features`` it has no effect.
    creases : (k, 2) array of integers, or float, optional
        Edges that nothing crosses: as pairs of vertices, or all edges whose faces' normals differ by more than an angle
        in degrees. Faces on opposite sides exchange no normals: two faces are neighbors only where they are linked
        around a common vertex without crossing a crease, and never if they share a crease. The isotropic guide leaves
        the creases' vertices in place and is computed on each side by itself; afterward these vertices follow the
        faces of both sides. What is chosen by estimated error, and the units, are common to the whole surface. The
        angle is measured on the surface as given where that has no noise, else between normals after a first edge-aware
        low-pass, as noise tilts faces by more than the angle of many edges. That finds hard edges, of 45 degrees and
        more; those of a smaller angle are better given as pairs.
    weld : bool
        Whether vertices at one place move as one, as for :func:`meshlab_specsmooth.smooth`.
    progress : callable, optional
        Called with the fraction done, rising to 1; what it raises ends the call.

    Raises
    ------
    InvalidSurface
        As :class:`Surface` does.
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
    fixed = Fixed(
        None if strength is None else check_number("strength", strength, *STRENGTH_BOUNDS),
        None if range_sigma is None else check_number("range_sigma", range_sigma, *RANGE_SIGMA_BOUNDS),
        None if iterations is None else check_count("iterations", iterations, 1, MAX_FACE_ITERATIONS),
        check_choice("start", start, STARTS),
        None if barycenter_weight is None else check_barycenter_weight(barycenter_weight),
    )
    criterion = check_choice("criterion", criterion, CRITERIA)
    progress = begin(progress, "assembling")
    source = recognize(mesh, faces)
    surface = source.surface()
    region = region_of(surface, boundary, mask, features, feature_gain, creases)
    result = denoised(surface, criterion, fixed, region, False, check_flag("weld", weld), progress)
    finish(progress)
    return replace(result, source=source.kept())


@accept_meshes
def denoise(
    mesh: Mesh,
    faces: npt.ArrayLike | None = None,
    *,
    criterion: Criterion = "position",
    boundary: Boundary = "auto",
    mask: npt.ArrayLike | None = None,
    features: npt.ArrayLike | None = None,
    feature_gain: float = 1.0,
    creases: npt.ArrayLike | float | None = None,
    weld: bool = True,
    progress: Progress | None = None,
) -> EdgeAwareResult:
    """Smooth a surface by whatever has the least estimated error: the isotropic filter or an edge-aware setting.

    Where noise cannot be told from shape, nothing is moved; where the shape would change by more than the noise
    explains, a weaker result or the input is returned. ``result.warning`` says so.

    Parameters
    ----------
    mesh : (n, 3) array of real numbers, or a mesh of any kind
    faces : (m, 3) array of integers, optional
        As for :func:`meshlab_specsmooth.smooth`.
    criterion, boundary, mask, features, feature_gain, creases, weld, progress
        As for :func:`smooth_edge_aware`. Where creases are given, the isotropic filter is not considered: it knows of
        none, and would round them.

    Returns
    -------
    EdgeAwareResult
        ``considered`` is the table of all that was tried; 0 iterations stand for the isotropic filter.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = mss.denoise(flat, [[0, 1, 2], [0, 2, 3]])
    >>> bool(abs(result.vertices - flat).max() < 1e-12)
    True
    """
    criterion = check_choice("criterion", criterion, CRITERIA)
    progress = begin(progress, "assembling")
    source = recognize(mesh, faces)
    surface = source.surface()
    region = region_of(surface, boundary, mask, features, feature_gain, creases)
    result = denoised(surface, criterion, Fixed(), region, True, check_flag("weld", weld), progress)
    finish(progress)
    return replace(result, source=source.kept())
