"""Synthetic surfaces and noisy versions of them, the default input of benchmark_quality.py.

Each shape has a property to test: sharp edges, shallow ones, smooth parts, uneven triangles, an open boundary. Most
pairs have something else than white noise that is the same everywhere, as meshes that people have.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pymeshlab
import pyvista

from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.comparison import noise
from meshlab_specsmooth.geometry.surface import Surface, mean_edge_length, vertex_normals
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


def prism_12(vertices: int) -> Surface:
    """Shallow: a prism whose sides turn by 30 degrees."""
    return remeshed(rod(1.0, 1.4, sides=12), vertices, crease=10)


def prism_18(vertices: int) -> Surface:
    """Shallow: a prism whose sides turn by 20 degrees."""
    return remeshed(rod(1.0, 1.4, sides=18), vertices, crease=10)


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
        prism_12,
        prism_18,
    )
}


def ball_mask(vertices: int) -> "tuple[Surface, Surface]":
    """Staircase: marching cubes on the binary mask of a ball."""
    return _contoured(np.full(3, (vertices / 18.0) ** 0.5), np.ones(3))


def turned_mask(vertices: int) -> "tuple[Surface, Surface]":
    """Staircase: an ellipsoid, turned and scaled afterward."""
    both = _contoured((vertices / 18.0) ** 0.5 * np.array([1.2, 0.9, 1.0]), np.ones(3))
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return tuple(Surface(each.vertices @ turn * 0.37, each.faces) for each in both)


def slices(vertices: int) -> "tuple[Surface, Surface]":
    """Staircase: an ellipsoid in slices that are three times as thick as a voxel is wide."""
    return _contoured((vertices / 10.0) ** 0.5 * np.array([1.0, 0.8, 0.9]), np.array([1.0, 1.0, 3.0]))


def blocks(vertices: int) -> "tuple[Surface, Surface]":
    """Staircase: the faces of the voxels of a ball."""
    radius = (vertices / 19.0) ** 0.5
    inside = _ball_of_voxels(radius)
    corners, faces = _faces_of_voxels(inside)
    return _with_truth(corners, faces, np.full(3, radius))


MASKS = {f.__name__: f for f in (ball_mask, turned_mask, slices, blocks)}


def _contoured(radii: Floats, spacing: Floats) -> "tuple[Surface, Surface]":
    """Marching cubes on the mask of an ellipsoid about the origin, and the vertices on the ellipsoid itself."""
    counts = 2 * np.ceil(radii / spacing).astype(int) + 5
    grid = pyvista.ImageData(dimensions=counts, spacing=spacing)
    grid.origin = -spacing * (counts - 1) / 2 + 0.21 * spacing
    grid["inside"] = (((grid.points / radii) ** 2).sum(axis=1) < 1).astype(float)
    found = grid.contour([0.5], scalars="inside", method="flying_edges").triangulate().clean()
    return _with_truth(np.asarray(found.points, dtype=np.float64), found.regular_faces.astype(np.int32), radii)


def _with_truth(V: Floats, F: "np.ndarray", radii: Floats) -> "tuple[Surface, Surface]":
    return Surface(V, F), Surface(V / np.sqrt(((V / radii) ** 2).sum(axis=1))[:, None], F)


def _ball_of_voxels(radius: float) -> "np.ndarray":
    x = np.arange(-np.ceil(radius) - 2, np.ceil(radius) + 3) + 0.21
    return x[:, None, None] ** 2 + x[None, :, None] ** 2 + x[None, None, :] ** 2 < radius**2


def _faces_of_voxels(inside: "np.ndarray") -> "tuple[Floats, np.ndarray]":
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (1, -1):
            at = np.argwhere(inside & ~np.roll(inside, -sign, axis))
            corners = np.zeros((4, 3))
            corners[:, u], corners[:, v], corners[:, axis] = (0, 1, 1, 0), (0, 0, 1, 1), (sign + 1) / 2
            quads.append(at[:, None, :] + (corners if sign > 0 else corners[::-1]))
    points, index = np.unique(np.concatenate(quads).reshape(-1, 3), axis=0, return_inverse=True)
    quad = index.reshape(-1, 4)
    middle = (np.array(inside.shape) - 1) / 2 + 0.5 - 0.21
    return points - middle, np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]).astype(np.int32)


# --- noise that is not the same everywhere ---


def half(surface: Surface, level: float, seed: int) -> Floats:
    """White noise on one half."""
    x = surface.vertices[:, 0]
    return _scaled(surface, level * (x > np.median(x)), seed)


def patch(surface: Surface, level: float, seed: int) -> Floats:
    """White noise on a round quarter of the vertices."""
    far = np.linalg.norm(surface.vertices - surface.vertices[len(surface.vertices) // 3], axis=1)
    return _scaled(surface, level * (far < np.quantile(far, 0.25)), seed)


def graded(surface: Surface, level: float, seed: int) -> Floats:
    """White noise that grows from none on one side to the level on the other."""
    x = surface.vertices[:, 0]
    return _scaled(surface, level * (x - x.min()) / np.ptp(x), seed)


def by_distance(surface: Surface, level: float, seed: int) -> Floats:
    """Noise along the line of sight that grows with the square of the distance, as of a depth camera."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    eye = (low + high) / 2 + np.array([0.3, 0.2, 0.9]) * np.linalg.norm(high - low)
    sight = surface.vertices - eye
    distance = np.linalg.norm(sight, axis=1)
    white = np.random.default_rng(seed).standard_normal(len(distance))
    amount = level * mean_edge_length(surface) * (distance / distance.max()) ** 2 * white
    return surface.vertices + (amount / distance)[:, None] * sight


def spikes(surface: Surface, level: float, seed: int) -> Floats:
    """White noise, and five vertices in ten thousand far off."""
    V = noise.gaussian(surface, level, seed)
    random = np.random.default_rng([seed, 2])
    at = random.choice(len(V), max(3, len(V) // 2000), replace=False)
    normals = vertex_normals(surface)
    V[at] += 15 * mean_edge_length(surface) * normals[at] * random.choice([-1, 1], len(at))[:, None]
    return V


def impulses_in_noise(surface: Surface, level: float, seed: int) -> Floats:
    """Impulses at a tenth of the vertices, and white noise of a fifth of their level at all."""
    both = noise.impulses(surface, level, seed) + noise.gaussian(surface, 0.2 * level, seed + 1)
    return both - surface.vertices


def _scaled(surface: Surface, levels: Floats, seed: int) -> Floats:
    white = np.random.default_rng(seed).standard_normal(surface.vertices.shape)
    return surface.vertices + mean_edge_length(surface) * levels[:, None] * white


NOISE = noise.KINDS | {f.__name__: f for f in (half, patch, graded, by_distance, spikes, impulses_in_noise)}

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
        ("bunny", "half", 0.3),
        ("capsule_block", "half", 0.3),
        ("block", "patch", 0.3),
        ("torus", "patch", 0.3),
        ("bunny", "graded", 0.6),
        ("capsule_block", "graded", 0.4),
        ("bumps", "by_distance", 0.5),
        ("relief", "by_distance", 0.5),
        ("ball_mask", "staircase", 0),
        ("turned_mask", "staircase", 0),
        ("slices", "staircase", 0),
        ("blocks", "staircase", 0),
        ("prism_12", "gaussian", 0.1),
        ("prism_18", "gaussian", 0.1),
        ("prism_12", "gaussian", 0.3),
        ("torus", "spikes", 0.1),
        ("block", "spikes", 0.2),
        ("block", "impulses_in_noise", 0.5),
        ("bumps", "impulses_in_noise", 0.5),
    )
}

# What a pair stands for, by its noise, or else by its shape; the others are white noise that is the same everywhere.
GROUPS = {
    "varying": {"half", "patch", "graded", "by_distance"},
    "staircase": {"staircase"},
    "outliers": {"spikes", "impulses", "impulses_in_noise"},
    "other noise": {"correlated", "quantized", "along_view"},
    "shallow edges": {"prism_12", "prism_18"},
    "uneven triangles": {"uneven_torus", "uneven_block", "cow"},
}


def group_of(name: str) -> str:
    """What a pair stands for."""
    shape, kind, _ = PAIRS[name]
    return next((group for group, members in GROUPS.items() if {shape, kind} & members), "white")


def make(name: str, vertices: int = 6000, seed: int = 1) -> "tuple[Surface, Surface]":
    """Return the noisy surface and the truth of a pair, deterministically."""
    shape, kind, level = PAIRS[name]
    if shape in MASKS:
        return MASKS[shape](vertices)
    truth = SHAPES[shape](vertices)
    return Surface(NOISE[kind](truth, level, seed), truth.faces), truth


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


def remeshed(surface: Surface, vertices: int, crease: float = 25) -> Surface:
    """Remesh in triangles of similar size with creases kept, with ``vertices`` vertices to within a few per cent."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    edge = np.sqrt(2 / np.sqrt(3) * area / vertices)
    ms = _new(surface)
    _remesh(ms, float(edge), selected=False, crease=crease)
    return _surface(ms)


def _remesh(ms: pymeshlab.MeshSet, edge: float, selected: bool, crease: float = 25) -> None:
    # MeshLab keeps the value of selectedonly for the next call, so it is always given
    ms.meshing_isotropic_explicit_remeshing(
        targetlen=pymeshlab.PureValue(edge),
        iterations=12,
        featuredeg=crease,
        checksurfdist=False,
        selectedonly=selected,
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
