"""A process that smooths one piece after the other."""

from __future__ import annotations

import functools

import numpy as np

from meshlab_specsmooth.batching.worker import serve
from meshlab_specsmooth.pieces.piece import PieceJob, run_piece
from meshlab_specsmooth.smoothing.api import smooth


def serve_pieces() -> None:
    """Do the pieces of the process that started this one."""
    serve(run_piece, PieceJob, warm_up)


@functools.cache
def warm_up() -> None:
    """Smooth a small mesh once, so that forks of this process find everything loaded that the first piece loads."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    at = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    faces = np.concatenate([np.c_[at, at + 1, at + 41], np.c_[at, at + 41, at + 40]])
    smooth(np.c_[x, y, np.sin(x + y)], faces, barycenter_weight=0.5, method="chebyshev")
