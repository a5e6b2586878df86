"""The public functions for mesh files that are larger than memory."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from meshlab_specsmooth.choices import Boundary, LaplacianKind
from meshlab_specsmooth.edge_aware.settings import EdgeAware
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.parameters import check_flag
from meshlab_specsmooth.pieces.choose import Choice, choose_denoising, choose_smoothing
from meshlab_specsmooth.pieces.cut import Survey
from meshlab_specsmooth.pieces.margin import TOLERANCE
from meshlab_specsmooth.pieces.result import PiecesResult
from meshlab_specsmooth.pieces.whole import TIME_LIMIT, Machines, Request, smooth_whole
from meshlab_specsmooth.runtime.progress import Progress
from meshlab_specsmooth.smoothing.settings import Region, Smoothing
from meshlab_specsmooth.spectral.response import Response


def smooth_pieces(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    memory_limit: int | str | None = None,
    difference: float = TOLERANCE,
    local: bool = False,
    scheduler: str | None = None,
    workers: int = 1,
    time_limit: float = TIME_LIMIT,
    resume: bool = True,
    boundary: Boundary = "auto",
    max_displacement: float | str | None = None,
    laplacian: LaplacianKind = "uniform",
    weld: bool = True,
    progress: Progress | None = None,
    **setting: Any,
) -> PiecesResult:
    """Smooth a mesh file of any size as :func:`meshlab_specsmooth.smooth` does, within a given amount of memory.

    The file is looked at once. The noise is measured and the setting chosen on samples from all over it. Space is
    cut into boxes with as many vertices each; a piece is the surface in a box with a margin of some rings, for
    which its own vertices become what they would in the whole, up to ``difference``. Pieces are smoothed one by
    one, in processes of this machine or on a Dask cluster, and put together. Properties of vertices and faces that
    have no meaning here are copied to the byte, and normals are computed anew. The output is written whole or not
    at all. Finished pieces are kept in the folder ``OUT.pieces`` until the whole is done; the same call goes on
    where an earlier one ended.

    Parameters
    ----------
    source : path
        A binary PLY file of triangles, a binary STL file, or a folder of binary PLY files (tiles) whose vertices
        coincide where they touch.
    out : path
        A file in the format of the source; for tiles a folder.
    memory_limit : int or str, optional
        Bytes that all processes of this machine may take together, or such as ``"4G"``; by default half of what is
        free. On a cluster, what one worker may take.
    difference : float
        Largest difference to smoothing the whole, relative to the root mean square displacement; the margin follows.
    local : bool
        Whether the noise is treated by region where it is not the same everywhere: it is measured on up to 160 samples,
        a weight is chosen for each octave of its level, and weights in between are interpolated. By default one weight
        is for the whole.
    scheduler : str, optional
        Address of a Dask scheduler (extra ``cluster``), whose workers have this package and see the same files.
    workers : int
        Processes on this machine; the pieces become smaller with more of them.
    time_limit : float
        Seconds after which the process of a piece is killed.
    resume : bool
        Keep what an earlier call for the same file and setting has done.
    boundary, max_displacement, laplacian, weld
        As for :func:`meshlab_specsmooth.smooth`; a percentage is of the diagonal of the whole.
    progress : callable, optional
    **setting
        Fields of :class:`meshlab_specsmooth.Smoothing`: one setting for all pieces. ``modes`` are those of the whole.
        A weight for each vertex and a response of your own are not supported.

    Returns
    -------
    PiecesResult

    Raises
    ------
    InvalidParameter
    FileError
        The source is no such file, or the output cannot be written; what is finished is kept.
    FilterFailed
        A piece failed, or the shape would change by more than the noise explains; what is finished is kept.

    Examples
    --------
    >>> import tempfile
    >>> import meshlab_specsmooth as mss
    >>> ms = mss.MeshSet()
    >>> ms.create_sphere(subdiv=5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_current_mesh(folder + "/ball.ply")
    ...     result = mss.smooth_pieces(folder + "/ball.ply", folder + "/smooth.ply", barycenter_weight=1.0)
    >>> result.vertices, result.pieces
    (10242, 1)
    """
    asked = Smoothing.of(**setting)
    if isinstance(asked.barycenter_weight, np.ndarray) or isinstance(asked.low_pass, Response) or asked.spacing:
        raise InvalidParameter(
            "pieces have one weight and a response by name, and no spacing; smooth the whole instead"
        )
    local = check_flag("local", local)

    def choose(seen: Survey, vertex_count: int) -> Choice:
        return choose_smoothing(seen, vertex_count, asked, laplacian, weld, local)

    region = Region(boundary=boundary, max_displacement=max_displacement)
    machines = Machines.of(memory_limit, scheduler, workers, time_limit)
    request = Request(choose, repr(asked), region, laplacian, weld, local, difference, asked.tolerance)
    return smooth_whole(source, out, request, machines, resume, progress)


def denoise_pieces(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    memory_limit: int | str | None = None,
    difference: float = TOLERANCE,
    local: bool = False,
    scheduler: str | None = None,
    workers: int = 1,
    time_limit: float = TIME_LIMIT,
    resume: bool = True,
    boundary: Boundary = "auto",
    weld: bool = True,
    progress: Progress | None = None,
    **setting: Any,
) -> PiecesResult:
    """Smooth a mesh file of any size as :func:`meshlab_specsmooth.denoise` does, within a given amount of memory.

    As :func:`smooth_pieces`, by the filter of least estimated error. The equations of the edge-aware filter are solved
    to rounding, so that a piece gives what the whole does; :func:`meshlab_specsmooth.denoise` stops at a thousandth,
    and where a face is nearly as likely on either side of an edge the two may differ. The volume of a closed surface is
    kept, by that of the whole.

    Parameters
    ----------
    source, out, memory_limit, difference, scheduler, workers, time_limit, resume, weld, progress
        As for :func:`smooth_pieces`.
    local : bool
        Whether the noise is treated by region: a setting for each octave of its level, and their results blended.
    boundary : {"auto", "fixed", "curve", "free"}
        As for :func:`meshlab_specsmooth.denoise`.
    **setting
        Fields of :class:`meshlab_specsmooth.EdgeAware`, for the edge-aware filter with a setting of your own.

    Returns
    -------
    PiecesResult

    Raises
    ------
    InvalidParameter, FileError, FilterFailed
        As for :func:`smooth_pieces`.

    Examples
    --------
    >>> import tempfile
    >>> import meshlab_specsmooth as mss
    >>> ms = mss.MeshSet()
    >>> ms.create_sphere(subdiv=5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.save_current_mesh(folder + "/ball.ply")
    ...     result = mss.denoise_pieces(folder + "/ball.ply", folder + "/smooth.ply")
    >>> result.displacement
    0.0
    """
    asked = EdgeAware.of(**setting)
    local = check_flag("local", local)

    def choose(seen: Survey, vertex_count: int) -> Choice:
        return choose_denoising(seen, asked, weld, local)

    machines = Machines.of(memory_limit, scheduler, workers, time_limit)
    request = Request(choose, repr(asked), Region(boundary=boundary), "uniform", weld, local, difference)
    return smooth_whole(source, out, request, machines, resume, progress)
