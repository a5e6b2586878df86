"""Pieces of a large mesh, which the search runs on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.edge_aware.mesh import Mesh, built
from meshlab_specsmooth.edge_aware.regions import ENOUGH
from meshlab_specsmooth.graph.faces import FaceGraph, face_graph
from meshlab_specsmooth.surface import Integers

# The search runs on all faces of a mesh up to so many, else on some pieces.
_SEARCHED_FACES = 14_000
_PIECES = 4
_PIECE_FACES = 2_000
_MARGIN = 3  # rings of a piece's rim that do not count


def sample_of(mesh: Mesh) -> Mesh:
    """The mesh, or some connected pieces of it, grown from faces drawn at random, as one mesh."""
    if len(mesh.F) <= _SEARCHED_FACES:
        return mesh
    rng = np.random.default_rng(3)
    # pieces reach across creases, so that these are no rims of theirs
    graph = mesh.graph if mesh.cut is None else face_graph(mesh.F, len(mesh.V))
    judged = np.flatnonzero(mesh.counts[mesh.F].any(axis=1))
    taken = np.zeros(graph.size, dtype=np.bool_)
    counted = np.zeros(graph.size, dtype=np.bool_)
    for seed in judged[rng.permutation(len(judged))[:_PIECES]]:
        rings = [np.array([seed])]
        taken_here = np.zeros(graph.size, dtype=np.bool_)
        taken_here[seed] = True
        total = 1
        while total < _PIECE_FACES:
            ring = _ring(graph, rings[-1])
            ring = np.unique(ring[~taken_here[ring]])
            if len(ring) == 0:
                break
            taken_here[ring] = True
            rings.append(ring)
            total += len(ring)
        whole = total < _PIECE_FACES
        inner = rings if whole else rings[: max(len(rings) - _MARGIN, 1)]
        counted[np.concatenate(inner)] = True
        taken |= taken_here
    faces = mesh.F[taken]
    counts = np.zeros(len(mesh.V), dtype=np.bool_)
    counts[mesh.F[counted].ravel()] = True
    within = counts & mesh.counts
    if within.sum() >= ENOUGH:
        counts = within
    vertices, local = np.unique(faces, return_inverse=True)
    creases = None if mesh.cut is None else _among(vertices, mesh.cut.edges)
    return built(mesh.V[vertices], local.reshape(-1, 3).astype(np.int32), counts[vertices], creases=creases)


def _among(vertices: Integers, edges: Integers) -> Integers:
    """The edges between some vertices, by their numbers among these, which rise."""
    kept = edges[np.isin(edges, vertices).all(axis=1)]
    return np.searchsorted(vertices, kept).astype(np.int32)


def _ring(graph: FaceGraph, faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """All neighbours of the given faces, with repetitions."""
    first, count = graph.indptr[faces], np.diff(graph.indptr)[faces]
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(graph.indices[np.repeat(first, count) + offset], dtype=np.int64)
