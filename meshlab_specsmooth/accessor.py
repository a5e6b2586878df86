"""The namespace ``specsmooth`` of every PyVista ``PolyData``, loaded by PyVista through an entry point."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import pyvista as pv

from meshlab_specsmooth.adapters import Mesh, recognize
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison.comparison import Comparison
from meshlab_specsmooth.comparison.deviation import Deviation, deviation
from meshlab_specsmooth.describe import Sentence
from meshlab_specsmooth.edge_aware.api import denoise, smooth_edge_aware
from meshlab_specsmooth.geometry.surface import vertex_normals
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.reports.compared import compare
from meshlab_specsmooth.risk.estimate_error import estimate_noise
from meshlab_specsmooth.smoothing.api import enhance, low_pass, smooth
from meshlab_specsmooth.smoothing.boundary import smooth_boundary
from meshlab_specsmooth.smoothing.result import FilterResult

F = TypeVar("F", bound=Callable[..., Any])

#: Point data of a result: the displacement along the normals of the input.
DISPLACEMENT = "specsmooth_displacement"

# Parameters of a function that the accessor passes itself
_PASSED = ("mesh", "faces")


def _take_parameters_of(function: Callable[..., Any]) -> Callable[[F], F]:
    """Show the parameters of a function as those of a method, for completion and ``help``."""

    def decorate(method: F) -> F:
        @functools.wraps(method)
        def call(self: Any, *args: Any, **kwargs: Any) -> Any:
            return method(self, *args, **kwargs)

        shown = inspect.signature(function)
        own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        rest = [each for name, each in shown.parameters.items() if name not in _PASSED]
        call.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [own, *rest], return_annotation=inspect.signature(method).return_annotation
        )
        return call  # type: ignore[return-value]

    return decorate


def _store_setting(result: FilterResult) -> str:
    """The setting as JSON; empty where there is none, or where a response of one's own is no data."""
    setting = getattr(result, "setting", None)
    if setting is None or not setting.is_data:
        return ""
    return json.dumps(setting.to_dict())


@pv.register_dataset_accessor("specsmooth", pv.PolyData)
class SpecsmoothAccessor:
    """Smooth and denoise a :class:`pyvista.PolyData`, measure its noise, and compare filters on it.

    It is available as ``mesh.specsmooth`` wherever this package is installed with PyVista 0.48 or later; nothing has to
    be imported. Methods leave the mesh unchanged. Those that move points return a new mesh with all arrays of the
    input and with

    - point data ``"specsmooth_displacement"``: the displacement of each point along the normal of the input, which is
      not made the active scalars;
    - field data ``"specsmooth_summary"``, ``"specsmooth_warning"`` and ``"specsmooth_setting"`` (JSON): what was done,
      which files keep;
    - ``specsmooth.result``: the whole result, with noise, setting and estimated error; it belongs to this object, not
      to copies of it.

    Quads, larger polygons and triangle strips are split for the computation, and kept as they are.

    Parameters
    ----------
    mesh : pyvista.PolyData

    Examples
    --------
    Denoise a sphere, and color the result by what was removed.

    >>> import numpy as np
    >>> import pyvista as pv
    >>> mesh = pv.Icosphere(nsub=4)
    >>> rng = np.random.default_rng(0)
    >>> mesh.points += 0.004 * rng.standard_normal(mesh.points.shape)
    >>> smooth = mesh.specsmooth.denoise()
    >>> smooth.point_data.keys()
    ['specsmooth_displacement']
    >>> smooth.plot(scalars="specsmooth_displacement", cmap="bwr")

    What was measured and chosen:

    >>> smooth.specsmooth.result.noise.kind
    'white'
    """

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh
        self._result: FilterResult | None = None

    def __repr__(self) -> str:
        return f"<specsmooth accessor: {self.summary}>"

    def _repr_html_(self) -> str:
        return (self._result or Sentence(self.summary))._repr_html_()

    @property
    def result(self) -> FilterResult | None:
        """The result that this mesh was made by; None for other meshes, and for copies."""
        return self._result

    @property
    def summary(self) -> str:
        """What was done to this mesh, in one sentence; copies and files have it as well."""
        found = self._mesh.field_data.get("specsmooth_summary", ())
        return str(found[0]) if len(found) else "not smoothed"

    @_take_parameters_of(denoise)
    def denoise(self, *args: Any, **kwargs: Any) -> Any:
        """Remove noise by the isotropic or the edge-aware filter, whichever has the lower estimated error.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.denoise`; none is needed.

        Returns
        -------
        pyvista.PolyData

        Examples
        --------
        >>> import pyvista as pv
        >>> mesh = pv.Sphere()
        >>> mesh.specsmooth.denoise().specsmooth.summary
        'left as it is: ...
        """
        return self._moved(denoise, *args, **kwargs)

    @_take_parameters_of(smooth)
    def smooth(self, *args: Any, **kwargs: Any) -> Any:
        """Smooth by the isotropic filter; without a weight, as far as the noise asks for.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.smooth`.

        Returns
        -------
        pyvista.PolyData

        Examples
        --------
        >>> import pyvista as pv
        >>> mesh = pv.Cube().triangulate().subdivide(3)
        >>> rounded = mesh.specsmooth.smooth(barycenter_weight=0.3)
        >>> rounded.n_points == mesh.n_points
        True
        >>> rounded.plot(show_edges=True)
        """
        return self._moved(smooth, *args, **kwargs)

    @_take_parameters_of(smooth_edge_aware)
    def smooth_edge_aware(self, *args: Any, **kwargs: Any) -> Any:
        """Smooth by the edge-aware filter, not across creases.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.smooth_edge_aware`.

        Returns
        -------
        pyvista.PolyData
        """
        return self._moved(smooth_edge_aware, *args, **kwargs)

    @_take_parameters_of(low_pass)
    def low_pass(self, *args: Any, **kwargs: Any) -> Any:
        """Smooth by a plain low-pass without barycenter constraints.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.low_pass`.

        Returns
        -------
        pyvista.PolyData
        """
        return self._moved(low_pass, *args, **kwargs)

    @_take_parameters_of(enhance)
    def enhance(self, *args: Any, **kwargs: Any) -> Any:
        """Amplify a band of detail.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.enhance`.

        Returns
        -------
        pyvista.PolyData
        """
        return self._moved(enhance, *args, **kwargs)

    @_take_parameters_of(smooth_boundary)
    def smooth_boundary(self, *args: Any, **kwargs: Any) -> Any:
        """Smooth the boundary along itself.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.smooth_boundary`.

        Returns
        -------
        pyvista.PolyData
        """
        return self._moved(smooth_boundary, *args, **kwargs)

    @_take_parameters_of(estimate_noise)
    def estimate_noise(self, *args: Any, **kwargs: Any) -> Noise:
        """Measure the noise: its level along the normals, its kind, and where it is.

        Parameters
        ----------
        *args, **kwargs
            Those of :func:`meshlab_specsmooth.estimate_noise`.

        Returns
        -------
        meshlab_specsmooth.Noise

        Examples
        --------
        >>> import pyvista as pv
        >>> pv.Sphere().specsmooth.estimate_noise().kind
        'none'
        """
        return estimate_noise(self._mesh, *args, **kwargs)

    @_take_parameters_of(compare)
    def compare(self, **kwargs: Any) -> Comparison:
        """Compare MeshLab's smoothing filters and those of this package on this mesh by their estimated error.

        Parameters
        ----------
        **kwargs
            Those of :func:`meshlab_specsmooth.compare`.

        Returns
        -------
        meshlab_specsmooth.Comparison
        """
        return compare(self._mesh, **kwargs)

    def deviation(self, after: Mesh, *, tolerance: float | str | None = None) -> Deviation:
        """Measure how far a mesh deviates from this one, along the normals.

        Parameters
        ----------
        after : mesh of any kind
        tolerance : float or str, optional
            A length, or a percentage of the diagonal such as ``"0.1%"``.

        Returns
        -------
        meshlab_specsmooth.Deviation

        Examples
        --------
        >>> import pyvista as pv
        >>> mesh = pv.Sphere(theta_resolution=60, phi_resolution=60)
        >>> found = mesh.specsmooth.deviation(mesh.specsmooth.smooth(barycenter_weight=0.3), tolerance=0.01)
        >>> found.is_within
        True
        """
        return deviation(self._mesh, after, tolerance=tolerance)

    def _moved(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Apply a filter, and return the mesh with its evidence."""
        source = recognize(self._mesh)
        result: FilterResult = function(self._mesh, *args, **kwargs)
        mesh = result.mesh
        change = result.vertices - np.asarray(self._mesh.points, dtype=np.float64)
        along: Floats = np.einsum("ij,ij->i", np.nan_to_num(change), vertex_normals(source.surface()))
        mesh.point_data.set_array(along, DISPLACEMENT)  # an item that is set would become the active scalars
        texts = {
            "summary": result.summary,
            "warning": result.warning or "",
            "setting": _store_setting(result),
        }
        for name, text in texts.items():
            mesh.field_data[f"specsmooth_{name}"] = [text]
        mesh.specsmooth._result = result
        return mesh
