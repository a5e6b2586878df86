"""Surfaces that constants are measured on: none of those that the quality benchmark (pairs.py) or pymeshlab has.

Each is made in code, of one to three thousand vertices, and stands for a property: round, detailed, tubular, sharp,
open, graded, decimated, exactly flat, thin triangles. :func:`noisy` adds noise of a known kind and level.
"""

import functools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pymeshlab
from scipy.spatial import ConvexHull, Delaunay

from meshlab_specsmooth.geometry.surface import Surface, edges, mean_edge_length, vertex_normals

Array = npt.NDArray[np.float64]


# --- round and smooth ---


def ellipsoid() -> Surface:
    """Round, even triangles."""
    return Surface(_sphere().vertices * (1, 0.75, 0.55), _sphere().faces)


def cushion() -> Surface:
    """A superellipsoid: flat sides, narrow rounded edges."""
    V = _sphere().vertices
    return Surface(V / (V**6).sum(axis=1)[:, None] ** (1 / 6), _sphere().faces)


def pebble() -> Surface:
    """A sphere with polynomial dents."""
    x, y, z = _sphere().vertices.T
    radius = 1 + 0.35 * (x**3 * y - y**3 * z) + 0.25 * np.sin(3 * z) * x
    return Surface(_sphere().vertices * radius[:, None], _sphere().faces)


def graded() -> Surface:
    """An ellipsoid whose edges grow fourfold from one end to the other."""
    V = _sphere().vertices + np.array([0, 0, 0.6])
    V = V / (V**2).sum(axis=1)[:, None]  # an inversion, which keeps angles
    return Surface(V * (1, 1, 0.8), _sphere().faces[:, ::-1])


def knot() -> Surface:
    """A tube along a trefoil, a random diagonal in each quad."""
    around, along = 12, 130
    t = 2 * np.pi * np.arange(along) / along
    curve = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)
    ahead = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    aside = np.cross(ahead, [0.0, 0, 1])
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    p = 2 * np.pi * np.arange(around) / around
    ring = np.cos(p)[:, None] * aside[:, None] + np.sin(p)[:, None] * np.cross(aside, ahead)[:, None]
    return Surface((curve[:, None] + 0.42 * ring).reshape(-1, 3), _grid_faces(along, around, True, True))


# --- sharp ---


@functools.cache
def gear() -> Surface:
    """A gear of nine teeth, remeshed."""
    radius = np.repeat(np.tile([1.0, 0.7], 9), 2)
    angle = 2 * np.pi * (np.arange(36) + np.tile([0.12, -0.12], 18)) / 36
    return _remeshed(_prism(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1), 0.5), 0.085)


@functools.cache
def bracket() -> Surface:
    """An L-shaped block with a bevel, remeshed."""
    outline = np.array([[0.0, 0], [2, 0], [2, 0.5], [0.9, 0.6], [0.6, 0.9], [0.5, 2], [0, 2]])
    return _remeshed(_prism(outline, 0.8), 0.085)


# --- open ---


def saddle() -> Surface:
    """A saddle over a disk, on a triangulation of scattered points."""
    random = np.random.default_rng(11)
    k = np.arange(1300)
    at = np.sqrt((k + 0.5) / 1300)[:, None] * np.stack([np.cos(2.39996 * k), np.sin(2.39996 * k)], axis=1)
    at += 0.006 * random.standard_normal(at.shape)
    x, y = at.T
    return Surface(np.stack([x, y, 0.35 * (x**2 - y**2)], axis=1), _upward(at, Delaunay(at).simplices))


def washboard() -> Surface:
    """Waves of eighteen edges, on a grid."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(32.0), indexing="ij"))
    z = 1.5 * np.sin(2 * np.pi * x / 18 + 0.05 * y)
    return Surface(np.stack([x, y, z], axis=1), _grid_faces(40, 32, False, False))


# --- coarse, exact or thin: shape that must not be taken for noise ---


@functools.cache
def decimated(fineness: float = 0.7) -> Surface:
    """Folds of a few triangles across, decimated to a tenth: detail as fine as the triangles."""
    x, y, z = (fineness * _sphere(12000).vertices).T
    radius = 1 + 0.05 * np.sin(14 * x + 4 * np.sin(3 * y)) + 0.04 * np.sin(19 * y - 11 * z)
    ms = _meshset(Surface(_sphere(12000).vertices * radius[:, None], _sphere(12000).faces))
    ms.meshing_decimation_quadric_edge_collapse(targetfacenum=2400)
    return _surface(ms)


def decimated_finely() -> Surface:
    """The same with finer folds."""
    return decimated(0.8)


def decimated_coarsely() -> Surface:
    """The same with wider folds."""
    return decimated(0.6)


def turned() -> Surface:
    """A turned part: quads with one diagonal each, exactly flat, steps and a groove."""
    sides, height = 48, 30
    z = np.linspace(0, 3, height)
    radius = 0.8 + 0.25 * (z > 1) + 0.15 * np.sin(2.5 * z) * (z < 2) - 0.3 * (abs(z - 2.4) < 0.15)
    t = 2 * np.pi * np.arange(sides) / sides
    V = np.stack([np.outer(radius, np.cos(t)), np.outer(radius, np.sin(t)), np.tile(z[:, None], sides)], axis=2)
    return Surface(V.reshape(-1, 3), _grid_faces(height, sides, False, True, mixed=False))


def slats() -> Surface:
    """A bent sheet in triangles nine times as long as high."""
    x, y = (a.ravel() for a in np.meshgrid(9 * np.arange(30.0), np.arange(50.0), indexing="ij"))
    z = 6 * np.sin(2 * np.pi * x / 130) * np.cos(y / 9)
    return Surface(np.stack([x, y, z], axis=1), _grid_faces(30, 50, False, False))


def stairs() -> Surface:
    """The surface of a mask: voxels of an ellipsoid, smoothed not at all."""
    r = np.arange(-15, 16)
    x, y, z = np.meshgrid(r, r, r, indexing="ij")
    filled = (x / 12.3) ** 2 + (y / 9.1) ** 2 + (z / 10.7) ** 2 < 1
    corners = []
    for axis in range(3):
        for step in (1, -1):
            at = np.argwhere(filled & ~np.roll(filled, -step, axis=axis))
            side = np.delete(np.arange(3), axis)
            u, v = np.eye(3)[side]
            base = at + (np.eye(3)[axis] if step > 0 else 0)
            quad = np.stack([base, base + u, base + u + v, base + v], axis=1)
            corners.append(quad if (step > 0) == (axis != 1) else quad[:, ::-1])
    quads = np.concatenate(corners)
    V, number = np.unique(quads.reshape(-1, 3), axis=0, return_inverse=True)
    a, b, c, d = number.reshape(-1, 4).T
    return Surface(V.astype(float), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def terraces(height: float, step: float) -> Surface:
    """A depth map of hills in steps, seen from aside."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(32.0), indexing="ij"))
    z = height * np.sin(2 * np.pi * x / 80) * np.cos(2 * np.pi * y / 80)
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    V = np.stack([x, y, np.round(z / step) * step], axis=1) @ turn
    return Surface(V, _grid_faces(40, 32, False, False))


SMOOTH: "tuple[Callable[[], Surface], ...]" = (ellipsoid, cushion, pebble, graded, knot)
SHARP = (gear, bracket)
OPEN = (saddle, washboard)
EXACT = (decimated, decimated_finely, decimated_coarsely, turned, slats, stairs)


# --- noise ---


def white(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """On every coordinate."""
    return level * random.standard_normal(surface.vertices.shape)


def impulses(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """Along the normals of one vertex in seven; ``level`` is that of the vertices hit."""
    n = len(surface.vertices)
    along = level * random.standard_normal(n) * (random.random(n) < 1 / 7)
    return np.asarray(along[:, None] * vertex_normals(surface))


def directional(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """Along one direction."""
    along = np.array([0.48, 0.6, 0.64])
    return np.asarray(level * random.standard_normal((len(surface.vertices), 1)) * along)


def rounding(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """To a lattice of that step, shifted at random."""
    X, shift = surface.vertices / mean_edge_length(surface), random.random(3)
    return np.asarray(np.round(X / level + shift) * level - X - shift * level)


def correlated(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """That neighbors share: white noise averaged over the ring three times."""
    ends, _ = edges(surface)
    field = random.standard_normal(surface.vertices.shape)
    degree = np.bincount(ends.ravel(), minlength=len(field))[:, None] + 1
    for _ in range(3):
        total = field.copy()
        np.add.at(total, ends[:, 0], field[ends[:, 1]])
        np.add.at(total, ends[:, 1], field[ends[:, 0]])
        field = total / degree
    return np.asarray(level * field / field.std())


def half(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """White, on one half."""
    x = surface.vertices[:, 0]
    return level * (x > np.median(x))[:, None] * random.standard_normal(surface.vertices.shape)


def growing(surface: Surface, level: float, random: np.random.Generator) -> Array:
    """White, from none to the level along x."""
    x = surface.vertices[:, 0]
    return level * ((x - x.min()) / np.ptp(x))[:, None] * random.standard_normal(surface.vertices.shape)


def noisy(
    surface: Surface, kind: "Callable[[Surface, float, np.random.Generator], Array]", level: float, seed: int = 0
) -> Surface:
    """The surface with noise of ``level`` mean edges."""
    shift = kind(surface, level, np.random.default_rng([seed, len(surface.vertices)]))
    return Surface(surface.vertices + mean_edge_length(surface) * shift, surface.faces)


# --- masks ---

_MASKS = {
    "small ball": ((6.0, 6.0, 6.0), (1.0, 1.0, 1.0)),
    "ellipsoid": ((13.0, 9.0, 11.0), (1.0, 1.0, 1.0)),
    "slices": ((14.0, 17.0, 15.0), (1.0, 1.0, 2.5)),
    "ball": ((17.0, 17.0, 17.0), (1.0, 1.0, 1.0)),
}


@functools.cache
def masks() -> "dict[str, Surface]":
    """Of ellipsoids: by marching cubes, straight and turned; and as the faces of voxels."""
    import pyvista

    found = {}
    for name, (radii, spacing) in _MASKS.items():
        side = np.array(spacing)
        counts = 2 * np.ceil(radii / side).astype(int) + 5
        grid = pyvista.ImageData(dimensions=counts, spacing=spacing, origin=-side * (counts - 1) / 2 + 0.27 * side)
        grid["inside"] = (((grid.points / radii) ** 2).sum(axis=1) < 1).astype(float)
        cells = grid.points_to_cells().threshold(0.5, scalars="inside").extract_surface(algorithm="dataset_surface")
        contour = grid.contour([0.5], scalars="inside", method="flying_edges")
        for what, made in (("", contour), (", turned", contour), (", blocks", cells)):
            made = made.triangulate().clean()
            V = np.asarray(made.points, dtype=np.float64)
            found[name + what] = Surface(V @ _TURN if "turned" in what else V, made.regular_faces.astype(np.int32))
    return found


_TURN = np.linalg.qr(np.random.default_rng(8).standard_normal((3, 3)))[0]


def mask_error(name: str, V: Array, F: npt.NDArray[np.int32]) -> float:
    """Mean angle in degrees between the faces and the ellipsoid."""
    name, _, what = name.partition(", ")
    X = V @ _TURN.T if what == "turned" else V
    normal = X[F].mean(axis=1) / np.array(_MASKS[name][0]) ** 2
    face = np.cross(X[F[:, 1]] - X[F[:, 0]], X[F[:, 2]] - X[F[:, 0]])
    cosine = (normal * face).sum(axis=1) / np.linalg.norm(normal, axis=1) / np.linalg.norm(face, axis=1)
    return float(np.degrees(np.arccos(np.clip(np.abs(cosine), 0, 1))).mean())


def lattice_box() -> Surface:
    """A box with a grid on each face."""
    import pyvista

    made = pyvista.ImageData(dimensions=(18, 12, 9)).extract_surface(algorithm="dataset_surface").triangulate().clean()
    return Surface(np.asarray(made.points, dtype=np.float64), made.regular_faces.astype(np.int32))


# --- parts ---


@functools.cache
def _sphere(count: int = 1300) -> Surface:
    """The hull of points along a spiral, slightly scattered: nearly even triangles, in no pattern."""
    k = np.arange(count) + 0.5
    z, t = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    V = np.stack([np.sqrt(1 - z**2) * np.cos(t), np.sqrt(1 - z**2) * np.sin(t), z], axis=1)
    V += 0.25 / np.sqrt(count) * np.random.default_rng(count).standard_normal(V.shape)
    V /= np.linalg.norm(V, axis=1)[:, None]
    F = ConvexHull(V).simplices
    is_inward = (np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]) * V[F[:, 0]]).sum(axis=1) < 0
    return Surface(V, np.where(is_inward[:, None], F[:, ::-1], F))


def _grid_faces(nx: int, ny: int, wraps_x: bool, wraps_y: bool, mixed: bool = True) -> npt.NDArray[np.int64]:
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx - (not wraps_x)), np.arange(ny - (not wraps_y)), indexing="ij"))
    a, b, c, d = ((i + k) % nx * ny + (j + m) % ny for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
    one = np.random.default_rng(7).random(len(a)) < 0.5 if mixed else np.ones(len(a), dtype=bool)
    first, second = np.where(one, c, d), np.where(one, a, b)
    return np.concatenate([np.stack([a, b, first], axis=1), np.stack([second, c, d], axis=1)])


def _upward(at: Array, faces: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    p, q, r = (at[faces[:, k]] for k in range(3))
    is_down = (q - p)[:, 0] * (r - p)[:, 1] < (q - p)[:, 1] * (r - p)[:, 0]
    return np.where(is_down[:, None], faces[:, ::-1], faces)


def _prism(outline: Array, height: float) -> Surface:
    """A polygon that is star-shaped about its vertices' mean, or nearly, pulled up."""
    n = len(outline)
    ms = pymeshlab.MeshSet()
    ring = np.arange(n)
    after = (ring + 1) % n
    V = np.concatenate([np.c_[outline, np.zeros(n)], np.c_[outline, np.full(n, height)]])
    walls = np.concatenate([np.stack([ring, after, after + n], 1), np.stack([ring, after + n, ring + n], 1)])
    cap = _clipped_ears(outline)
    ms.add_mesh(pymeshlab.Mesh(V, np.concatenate([walls, cap + n, cap[:, ::-1]])))
    return _surface(ms)


def _clipped_ears(outline: Array) -> npt.NDArray[np.int64]:
    left, triangles = list(range(len(outline))), []
    while len(left) > 2:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            p, q, r = outline[[a, b, c]]
            area = (q - p)[0] * (r - p)[1] - (q - p)[1] * (r - p)[0]
            others = outline[[i for i in left if i not in (a, b, c)]]
            inside = np.ones(len(others), dtype=bool)
            for s, t in ((p, q), (q, r), (r, p)):
                inside &= (t - s)[0] * (others - s)[:, 1] >= (t - s)[1] * (others - s)[:, 0]
            if area > 0 and not inside.any():
                triangles.append((a, b, c))
                del left[k]
                break
        else:
            raise ValueError("the outline crosses itself or is not counterclockwise")
    return np.array(triangles)


def _remeshed(surface: Surface, edge: float) -> Surface:
    ms = _meshset(surface)
    ms.meshing_isotropic_explicit_remeshing(
        targetlen=pymeshlab.PureValue(edge), iterations=10, featuredeg=25, checksurfdist=False
    )
    return _surface(ms)


def _meshset(surface: Surface) -> pymeshlab.MeshSet:
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(surface.vertices, surface.faces))
    return ms


def _surface(ms: pymeshlab.MeshSet) -> Surface:
    return Surface(ms.current_mesh().vertex_matrix(), ms.current_mesh().face_matrix())
