"""The filters of benchmark_quality.py, with the settings that are tried to tune them on the ground truth.

MeshLab's filters, the paper's method and this package's filters are those of the catalog of the comparison
(`meshlab_specsmooth/comparison/filter_specs.py`); filters of other packages are defined here. A further filter is a
further row in MESHLAB, PAPER, OURS or PEERS.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import meshlab_specsmooth as mss
from meshlab_specsmooth.arrays import Floats, Integers
from meshlab_specsmooth.comparison.filter_specs import FILTER_SPECS, FilterSpec
from meshlab_specsmooth.meshlab import isolated_filter
from meshlab_specsmooth.meshlab.descriptors import Length

Setting = dict[str, Any]
Run = Callable[..., Floats]


@dataclass(frozen=True)
class TunedFilter:
    """A filter of arrays, with the settings to try.

    Attributes
    ----------
    name, group : str
        The groups are "MeshLab", "paper", "ours" and "peer"; all but "ours" are tuned on the ground truth.
    run : callable
        ``run(vertices, faces, **setting) -> vertices``.
    default : dict, optional
        The setting without tuning; None to leave it out.
    grid : dict
        Values of each parameter, tried in all combinations; empty for no tuning.
    """

    name: str
    group: str
    run: Run
    default: "Setting | None" = field(default_factory=dict)
    grid: "dict[str, tuple[Any, ...]]" = field(default_factory=dict)

    def settings(self) -> "Iterator[Setting]":
        """All combinations of the grid."""
        if self.grid:
            for values in itertools.product(*self.grid.values()):
                yield dict(zip(self.grid, values, strict=True))


def on_meshset(spec: FilterSpec, to_parameters: "Callable[..., Setting] | None" = None) -> Run:
    """Run a filter of the catalog; ``to_parameters(vertices, **setting)`` translates settings into its parameters."""

    def run(vertices: Floats, faces: Integers, times: int = 1, **setting: Any) -> Floats:
        given = to_parameters(vertices, **setting) if to_parameters else setting
        return isolated_filter.run(vertices, faces, spec.filter, {**spec.parameters, **given}, times).vertices

    return run


# --- MeshLab's, without the MLS projections, which crash the process, and those that sharpen or change the faces ---


def tuned(
    spec: FilterSpec,
    grid: "dict[str, tuple[Any, ...]]",
    default: "Setting | None" = None,
    to_parameters: "Callable[..., Setting] | None" = None,
) -> TunedFilter:
    return TunedFilter(spec.name, "MeshLab", on_meshset(spec, to_parameters), default or {}, grid)


def taubin(vertices: Floats, lambda_: float, pass_band: float, steps: int) -> Setting:
    """By the pass band k = 1 / lambda + 1 / mu."""
    return {"lambda_": lambda_, "mu": 1 / (pass_band - 1 / lambda_), "stepsmoothnum": steps}


def scale_dependent(vertices: Floats, steps: int, percent: float) -> Setting:
    return {"stepsmoothnum": steps, "delta": Length(percent / 100)}


def depth(vertices: Floats, steps: int, distance: float) -> Setting:
    """Seen along -z, from a distance in diagonals of the bounding box above its center."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    eye = (low + high) / 2 + distance * np.linalg.norm(high - low) * np.array([0.0, 0.0, 1.0])
    return {"stepsmoothnum": steps, "viewpoint": eye}


_STEPS = (1, 2, 3, 5, 8, 13, 20, 35)

MESHLAB = [
    tuned(FILTER_SPECS["laplacian"], {"stepsmoothnum": _STEPS}),
    tuned(FILTER_SPECS["umbrella"], {"stepsmoothnum": _STEPS}),
    tuned(
        FILTER_SPECS["taubin"],
        {"lambda_": (0.5, 0.7), "pass_band": (0.01, 0.03, 0.1, 0.2), "steps": (2, 5, 10, 20, 40, 80, 160)},
        {"lambda_": 0.5, "pass_band": 2 - 1 / 0.53, "steps": 10},
        taubin,
    ),
    tuned(FILTER_SPECS["hc"], {"times": (1, 2, 3, 5, 8, 13, 20)}),
    tuned(
        FILTER_SPECS["two-step"],
        {"stepsmoothnum": (1, 2, 3, 5, 10), "normalthr": (15, 30, 60, 90), "stepnormalnum": (5, 20)},
    ),
    tuned(
        FILTER_SPECS["scale-dependent"],
        {"steps": (1, 3, 10), "percent": (0.01, 0.03, 0.1, 0.3, 1.0)},
        {"steps": 3, "percent": 1.0},
        scale_dependent,
    ),
    tuned(FILTER_SPECS["surface-preserving"], {"angledeg": (0.5, 5, 20, 60), "iterations": (1, 2, 5, 10, 20)}),
    tuned(
        FilterSpec("MeshLab depth", "apply_coord_depth_smoothing"),
        {"steps": (1, 2, 3, 5, 8, 13, 20), "distance": (10,)},
        {"steps": 3, "distance": 10},
        depth,
    ),
]

# --- the paper's method ---


def paper(vertices: Floats, faces: Integers, w: float, modes: int = 0, fraction: float = 0.0) -> Floats:
    """With a number of modes, or a fraction of all modes."""
    count = min(modes or max(1, round(fraction * len(vertices))), len(vertices))
    return mss.smooth(vertices, faces, modes=count, barycenter_weight=w, response="ideal").vertices


PAPER = [
    TunedFilter(
        "paper",
        "paper",
        paper,
        {"w": 1.0, "modes": 200},
        {"w": (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.04, 0.02), "fraction": (0.003, 0.01, 0.03, 0.06)},
    )
]

# --- this package's, without any parameter ---


def ours(name: str, **given: Any) -> Run:
    return lambda vertices, faces: getattr(mss, name)(vertices, faces, **given).vertices


OURS = [
    TunedFilter(FILTER_SPECS["automatic"].name, "ours", ours("smooth")),
    TunedFilter(FILTER_SPECS["edge-aware"].name, "ours", ours("smooth_edge_aware")),
    TunedFilter(FILTER_SPECS["denoise"].name, "ours", ours("denoise")),
]

# --- other packages, on demand ---

# module: requirement for pip
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

        # copies, because it rejects read-only arrays
        places, corners = open3d.utility.Vector3dVector(vertices.copy()), open3d.utility.Vector3iVector(faces.copy())
        mesh = open3d.geometry.TriangleMesh(places, corners)
        return np.array(getattr(mesh, name)(**setting).vertices)

    return run


def meshlib(vertices: Floats, faces: Integers, **setting: Any) -> Floats:
    """MeshLib works in single precision."""
    from meshlib import mrmeshnumpy, mrmeshpy

    settings = mrmeshpy.DenoiseViaNormalsSettings()
    for name, value in setting.items():
        setattr(settings, name, value)
    mesh = mrmeshnumpy.meshFromFacesVerts(faces, vertices)
    mrmeshpy.meshDenoiseViaNormals(mesh, settings)
    return np.array(mrmeshnumpy.getNumpyVerts(mesh), dtype=np.float64)[: len(vertices)]


PEERS = [
    TunedFilter(
        "pyvista windowed sinc",
        "peer",
        windowed_sinc,
        {},
        {"n_iter": (10, 20, 50, 100), "pass_band": (0.01, 0.03, 0.1, 0.3, 1.0)},
    ),
    TunedFilter(
        "trimesh Taubin",
        "peer",
        trimesh("filter_taubin"),
        {},
        {"lamb": (0.5,), "nu": (0.5, 0.52), "iterations": (2, 5, 10, 20, 40, 80)},
    ),
    TunedFilter(
        "trimesh Humphrey",
        "peer",
        trimesh("filter_humphrey"),
        {},
        {"alpha": (0.0, 0.1, 0.3), "beta": (0.3, 0.5, 0.7), "iterations": (3, 10, 30)},
    ),
    TunedFilter(
        "Open3D Taubin",
        "peer",
        open3d("filter_smooth_taubin"),
        {"number_of_iterations": 10},
        {"number_of_iterations": (2, 5, 10, 20, 40, 80)},
    ),
    TunedFilter(
        "Open3D Laplacian",
        "peer",
        open3d("filter_smooth_laplacian"),
        {"number_of_iterations": 3},
        {"number_of_iterations": (1, 2, 3, 5, 8, 13), "lambda_filter": (0.5,)},
    ),
    TunedFilter(
        "MeshLib normals",
        "peer",
        meshlib,
        {},
        {"beta": (0.001, 0.01, 0.1), "gamma": (5.0, 20.0, 80.0), "normalIters": (10,), "pointIters": (5, 20)},
    ),
]


# --- for a test run ---


def coarse(each: TunedFilter) -> TunedFilter:
    """The filter with at most two values of each parameter."""
    return replace(each, grid={name: values[:2] for name, values in each.grid.items()})
