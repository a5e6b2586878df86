"""Synthetic surfaces and noisy versions of them, the default input of benchmark_quality.py.

Each shape has a property to test: sharp edges, smooth parts, both, uneven triangles, an open boundary.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pymeshlab

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison import noise
from meshlab_specsmooth.geometry.surface import Surface, mean_edge_length
from meshlab_specsmooth.meshlab.mesh_files import sample

# --- shapes with about a given number of vertices ---


def block(vertices: int) -> Surface:
    """Sharp: a box with a round hole."""
    return remeshed(cut(box((2, 1.4, 1)), rod(0.35, 2.0)), vertices)


def star(vertices: int) -> Surface:
    """Sharp: a bar with a star-shaped section, with ridges and grooves of several angles."""
    return remeshed(rod(np.array([1.0, 0.45, 0.8, 0.6, 1.0, 0.4, 0.9, 0.45, 0.7, 0.55]), 0.7), vertices)


def capsule_block(vertices: int) -> Surface:
    """Mixed: a box with a ball half sunk into it."""
    return remeshed(joined(box((1.6, 1.6, 0.8)), ball(0.6, (0.1, 0.1, 0.5))), vertices)


def torus(vertices: int) -> Surface:
    """Smooth: a torus with a random diagonal in each quad."""
    return Surface(*_ring(vertices, lambda u: u))


def bumps(vertices: int) -> Surface:
    """Smooth: a ball with bumps of a tenth to a half of its radius across."""
    ms = _new(remeshed(ball(1.0), vertices))
    V = ms.current_mesh().vertex_matrix()
    random = np.random.default_rng(3)
    toward = random.standard_normal((40, 3))
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    width, height = random.uniform(0.1, 0.5, 40), random.uniform(-0.06, 0.12, 40)
    unit = V / np.linalg.norm(V, axis=1)[:, None]
    apart = np.arccos(np.clip(unit @ toward.T, -1, 1))
    return Surface(V * (1 + (height * np.exp(-((2 * apart / width) ** 2))).sum(axis=1))[:, None], _faces(ms))


def bunny(vertices: int) -> Surface:
    """Organic: the Stanford bunny, simplified, with the uneven triangles that result."""
    return _simplified(sample("bunny.obj"), vertices)


def uneven_torus(vertices: int) -> Surface:
    """Uneven: edges on one side of the torus are five times as long as on the other."""
    return Surface(*_ring(vertices, lambda u: u + 0.67 / (2 * np.pi) * np.sin(2 * np.pi * u)))


def uneven_block(vertices: int) -> Surface:
    """Uneven and sharp: the box with a hole, with edges a third as long at one end."""
    ms = _new(remeshed(cut(box((2, 1.4, 1)), rod(0.35, 2.0)), round(0.45 * vertices)))
    edge = mean_edge_length(_surface(ms))
    ms.compute_selection_by_condition_per_face(condselect="(x0 + x1 + x2) > 2.1")
    _remesh(ms, edge / 3, selected=True)
    return _surface(ms)


def cow(vertices: int) -> Surface:
    """Uneven and organic: a modeled animal, subdivided without remeshing, so that large triangles stay large."""
    ms = pymeshlab.MeshSet()
    ms.load_new_mesh(str(sample("cow.obj")))
    while ms.current_mesh().vertex_number() < 0.7 * vertices:
        ms.meshing_surface_subdivision_midpoint(iterations=1, threshold=pymeshlab.PercentageValue(1.0))
    return _surface(ms)


def relief(vertices: int) -> Surface:
    """Open: a sheet with waves and a sharp pyramid on a grid, as from a depth camera."""
    side = round(vertices**0.5)
    x, y = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
    waves = 0.06 * np.sin(4 * x + y) * np.cos(3 * y)
    z = np.maximum(0.55 - np.maximum(abs(x - 0.3), abs(y + 0.2)), 0) + waves
    i, j = (k.ravel() for k in np.meshgrid(np.arange(side - 1), np.arange(side - 1), indexing="ij"))
    a = i * side + j
    F = np.concatenate([np.stack([a, a + side, a + side + 1], axis=1), np.stack([a, a + side + 1, a + 1], axis=1)])
    return Surface(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), F)


def open_block(vertices: int) -> Surface:
    """Open and sharp: the box with a hole, with one corner cut off along triangle edges."""
    ms = _new(block(round(1.15 * vertices)))
    ms.compute_selection_by_condition_per_face(condselect="(x0 + x1 + x2 + y0 + y1 + y2 + z0 + z1 + z2) > 4.2")
    ms.meshing_remove_selected_faces()
    ms.meshing_remove_unreferenced_vertices()
    return _surface(ms)


SHAPES: "dict[str, Callable[[int], Surface]]" = {
    f.__name__: f
    for f in (
        block,
        star,
        capsule_block,
        torus,
        bumps,
        bunny,
        uneven_torus,
        uneven_block,
        cow,
        relief,
        open_block,
    )
}

# --- pairs: a name, a shape, a kind of noise and its level ---

PAIRS = {
    f"{shape}_{kind}_{level:g}": (shape, kind, level)
    for shape, kind, level in (
        ("block", "gaussian", 0.1),
        ("block", "gaussian", 0.3),
        ("block", "impulses", 1.0),
        ("star", "gaussian", 0.5),
        ("star", "along_normals", 0.3),
        ("capsule_block", "gaussian", 0.2),
        ("capsule_block", "correlated", 0.2),
        ("torus", "gaussian", 0.3),
        ("bumps", "gaussian", 0.2),
        ("bumps", "impulses", 1.0),
        ("bunny", "gaussian", 0.1),
        ("bunny", "gaussian", 0.5),
        ("bunny", "correlated", 0.2),
        ("uneven_torus", "gaussian", 0.2),
        ("uneven_block", "gaussian", 0.2),
        ("cow", "along_normals", 0.2),
        ("relief", "along_view", 0.3),
        ("relief", "quantized", 0.5),
        ("open_block", "gaussian", 0.3),
    )
}


def make(name: str, vertices: int = 6000, seed: int = 1) -> "tuple[Surface, Surface]":
    """Return the noisy surface and the truth of a pair, deterministically."""
    shape, kind, level = PAIRS[name]
    truth = SHAPES[shape](vertices)
    return Surface(noise.KINDS[kind](truth, level, seed), truth.faces), truth


# --- solids, by MeshLab ---


def box(size: "tuple[float, float, float]", center: "tuple[float, float, float]" = (0, 0, 0)) -> Surface:
    ms = pymeshlab.MeshSet()
    ms.create_cube(size=1.0)
    surface = _surface(ms)
    middle = (surface.vertices.min(axis=0) + surface.vertices.max(axis=0)) / 2
    return Surface((surface.vertices - middle) * size + center, surface.faces)


def ball(radius: float, center: "tuple[float, float, float]" = (0, 0, 0)) -> Surface:
    ms = pymeshlab.MeshSet()
    ms.create_sphere(radius=radius, subdiv=5)
    surface = _surface(ms)
    return Surface(surface.vertices + center, surface.faces)


def rod(radius: "float | Floats", length: float, sides: int = 96) -> Surface:
    """Return a bar along z, round or with a radius for each side."""
    radius = np.broadcast_to(radius, np.size(radius) if np.size(radius) > 1 else sides)
    sides = len(radius)
    t = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(t), radius * np.sin(t), np.full(sides, -length / 2)], axis=1)
    ends = np.array([[0, 0, -length / 2], [0, 0, length / 2]])
    V = np.concatenate([ring, ring + length * np.eye(3)[2], ends])
    a, b = np.arange(sides), (np.arange(sides) + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    walls = [np.stack([a, b, b + sides], axis=1), np.stack([a, b + sides, a + sides], axis=1)]
    caps = [np.stack([low, b, a], axis=1), np.stack([high, a + sides, b + sides], axis=1)]
    return Surface(V, np.concatenate(walls + caps))


def cut(one: Surface, other: Surface) -> Surface:
    return _boolean("generate_boolean_difference", one, other)


def joined(one: Surface, other: Surface) -> Surface:
    return _boolean("generate_boolean_union", one, other)


def _boolean(name: str, one: Surface, other: Surface) -> Surface:
    ms = _new(one)
    ms.add_mesh(pymeshlab.Mesh(other.vertices, other.faces))
    ms.apply_filter(name, first_mesh=0, second_mesh=1)
    return _surface(ms)


def remeshed(surface: Surface, vertices: int) -> Surface:
    """Remesh in triangles of similar size with creases kept, with ``vertices`` vertices to within a few per cent."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    edge = np.sqrt(2 / np.sqrt(3) * area / vertices)
    ms = _new(surface)
    _remesh(ms, float(edge), selected=False)
    return _surface(ms)


def _remesh(ms: pymeshlab.MeshSet, edge: float, selected: bool) -> None:
    # MeshLab keeps the value of selectedonly for the next call, so it is always given
    ms.meshing_isotropic_explicit_remeshing(
        targetlen=pymeshlab.PureValue(edge), iterations=12, featuredeg=25, checksurfdist=False, selectedonly=selected
    )


def _simplified(path: Path, vertices: int) -> Surface:
    ms = pymeshlab.MeshSet()
    ms.load_new_mesh(str(path))
    ms.meshing_decimation_quadric_edge_collapse(targetfacenum=2 * vertices)
    return _surface(ms)


def _ring(vertices: int, spacing: "Callable[[Floats], Floats]") -> "tuple[Floats, np.ndarray]":
    nx, ny = round((3 * vertices) ** 0.5), round((vertices / 3) ** 0.5)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    t, p = 2 * np.pi * spacing(i / nx), 2 * np.pi * j / ny
    V = np.stack([(3 + np.cos(p)) * np.cos(t), (3 + np.cos(p)) * np.sin(t), np.sin(p)], axis=1)
    a, b, c, d = (((i + k) % nx * ny + (j + m) % ny) for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
    one = np.random.default_rng(11).random(len(a)) < 0.5
    halves = (((a, b, c), one), ((a, c, d), one), ((a, b, d), ~one), ((b, c, d), ~one))
    return V, np.concatenate([np.stack(x, axis=1)[y] for x, y in halves])


def _new(surface: Surface) -> pymeshlab.MeshSet:
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(surface.vertices, surface.faces))
    return ms


def _faces(ms: pymeshlab.MeshSet) -> "np.ndarray":
    return ms.current_mesh().face_matrix()


def _surface(ms: pymeshlab.MeshSet) -> Surface:
    return Surface(ms.current_mesh().vertex_matrix(), _faces(ms))
