"""The estimated error of a result as a field: where on a surface it can be trusted."""

from __future__ import annotations

import numpy as np

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.edge_aware.api import smooth_edge_aware
from meshlab_specsmooth.edge_aware.result import EdgeAwareResult
from meshlab_specsmooth.edge_aware.settings import EdgeAware
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.operators.assemble import assemble
from meshlab_specsmooth.risk.estimate_error import prepare_probe
from meshlab_specsmooth.runtime.warned import unwarned
from meshlab_specsmooth.smoothing.api import low_pass, smooth
from meshlab_specsmooth.smoothing.result import SmoothingResult
from meshlab_specsmooth.smoothing.settings import Enhancement, LowPass, Smoothing

_PROBES = 2


def estimate_error_field(result: SmoothingResult | EdgeAwareResult) -> Floats:
    """The expected error of a result around each vertex, along the normals, in mesh units.

    It is Stein's estimate (:func:`meshlab_specsmooth.estimate_error`) averaged over a neighborhood, with the
    setting of the result applied to the surface again, with a little more noise. Where noise varies, ``denoise`` blends
    several settings; the noise that they let through is then estimated by one of them. Vertices that did not move keep
    their noise.

    Parameters
    ----------
    result : SmoothingResult or EdgeAwareResult
        Of a filter that removes noise.

    Returns
    -------
    (n,) float64

    Raises
    ------
    InvalidParameter
        The result is that of an enhancement, or has no surface.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    >>> at = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    >>> faces = np.concatenate([np.c_[at, at + 1, at + 41], np.c_[at, at + 41, at + 40]])
    >>> rough = np.c_[x, y, 0.2 * np.random.default_rng(0).standard_normal(1600)]
    >>> field = mss.smooth(rough, faces).error_field
    >>> field.shape, bool(np.median(field) < 0.1)
    ((1600,), True)
    """
    setting = result.setting
    if result.given is None or isinstance(setting, Enhancement):
        raise InvalidParameter("the result has no surface, or is not that of a filter that removes noise")
    ops = assemble(result.given.vertices, result.given.faces, weld=result.welded > 0)
    probe = prepare_probe(ops, noise=result.noise, probes=_PROBES)
    V, F, weld = result.given.vertices, result.given.faces, result.welded > 0
    stays = (result.vertices == V).all(axis=1)[:, None]

    def apply(X: Floats) -> Floats:
        if setting is None or result.displacement == 0:
            return X
        if isinstance(setting, Smoothing):
            return smooth(X, F, setting, weld=weld).vertices
        if isinstance(setting, LowPass):
            return low_pass(X, F, setting, weld=weld).vertices
        if isinstance(setting, EdgeAware):
            return smooth_edge_aware(X, F, setting, weld=weld).vertices
        raise InvalidParameter(f"{type(setting).__name__} is no setting of a filter that removes noise")

    if not probe.probe.draws.any():
        return probe.estimate_field(result.vertices, [])
    with unwarned():
        plain = apply(V)
        again = [result.vertices + np.where(stays, X - V, apply(X) - plain) for X in probe.perturb()]
    return probe.estimate_field(result.vertices, again)
