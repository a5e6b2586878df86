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

import numpy.typing as npt

from meshlab_specsmooth.edge_aware.denoising import FAVORS, denoised
from meshlab_specsmooth.edge_aware.result import Considered, EdgeAwareResult, Setting
from meshlab_specsmooth.edge_aware.search import Fixed
from meshlab_specsmooth.parameters import (
    MOST_FACE_PASSES,
    RANGE_WIDTHS,
    STRENGTHS,
    check_barycenter_weight,
    check_choice,
    check_count,
    check_number,
    check_progress,
)
from meshlab_specsmooth.spectral.progress import Progress
from meshlab_specsmooth.surface import Surface

STARTS = ("auto", "given", "smoothed")

__all__ = ["FAVORS", "STARTS", "Considered", "EdgeAwareResult", "Setting", "denoise", "smooth_edge_aware"]


def smooth_edge_aware(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    *,
    favor: str = "position",
    strength: float | None = None,
    range_width: float | None = None,
    passes: int | None = None,
    start: str = "auto",
    barycenter_weight: float | None = None,
    progress: Progress | None = None,
) -> EdgeAwareResult:
    """Smooth a surface and keep its edges; without parameters, as strongly as the noise asks for.

    Parameters
    ----------
    vertices : (n, 3) array of real numbers
    faces : (m, 3) array of integers
    favor : {"position", "normals"}
        Whether the error of positions is to be least, or rather that of the normals: then the noise is taken for 1.4
        times as high.
    strength : float, optional
        t, from 2.2e-16 to 4.5e15; 0.1 is gentle, 2 to 6 suits hard edges under much noise. Chosen by estimated
        error if not given.
    range_width : float, optional
        Between unit normals, from 2.2e-16 to 6.7e7: 0.2 for hard edges, 0.6 for organic shapes. Chosen if not given.
    passes : int, optional
        1 to 100. Chosen if not given.
    start : {"auto", "given", "smoothed"}
        What the first pass filters: the surface as given, for hard edges, or the isotropically smoothed one, for
        organic shapes. ``"auto"`` chooses, unless nothing else is left to be chosen: then it is as given.
    barycenter_weight : float, optional
        w > 0 of the isotropic filter, which the first pass is guided by or starts from. By the noise if not given.
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
        None if strength is None else check_number("strength", strength, *STRENGTHS),
        None if range_width is None else check_number("range_width", range_width, *RANGE_WIDTHS),
        None if passes is None else check_count("passes", passes, 1, MOST_FACE_PASSES),
        check_choice("start", start, STARTS),
        None if barycenter_weight is None else check_barycenter_weight(barycenter_weight),
    )
    favor = check_choice("favor", favor, FAVORS)
    return denoised(_surface(vertices, faces), favor, fixed, False, check_progress(progress))


def denoise(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, *, favor: str = "position", progress: Progress | None = None
) -> EdgeAwareResult:
    """Smooth a surface by whatever has the least estimated error: the isotropic filter or an edge-aware setting.

    Parameters
    ----------
    vertices : (n, 3) array of real numbers
    faces : (m, 3) array of integers
    favor, progress
        As for :func:`smooth_edge_aware`.

    Returns
    -------
    EdgeAwareResult
        ``considered`` is the table of all that was tried; 0 passes stand for the isotropic filter.

    Examples
    --------
    >>> import meshlab_specsmooth as mss
    >>> flat = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> result = mss.denoise(flat, [[0, 1, 2], [0, 2, 3]])
    >>> bool(abs(result.vertices - flat).max() < 1e-12)
    True
    """
    favor = check_choice("favor", favor, FAVORS)
    return denoised(_surface(vertices, faces), favor, Fixed(), True, check_progress(progress))


def _surface(vertices: npt.ArrayLike, faces: npt.ArrayLike) -> Surface:
    """Checked; its constructor makes arrays of what it is given."""
    return Surface(vertices, faces)  # type: ignore[arg-type]
