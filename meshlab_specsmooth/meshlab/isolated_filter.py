"""Filters in a process of their own, so that one that crashes does not take the caller with it.

Some of MeshLab's filters crash on some meshes (the MLS projections do). A :class:`FilterProcess` holds the faces of one
mesh, runs filters on any positions of its vertices, and reports a crash; the next run starts another process.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.errors import FilterFailed
from meshlab_specsmooth.isolation import processes, worker
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed
from meshlab_specsmooth.meshlab import filters, meshset
from meshlab_specsmooth.meshlab.descriptors import Length
from meshlab_specsmooth.runtime.warned import unwarned


@dataclass(frozen=True, eq=False)
class FilterRun:
    """The result of a filter on a mesh.

    Attributes
    ----------
    vertices : (n, 3) float64
    output : dict
        Numbers, strings and booleans that the filter returned.
    seconds : float
        Time of the filter alone, on a mesh that was in its MeshSet before.
    """

    vertices: Floats
    output: dict[str, Any]
    seconds: float


def run(vertices: Floats, faces: Integers, name: str, parameters: Mapping[str, Any], times: int = 1) -> FilterRun:
    """Run a filter ``times`` times in succession, in this process.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int32
    name : str
        A filter of this package or of MeshLab.
    parameters : mapping
        A :class:`~meshlab_specsmooth.meshlab.descriptors.Length` is a fraction of the bounding-box diagonal.
    times : int

    Raises
    ------
    FilterFailed
        The filter raised an exception, changed the number of vertices or faces, or diverged.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab import isolated_filter
    >>> V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]])
    >>> isolated_filter.run(V, F, "apply_coord_taubin_smoothing", {}).vertices.shape
    (4, 3)
    """
    ms = meshset.new(vertices, faces)
    given = {
        key: pymeshlab.PercentageValue(100 * value.fraction) if isinstance(value, Length) else value
        for key, value in parameters.items()
    }
    output: dict[str, Any] = {}
    start = time.perf_counter()
    try:
        with unwarned():
            for _ in range(times):
                output = filters.apply(ms, name, **given)
    except Exception as error:
        raise FilterFailed(" ".join(str(error).split()) or type(error).__name__) from error
    seconds = time.perf_counter() - start
    result, triangles = meshset.get_arrays(ms)
    if len(result) != len(vertices) or len(triangles) != len(faces):
        raise FilterFailed(
            f"made {len(result)} vertices and {len(triangles)} faces of {len(vertices)} and {len(faces)}"
        )
    if not np.isfinite(result).all():
        raise FilterFailed("diverged: coordinates are not finite")
    kept = {key: value for key, value in output.items() if isinstance(value, bool | int | float | str)}
    return FilterRun(result, kept, seconds)


class FilterProcess(Worker):
    """A process that runs filters on one mesh; a context manager, which ends it.

    Parameters
    ----------
    faces : (m, 3) int32
    timeout : float
        Seconds after which a run is given up and the process killed.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.meshlab.isolated_filter import FilterProcess
    >>> V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]])
    >>> with FilterProcess(F) as process:
    ...     process.run(V, "apply_coord_laplacian_smoothing", {}).vertices.shape
    (4, 3)
    """

    def __init__(self, faces: Integers, timeout: float = 900.0) -> None:
        super().__init__(processes.command(serve_filters))
        self._faces = faces
        self._timeout = timeout
        self._warm: set[str] = set()

    def run(self, vertices: Floats, name: str, parameters: Mapping[str, Any], times: int = 1) -> FilterRun:
        """Run a filter as :func:`run` does; a process that crashed or took too long is a :class:`FilterFailed` too.

        The first run of a filter in a process follows one on a small sphere, so that one-time loading and compilation
        are not timed.
        """
        if name not in self._warm:
            # a filter that fails there may well work on the mesh itself
            with contextlib.suppress(FilterFailed):
                self._run(None, name, parameters, 1)
            self._warm.add(name)
        return self._run(vertices, name, parameters, times)

    def _run(self, vertices: Floats | None, name: str, parameters: Mapping[str, Any], times: int) -> FilterRun:
        """Return the result of a run; on the small sphere if there are no vertices."""
        encoded = {key: encode_argument(value) for key, value in parameters.items()}
        mesh = None if vertices is None else (vertices, self._faces)
        try:
            answer = self.ask((mesh, name, encoded, times), self._timeout)
        except WorkerFailed as error:
            raise FilterFailed(str(error)) from error
        if isinstance(answer, str):
            raise FilterFailed(answer)
        return FilterRun(**answer)

    def end(self) -> None:
        """End the process, if there is one."""
        super().end()
        self._warm.clear()


def serve_filters() -> None:
    """Run filters for the process that started this one."""
    worker.serve(_answer)


def _answer(request: Any) -> object:
    mesh, name, parameters, times = request
    vertices, faces = mesh or make_sphere()
    decoded = {key: decode_argument(value) for key, value in parameters.items()}
    try:
        return vars(run(vertices, faces, name, decoded, times))
    except FilterFailed as error:
        return str(error)


def make_sphere() -> tuple[Floats, Integers]:
    """Return a small sphere with noise, but larger than the meshes for which the filters use other methods."""
    ms = pymeshlab.MeshSet()
    ms.create_sphere(subdiv=4)
    vertices, faces = meshset.get_arrays(ms)
    return vertices + 0.01 * np.random.default_rng(0).standard_normal(vertices.shape), faces


def encode_argument(value: Any) -> Any:
    """Return a filter's argument as JSON can represent it: a fraction of the diagonal becomes a dict."""
    return {"diagonals": value.fraction} if isinstance(value, Length) else value


def decode_argument(value: Any) -> Any:
    """Undo :func:`encode_argument`."""
    return Length(value["diagonals"]) if isinstance(value, dict) else value
