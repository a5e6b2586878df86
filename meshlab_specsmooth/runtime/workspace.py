"""Work arrays that are reused from one step or call to the next."""

from __future__ import annotations

from collections import deque

import numpy as np

from meshlab_specsmooth.arrays import Floats


class Workspace:
    """Arrays that are no longer needed, to be overwritten instead of allocating new ones.

    The system clears new memory page by page, which takes a quarter of the time on large meshes. A workspace is passed
    to whatever needs work arrays. Calls in several threads can share one: every array is borrowed by one of them only.

    Parameters
    ----------
    max_arrays : int
        More than this are not kept.

    Examples
    --------
    >>> import numpy as np
    >>> from meshlab_specsmooth.runtime.workspace import Workspace
    >>> X, workspace = np.zeros((4, 3)), Workspace()
    >>> work = workspace.borrow(X)
    >>> workspace.give_back(work)
    >>> workspace.borrow(X) is work
    True
    """

    def __init__(self, max_arrays: int = 8) -> None:
        self._arrays: deque[Floats] = deque(maxlen=max_arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def borrow(self, like: Floats) -> Floats:
        """An array of the shape of ``like``, with arbitrary content."""
        try:
            while (array := self._arrays.pop()).shape != like.shape:
                pass  # of another mesh
        except IndexError:  # checking the length first would not do: another thread may borrow in between
            return np.empty_like(like)
        return array

    def give_back(self, *arrays: Floats) -> None:
        """Take arrays that nothing refers to any more."""
        self._arrays.extend(arrays)
