"""The mesh as a graph of vertices or of faces, and the kernels that loop over all edges.

``adjacency.py`` and ``face_adjacency.py`` define the graphs, ``protocols.py`` what the kernels compute. Everything is
implemented twice, with scipy (``*_scipy.py``, the reference) and compiled with numba (``*_numba.py``, with the extra
``fast``); ``backend.py`` chooses. ``build.py`` makes graphs and ``laplacian.py`` the operator.
"""
