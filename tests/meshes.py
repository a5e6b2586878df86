"""Meshes made in code, each for the property that it has."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import hypothesis.strategies as st
import numpy as np
import numpy.typing as npt
import pymeshlab
from scipy.sparse import csr_array

from meshlab_specsmooth.geometry.surface import Surface, mean_edge_length, vertex_normals
from meshlab_specsmooth.graph.build import mesh_graph
from meshlab_specsmooth.graph.laplacian import Laplacian, laplacian
from meshlab_specsmooth.operators.assemble import assemble

Floats = npt.NDArray[np.float64]
Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]

TRIANGLE: Mesh = (np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]]))
TETRAHEDRON: Mesh = (
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)
# eigenvalues of the uniform Laplacian of a tetrahedron
TETRAHEDRON_SPECTRUM = np.array([0, 4 / 3, 4 / 3, 4 / 3])


def torus_graph(nx: int, ny: int) -> npt.NDArray[np.int64]:
    """Faces of a closed mesh on which every vertex (i, j) -> i * ny + j has the same six neighbors.

    Its uniform Laplacian is circulant, so its eigenvectors are plane waves: see :func:`torus_eigenvalue`.
    """
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))

    def at(a: npt.NDArray[np.int64], b: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        return (a % nx) * ny + b % ny

    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def torus_eigenvalue(p: int, q: int, nx: int, ny: int) -> float:
    """Eigenvalue of the wave exp(i (a x + b y)), a = 2 pi p / nx, b = 2 pi q / ny, on :func:`torus_graph`."""
    a, b = 2 * np.pi * p / nx, 2 * np.pi * q / ny
    return float(1 - (np.cos(a) + np.cos(b) + np.cos(a + b)) / 3)


def torus_spectrum(nx: int, ny: int) -> npt.NDArray[np.float64]:
    """All eigenvalues on :func:`torus_graph`, in ascending order."""
    a, b = 2 * np.pi * np.arange(nx)[:, None] / nx, 2 * np.pi * np.arange(ny) / ny
    return np.sort((1 - (np.cos(a) + np.cos(b) + np.cos(a + b)) / 3).ravel())


def wave(p: int, q: int, nx: int, ny: int) -> npt.NDArray[np.float64]:
    i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    return np.cos(2 * np.pi * (p * i / nx + q * j / ny)).ravel()


def torus(nx: int = 40, ny: int = 24) -> Mesh:
    """A torus in space, closed."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    t, p = 2 * np.pi * i / nx, 2 * np.pi * j / ny
    ring = 3 + np.cos(p)
    return np.stack([ring * np.cos(t), ring * np.sin(t), np.sin(p)], axis=1), torus_graph(nx, ny)


def sheet(nx: int = 12, ny: int = 9) -> Mesh:
    """A gently curved open sheet."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    V = np.stack([i, j, 0.05 * (i - 4.0) ** 2 + 0.5 * np.sin(0.8 * j)], axis=1).astype(float)
    a = (np.arange(nx - 1)[:, None] * ny + np.arange(ny - 1)).ravel()
    F = np.concatenate([np.stack([a, a + ny, a + ny + 1], axis=1), np.stack([a, a + ny + 1, a + 1], axis=1)])
    return V, F


def rough(mesh: Mesh, level: float = 0.2, seed: int = 0) -> Mesh:
    """With noise of ``level`` mean edges."""
    V, F = mesh
    edge = np.linalg.norm(V[F[:, 0]] - V[F[:, 1]], axis=1).mean()
    return V + level * edge * np.random.default_rng(seed).standard_normal(V.shape), F


def box(n: int = 12) -> Mesh:
    """A cube with n squares along each edge, closed, each square cut in two."""
    grid = np.stack(np.meshgrid(*[np.arange(n + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    F = np.concatenate([np.stack([a, a + n + 1, a + n + 2], axis=1), np.stack([a, a + n + 2, a + 1], axis=1)])
    vertices: list[npt.NDArray[np.int64]] = []
    sides: list[npt.NDArray[np.int64]] = []
    for axis in range(3):
        for end in (0, n):
            V = np.insert(grid, axis, end, axis=1)
            outwards = (axis != 1) == (end == n)
            sides.append((F if outwards else F[:, ::-1]) + sum(map(len, vertices)))
            vertices.append(V)
    V, inverse = np.unique(np.concatenate(vertices), axis=0, return_inverse=True)
    return V.astype(float), inverse.ravel()[np.concatenate(sides)]


@functools.cache
def remeshed_box(n: int = 24) -> Mesh:
    """A cube's surface in triangles nearly equilateral, n along an edge: sharp edges, closed."""
    ms = pymeshlab.MeshSet()
    ms.create_cube(size=1.0)
    ms.meshing_isotropic_explicit_remeshing(iterations=6, targetlen=pymeshlab.PureValue(1 / n), featuredeg=30)
    mesh = ms.current_mesh()
    return np.ascontiguousarray(mesh.vertex_matrix()), mesh.face_matrix().astype(np.int64)


def edge_of(V: Floats, F: npt.NDArray[np.int64]) -> float:
    """Mean length of its edges, each counted once."""
    return mean_edge_length(Surface(V, F))


def noisy(mesh: Mesh, level: float, seed: int = 0) -> Mesh:
    """With noise in all directions, of ``level`` mean edges of :func:`edge_of`."""
    V, F = mesh
    return V + level * edge_of(V, F) * np.random.default_rng(seed).standard_normal(V.shape), F


def impulses(rng: np.random.Generator, n: int) -> Floats:
    """Of every fifth vertex."""
    return np.where(rng.random(n) < 0.2, 0.6, 0.0) * rng.standard_normal(n)


def kinds_of_noise(mesh: Mesh) -> Iterator[tuple[str, Floats]]:
    """The kinds that are not white, each with the vertices of a mesh that has it."""
    V, F = mesh
    normals = vertex_normals(Surface(V, F))
    edge, n, rng = edge_of(V, F), len(V), np.random.default_rng(3)
    yield "impulse", V + normals * (edge * impulses(rng, n))[:, None]
    yield "directional", V + [0, 0, 1] * (0.3 * edge * rng.standard_normal(n))[:, None]
    step = 0.35 * edge
    yield "quantized", np.round(V / step) * step
    walk = assemble(V, F).L
    field = rng.standard_normal((n, 3))
    for _ in range(3):
        field -= 6 / 7 * (walk @ field)
    yield "correlated", V + normals * (0.3 * edge * field[:, :1] / field[:, :1].std())


def together(*meshes: Mesh) -> Mesh:
    """Several meshes as the components of one."""
    vertices, faces, offset = [], [], 0
    for V, F in meshes:
        vertices.append(V)
        faces.append(F + offset)
        offset += len(V)
    return np.concatenate(vertices), np.concatenate(faces)


def flaws(mesh: Mesh) -> dict[str, Mesh]:
    """The mesh with what real files have: each is accepted and must give a finite result."""
    V, F = mesh
    n = len(V)
    more = np.concatenate([V, V[:3] + 0.5])
    turned = F.copy()
    turned[::2] = turned[::2, ::-1]
    return {
        "unreferenced vertices": (np.concatenate([V[:1] + 9, V, V[:2] - 9]), F + 1),
        "degenerate faces": (V, np.concatenate([F, [[0, 0, 0], [1, 1, 2], [3, 4, 3]]])),
        "a vertex of degenerate faces alone": (more[: n + 1], np.concatenate([F, [[n, n, n]]])),
        "duplicate faces": (V, np.concatenate([F, F[:5], F[:5]])),
        "a non-manifold edge": (more[: n + 1], np.concatenate([F, [[F[0, 0], F[0, 1], n]]])),
        "a non-manifold vertex": (more[: n + 2], np.concatenate([F, [[F[0, 0], n, n + 1]]])),
        "several components": together(mesh, (V + 20, F), TETRAHEDRON),
        "inconsistent orientation": (V, turned),
        "coincident vertices": (np.concatenate([V[:1], V[:1], V[2:]]), F),
    }


def uniform(mesh: Mesh) -> Laplacian:
    """The uniform Laplacian of a mesh; every vertex must have an edge."""
    V, F = mesh
    return laplacian(mesh_graph(F.astype(np.int32), len(V)).graph)


def twin(mesh: Mesh) -> csr_array:
    """Its symmetric twin, as a matrix."""
    return uniform(mesh).graph.symmetric_laplacian()


@st.composite
def meshes(draw: st.DrawFn) -> Mesh:
    """Any arrays that the gate accepts, well shaped or not."""
    n = draw(st.integers(1, 12))
    coordinate = st.floats(-100, 100, allow_nan=False, width=32)
    V = np.array(draw(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=n, max_size=n)), dtype=float)
    index = st.integers(0, n - 1)
    F = np.array(draw(st.lists(st.tuples(index, index, index), min_size=1, max_size=16)), dtype=np.int64)
    return V, F
