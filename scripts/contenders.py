"""What benchmark_quality.py runs: MeshLab's smoothing filters, the paper's method, ours, and peers from PyPI.

A further method is a further row in MESHLAB, PAPER, OURS or PEERS.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pymeshlab

import meshlab_specsmooth as mss
from meshlab_specsmooth.arrays import Floats, Integers

Setting = dict[str, Any]
Run = Callable[..., Floats]


@dataclass(frozen=True)
class Contender:
    """A filter of arrays.

    Attributes
    ----------
    name, group : str
        Of the groups "MeshLab", "paper", "ours", "peer"; all but ours are tuned on the ground truth.
    run : callable
        ``run(vertices, faces, **setting) -> vertices``.
    default : dict, optional
        What it runs with where nobody tunes it.
    grid : dict
        Values of each parameter, tried in all combinations on the ground truth; empty where nothing is tuned.
    """

    name: str
    group: str
    run: Run
    default: "Setting | None" = field(default_factory=dict)
    grid: "dict[str, tuple[Any, ...]]" = field(default_factory=dict)

    def settings(self) -> "Iterator[Setting]":
        """All of the grid."""
        if self.grid:
            for values in itertools.product(*self.grid.values()):
                yield dict(zip(self.grid, values, strict=True))


# --- MeshLab's; left out: the two MLS projections, which crash the process, and what sharpens or changes the faces ---


def meshlab(name: str, **fixed: Any) -> Run:
    """A filter on a MeshSet of its own."""

    def run(vertices: Floats, faces: Integers, times: int = 1, **setting: Any) -> Floats:
        ms = pymeshlab.MeshSet()
        ms.add_mesh(pymeshlab.Mesh(vertices, faces))
        # MeshLab keeps some values for the next call: the defaults are told too
        for _ in range(times):
            ms.apply_filter(name, **(fixed | setting))
        return ms.current_mesh().vertex_matrix()

    return run


def taubin(vertices: Floats, faces: Integers, lambda_: float, pass_band: float, steps: int) -> Floats:
    """By its pass band k = 1 / lambda + 1 / mu."""
    run = meshlab("apply_coord_taubin_smoothing")
    return run(vertices, faces, lambda_=lambda_, mu=1 / (pass_band - 1 / lambda_), stepsmoothnum=steps)


def scale_dependent(vertices: Floats, faces: Integers, steps: int, percent: float) -> Floats:
    run = meshlab("apply_coord_laplacian_smoothing_scale_dependent")
    return run(vertices, faces, stepsmoothnum=steps, delta=pymeshlab.PercentageValue(percent))


def depth(vertices: Floats, faces: Integers, steps: int, far: float) -> Floats:
    """Looked at along -z, from so many diagonals above the middle."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    eye = (low + high) / 2 + far * np.linalg.norm(high - low) * np.array([0.0, 0.0, 1.0])
    return meshlab("apply_coord_depth_smoothing")(vertices, faces, stepsmoothnum=steps, viewpoint=eye)


_LAPLACIAN = "apply_coord_laplacian_smoothing"
_STEPS = (1, 2, 3, 5, 8, 13, 20, 35)

MESHLAB = [
    Contender(
        "Laplacian, cotangent", "MeshLab", meshlab(_LAPLACIAN, cotangentweight=True), {}, {"stepsmoothnum": _STEPS}
    ),
    Contender(
        "Laplacian, umbrella", "MeshLab", meshlab(_LAPLACIAN, cotangentweight=False), {}, {"stepsmoothnum": _STEPS}
    ),
    Contender(
        "Taubin",
        "MeshLab",
        taubin,
        {"lambda_": 0.5, "pass_band": 2 - 1 / 0.53, "steps": 10},
        {"lambda_": (0.5, 0.7), "pass_band": (0.01, 0.03, 0.1, 0.2), "steps": (2, 5, 10, 20, 40, 80, 160)},
    ),
    Contender("HC", "MeshLab", meshlab("apply_coord_hc_laplacian_smoothing"), {}, {"times": (1, 2, 3, 5, 8, 13, 20)}),
    Contender(
        "two-step",
        "MeshLab",
        meshlab("apply_coord_two_steps_smoothing"),
        {},
        {"stepsmoothnum": (1, 2, 3, 5, 10), "normalthr": (15, 30, 60, 90), "stepnormalnum": (5, 20)},
    ),
    Contender(
        "scale-dependent",
        "MeshLab",
        scale_dependent,
        {"steps": 3, "percent": 1.0},
        {"steps": (1, 3, 10), "percent": (0.01, 0.03, 0.1, 0.3, 1.0)},
    ),
    Contender(
        "surface-preserving",
        "MeshLab",
        meshlab("apply_coord_laplacian_smoothing_surface_preserving"),
        {},
        {"angledeg": (0.5, 5, 20, 60), "iterations": (1, 2, 5, 10, 20)},
    ),
    Contender("depth", "MeshLab", depth, {"steps": 3, "far": 10}, {"steps": (1, 2, 3, 5, 8, 13, 20), "far": (10,)}),
]

# --- the paper's ---


def paper(vertices: Floats, faces: Integers, w: float, modes: int = 0, share: float = 0.0) -> Floats:
    """A number of modes, or a share of all."""
    count = min(modes or max(1, round(share * len(vertices))), len(vertices))
    return mss.smooth(vertices, faces, modes=count, barycenter_weight=w, response="ideal").vertices


PAPER = [
    Contender(
        "paper",
        "paper",
        paper,
        {"w": 1.0, "modes": 200},
        {"w": (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.04, 0.02), "share": (0.003, 0.01, 0.03, 0.06)},
    )
]

# --- ours, without any parameter ---


def ours(name: str, **given: Any) -> Run:
    return lambda vertices, faces: getattr(mss, name)(vertices, faces, **given).vertices


OURS = [
    Contender(title, "ours", ours(name, **given))
    for title, name, given in (
        ("ours: smooth", "smooth", {}),
        ("ours: edge-aware", "smooth_edge_aware", {}),
        ("ours: denoise", "denoise", {}),
        ("ours: denoise, normals", "denoise", {"criterion": "normals"}),
    )
    if hasattr(mss, name)
]

# --- of other packages, on demand ---

# module: what pip is asked for
PEER_PACKAGES = {"trimesh": "trimesh>=4", "open3d": "open3d>=0.18", "meshlib": "meshlib>=3"}


def windowed_sinc(vertices: Floats, faces: Integers, **setting: Any) -> Floats:
    import pyvista

    mesh = pyvista.PolyData.from_regular_faces(vertices, faces)
    return np.array(mesh.smooth_taubin(normalize_coordinates=True, **setting).points, dtype=np.float64)


def trimesh(name: str) -> Run:
    def run(vertices: Floats, faces: Integers, **setting: Any) -> Floats:
        import trimesh

        mesh = trimesh.Trimesh(vertices, faces, process=False)
        return np.array(getattr(trimesh.smoothing, name)(mesh, **setting).vertices)

    return run


def open3d(name: str) -> Run:
    def run(vertices: Floats, faces: Integers, **setting: Any) -> Floats:
        import open3d

        # of copies: it takes no read-only arrays
        places, corners = open3d.utility.Vector3dVector(vertices.copy()), open3d.utility.Vector3iVector(faces.copy())
        mesh = open3d.geometry.TriangleMesh(places, corners)
        return np.array(getattr(mesh, name)(**setting).vertices)

    return run


def meshlib(vertices: Floats, faces: Integers, **setting: Any) -> Floats:
    """In single precision, which is all that it has."""
    from meshlib import mrmeshnumpy, mrmeshpy

    settings = mrmeshpy.DenoiseViaNormalsSettings()
    for name, value in setting.items():
        setattr(settings, name, value)
    mesh = mrmeshnumpy.meshFromFacesVerts(faces, vertices)
    mrmeshpy.meshDenoiseViaNormals(mesh, settings)
    return np.array(mrmeshnumpy.getNumpyVerts(mesh), dtype=np.float64)[: len(vertices)]


PEERS = [
    Contender(
        "pyvista windowed sinc",
        "peer",
        windowed_sinc,
        {},
        {"n_iter": (10, 20, 50, 100), "pass_band": (0.01, 0.03, 0.1, 0.3, 1.0)},
    ),
    Contender(
        "trimesh Taubin",
        "peer",
        trimesh("filter_taubin"),
        {},
        {"lamb": (0.5,), "nu": (0.5, 0.52), "iterations": (2, 5, 10, 20, 40, 80)},
    ),
    Contender(
        "trimesh Humphrey",
        "peer",
        trimesh("filter_humphrey"),
        {},
        {"alpha": (0.0, 0.1, 0.3), "beta": (0.3, 0.5, 0.7), "iterations": (3, 10, 30)},
    ),
    Contender(
        "Open3D Taubin",
        "peer",
        open3d("filter_smooth_taubin"),
        {"number_of_iterations": 10},
        {"number_of_iterations": (2, 5, 10, 20, 40, 80)},
    ),
    Contender(
        "Open3D Laplacian",
        "peer",
        open3d("filter_smooth_laplacian"),
        {"number_of_iterations": 3},
        {"number_of_iterations": (1, 2, 3, 5, 8, 13), "lambda_filter": (0.5,)},
    ),
    Contender(
        "MeshLib normals",
        "peer",
        meshlib,
        {},
        {"beta": (0.001, 0.01, 0.1), "gamma": (5.0, 20.0, 80.0), "normalIters": (10,), "pointIters": (5, 20)},
    ),
]


# --- where it only matters that all of it runs ---


def coarse(contender: Contender) -> Contender:
    """With no more than two values of a parameter."""
    return replace(contender, grid={name: values[:2] for name, values in contender.grid.items()})
