"""The mesh as a graph, and the hot loop: everything that sweeps over all edges.

``build.py`` makes the graph of a mesh, ``order.py`` puts neighbors near each other in memory, ``laplacian.py`` is the
operator, and what a sweep does is said in ``kernels.py`` and done twice: by scipy's sparse product in ``reference.py``
and, with the extra ``fast``, in one pass over indices alone in ``compiled.py``.
"""
