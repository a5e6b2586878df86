"""Filters in a process of their own, so that one that crashes does not take the caller with it.

Some of MeshLab's filters end the process on some meshes (the MLS projections do). A :class:`Child` holds one mesh's
faces, runs filters on any positions of its vertices, and says when it died; the next run starts another.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.errors import FilterFailed
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.meshlab import filters, meshset
from meshlab_specsmooth.meshlab.descriptors import Length


@dataclass(frozen=True, eq=False)
class Ran:
    """What a filter made of a mesh.

    Attributes
    ----------
    vertices : (n, 3) float64
    output : dict
        Numbers, texts and truths that the filter returned.
    seconds : float
        Of the filter alone, on a mesh that was in its MeshSet already.
    """

    vertices: Floats
    output: dict[str, Any]
    seconds: float


def run(vertices: Floats, faces: Integers, name: str, parameters: Mapping[str, Any], times: int = 1) -> Ran:
    """Run a filter so many times in succession, in this process.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int32
    name : str
        One of ours, or one of MeshLab's.
    parameters : mapping
        A :class:`~meshlab_specsmooth.meshlab.descriptors.Length` is a share of the bounding box's diagonal.
    times : int

    Raises
    ------
    FilterFailed
        It raised something, changed the number of vertices or faces, or diverged.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.isolation import child
    >>> V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]])
    >>> child.run(V, F, "apply_coord_taubin_smoothing", {}).vertices.shape
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
        for _ in range(times):
            output = filters.apply(ms, name, **given)
    except Exception as error:
        raise FilterFailed(" ".join(str(error).split()) or type(error).__name__) from error
    seconds = time.perf_counter() - start
    result, left = meshset.get_arrays(ms)
    if len(result) != len(vertices) or len(left) != len(faces):
        raise FilterFailed(f"it made {len(result)} vertices and {len(left)} faces of {len(vertices)} and {len(faces)}")
    if not np.isfinite(result).all():
        raise FilterFailed("diverged: coordinates are not finite")
    kept = {key: value for key, value in output.items() if isinstance(value, bool | int | float | str)}
    return Ran(result, kept, seconds)


class Child:
    """A process that runs filters on one mesh; a context manager, which ends it.

    Parameters
    ----------
    faces : (m, 3) int32
    patience : float
        Seconds after which a run is given up.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.isolation.child import Child
    >>> V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]])
    >>> with Child(F) as child:
    ...     child.run(V, "apply_coord_laplacian_smoothing", {}).vertices.shape
    (4, 3)
    """

    def __init__(self, faces: Integers, patience: float = 900.0) -> None:
        self._faces = faces
        self._patience = patience
        self._process: subprocess.Popen[bytes] | None = None
        self._warm: set[str] = set()

    def __enter__(self) -> Child:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    def run(self, vertices: Floats, name: str, parameters: Mapping[str, Any], times: int = 1) -> Ran:
        """As :func:`run`; a process that died or took too long is a :class:`FilterFailed` too.

        The first run of a filter in a process comes after one on a small sphere, so that what is loaded or compiled at
        a first call is in no run's time.
        """
        if name not in self._warm:
            # what fails there may well work on the mesh itself
            with contextlib.suppress(FilterFailed):
                self._asked(None, name, parameters, 1)
            self._warm.add(name)
        return self._asked(vertices, name, parameters, times)

    def _asked(self, vertices: Floats | None, name: str, parameters: Mapping[str, Any], times: int) -> Ran:
        """What the process answers; without vertices, for the small sphere."""
        process = self._started()
        late = threading.Event()

        def give_up() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(self._patience, give_up)
        timer.start()
        try:
            _write(process.stdin, (vertices, name, dict(parameters), times))
            answer = _read(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            code = process.wait()
            self.end()
            raise FilterFailed(f"took more than {self._patience:g} s" if late.is_set() else _death(code)) from error
        except BaseException:  # an interrupt: an answer is still to come, and would be taken for the next one's
            self.end()
            raise
        finally:
            timer.cancel()
        if isinstance(answer, str):
            raise FilterFailed(answer)
        assert isinstance(answer, Ran)  # noqa: S101 (for the type checker; the other end is below)
        return answer

    def end(self) -> None:
        """End the process, if there is one."""
        process, self._process = self._process, None
        self._warm.clear()
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):  # what was not written yet
                    pipe.close()

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            self._process = subprocess.Popen(  # noqa: S603 (our own module)
                processes.command(main),
                env=processes.environment(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
            with contextlib.suppress(OSError):  # it is told at the answer
                _write(self._process.stdin, self._faces)
        return self._process


def _death(code: int) -> str:
    if code >= 0:
        return f"crashed: its process ended with code {code}"
    try:
        return f"crashed: its process died of {signal.Signals(-code).name}"
    except ValueError:
        return f"crashed: its process died of signal {-code}"


def _write(pipe: Any, message: object) -> None:
    pickle.dump(message, pipe, protocol=5)
    pipe.flush()


def _read(pipe: Any) -> object:
    return pickle.load(pipe)  # noqa: S301 (from our own child, or our own parent)


def _sphere() -> tuple[Floats, Integers]:
    """Small, but larger than what is treated by other methods than large meshes are; with noise to be recognized."""
    ms = pymeshlab.MeshSet()
    ms.create_sphere(subdiv=4)
    vertices, faces = meshset.get_arrays(ms)
    return vertices + 0.01 * np.random.default_rng(0).standard_normal(vertices.shape), faces


def _serve(source: BinaryIO, sink: BinaryIO) -> None:
    """Answer runs until there are no more."""
    faces: Any = _read(source)
    while True:
        try:
            job: Any = _read(source)
        except EOFError:
            return
        try:
            vertices, name, parameters, times = job
            V, F = _sphere() if vertices is None else (vertices, faces)
            _write(sink, run(V, F, name, parameters, times))
        except FilterFailed as error:
            _write(sink, str(error))


def main() -> None:
    """Serve the process that started this one; what filters print goes nowhere."""
    with os.fdopen(os.dup(0), "rb") as source, os.fdopen(os.dup(1), "wb") as sink:
        os.dup2(2, 1)
        _serve(source, sink)
