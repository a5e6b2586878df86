"""Smoothing filters of other libraries, arrays to arrays, and the errors of a smoothed torus.

Libraries that are not installed are left out.
"""

import importlib.util
from collections.abc import Callable

import numpy as np

from meshlab_specsmooth.geometry.surface import Surface

Filter = Callable[[np.ndarray, np.ndarray], np.ndarray]

RING, TUBE = 3.0, 1.0  # radii


def torus(vertices: int) -> Surface:
    """An irregular torus, a random diagonal in each quad, with about this number of vertices."""
    nx, ny = round((1.5625 * vertices) ** 0.5), round((vertices / 1.5625) ** 0.5)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    t, p = 2 * np.pi * i / nx, 2 * np.pi * j / ny
    ring = RING + TUBE * np.cos(p)
    V = np.stack([ring * np.cos(t), ring * np.sin(t), TUBE * np.sin(p)], axis=1)
    a, b, c, d = (((i + k) % nx * ny + (j + m) % ny) for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
    one = np.random.default_rng(11).random(len(a)) < 0.5
    F = np.concatenate(
        [np.stack(x, axis=1)[y] for x, y in (((a, b, c), one), ((a, c, d), one), ((a, b, d), ~one), ((b, c, d), ~one))]
    )
    return Surface(V, F)


def errors(X: np.ndarray, clean: Surface) -> "tuple[float, float]":
    """Theta, the mean angle between normals of faces in degrees, and E_v, the distance to the torus in mean edges.

    E_v is the root mean square over the vertices, weighted with the areas at them (Sun et al. 2007).
    """
    F = clean.faces
    normals = [np.cross(Y[F[:, 1]] - Y[F[:, 0]], Y[F[:, 2]] - Y[F[:, 0]]) for Y in (X, clean.vertices)]
    lengths = [np.linalg.norm(n, axis=1) for n in normals]
    product = np.einsum("ij,ij->i", *normals) / np.maximum(lengths[0] * lengths[1], np.finfo(float).tiny)
    theta = float(np.degrees(np.arccos(np.clip(product, -1, 1))).mean())
    area = np.bincount(F.ravel(), np.repeat(lengths[0], 3), len(X))
    distance = np.abs(np.hypot(np.hypot(X[:, 0], X[:, 1]) - RING, X[:, 2]) - TUBE)
    edge = np.linalg.norm(clean.vertices[F[:, 0]] - clean.vertices[F[:, 1]], axis=1).mean()
    return theta, float(np.sqrt((area * distance**2).sum() / area.sum()) / edge)


def windowed_sinc(iterations: int = 20, pass_band: float = 0.1) -> Filter:
    """VTK's windowed sinc, through PyVista."""
    import pyvista

    def smooth(V: np.ndarray, F: np.ndarray) -> np.ndarray:
        mesh = pyvista.PolyData.from_regular_faces(V, F)
        return np.asarray(mesh.smooth_taubin(n_iter=iterations, pass_band=pass_band).points)

    return smooth


def relax(iterations: int = 5, name: str = "relax") -> Filter:
    """MeshLib's relax or relaxKeepVolume."""
    from meshlib import mrmeshnumpy, mrmeshpy

    def smooth(V: np.ndarray, F: np.ndarray) -> np.ndarray:
        mesh, parameters = mrmeshnumpy.meshFromFacesVerts(F, V), mrmeshpy.MeshRelaxParams()
        parameters.iterations = iterations
        getattr(mrmeshpy, name)(mesh, parameters)
        return np.asarray(mrmeshnumpy.getNumpyVerts(mesh))

    return smooth


def trimesh_taubin(iterations: int = 10) -> Filter:
    """Taubin's filter of trimesh."""
    import trimesh

    def smooth(V: np.ndarray, F: np.ndarray) -> np.ndarray:
        mesh = trimesh.Trimesh(V, F, process=False)
        return np.asarray(trimesh.smoothing.filter_taubin(mesh, iterations=iterations).vertices)

    return smooth


def meshlab(name: str, steps: int) -> Filter:
    """A filter of MeshLab, with making the MeshSet and reading the result."""
    import pymeshlab

    def smooth(V: np.ndarray, F: np.ndarray) -> np.ndarray:
        ms = pymeshlab.MeshSet(verbose=False)
        ms.add_mesh(pymeshlab.Mesh(V, F))
        ms.apply_filter(name, stepsmoothnum=steps)
        return np.array(ms.current_mesh().vertex_matrix())

    return smooth


def has(name: str) -> bool:
    """Whether a library is installed."""
    return importlib.util.find_spec(name) is not None


def defaults() -> "dict[str, Filter]":
    """The filters that are compared with, as people call them."""
    found = {}
    if has("pyvista"):
        found["windowed_sinc"] = windowed_sinc()
    if has("meshlib"):
        found["relax"] = relax()
        found["relax_keep_volume"] = relax(name="relaxKeepVolume")
    return found


def strengths() -> "dict[tuple[str, str], Filter]":
    """Filters at several strengths, by name and strength."""
    found = {}
    for steps in (3, 10, 30):
        found["MeshLab Taubin", f"{steps}"] = meshlab("apply_coord_taubin_smoothing", steps)
    for steps in (1, 3, 10):
        found["MeshLab Laplacian", f"{steps}"] = meshlab("apply_coord_laplacian_smoothing", steps)
    if has("pyvista"):
        for iterations, band in ((20, 0.1), (20, 0.03), (50, 0.02), (100, 0.01)):
            found["VTK windowed sinc", f"{iterations}, {band:g}"] = windowed_sinc(iterations, band)
    if has("meshlib"):
        for iterations in (2, 5, 10, 20, 40):
            found["MeshLib relax", f"{iterations}"] = relax(iterations)
        for iterations in (5, 20):
            found["MeshLib relaxKeepVolume", f"{iterations}"] = relax(iterations, "relaxKeepVolume")
    if has("trimesh"):
        for iterations in (10, 30):
            found["trimesh Taubin", f"{iterations}"] = trimesh_taubin(iterations)
    return found
