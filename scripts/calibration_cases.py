"""What the constants are measured by: cases that must come out right, and errors that are to be small.

Functions for :mod:`calibrate`, on the surfaces of :mod:`calibration_shapes`. A case is a name and a function that says
whether it comes out as it should; errors are numbers by name, the smaller the better. What is computed once and does
not depend on the constant that is varied is kept.
"""

import functools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType

import calibration_shapes as shapes
import numpy as np

import meshlab_specsmooth as mss
from meshlab_specsmooth.geometry.surface import Surface, mean_edge_length, vertex_normals
from meshlab_specsmooth.noise.voxels import find_voxels

Array = np.ndarray
Case = tuple[str, Callable[[], bool]]

# --- noise: kinds and levels ---


def estimate(surface: Surface) -> mss.Noise:
    return mss.estimate_noise(surface.vertices, surface.faces)


LEFT_ALONE = ("none", "unclear")


@functools.cache
def kinds() -> list[Case]:
    """Surfaces whose kind of noise is known, and the level where noise has one."""
    made: list[Case] = []

    def add(
        name: str, surface: Surface, allowed: "tuple[str, ...]", level: "float | None", has_reason: "bool | None"
    ) -> None:
        def run() -> bool:
            noise = estimate(surface)
            fits = level is None or 1 / 1.3 < noise.level / level < 1.3
            return noise.kind in allowed and fits and (has_reason is None or (noise.reason is not None) == has_reason)

        made.append((name, run))

    for make in (*shapes.SMOOTH, *shapes.SHARP, *shapes.OPEN, *shapes.EXACT[:-1]):
        add(f"{make.__name__}, clean", make(), LEFT_ALONE, None, None)
    add("stairs, clean", shapes.stairs(), ("quantized", "staircase"), None, None)
    for height, step in ((3.0, 0.5), (2.5, 0.4), (3.5, 0.5), (5.0, 0.7)):
        terraces = shapes.terraces(height, step)
        add(f"terraces of {step}, {height} high", terraces, ("white", "directional"), None, True)
    for make in (*shapes.SMOOTH, *shapes.OPEN, *shapes.SHARP):
        surface, name = make(), make.__name__
        edge = mean_edge_length(surface)
        is_smooth = make not in shapes.SHARP
        for level in (0.05, 0.1, 0.2, 0.4):
            allowed = ("white", "directional")
            known = level * edge if is_smooth or level >= 0.2 else None
            add(f"{name}, white {level}", shapes.noisy(surface, shapes.white, level), allowed, known, False)
        for level in (0.7, 1.5):
            add(f"{name}, impulses {level}", shapes.noisy(surface, shapes.impulses, level), ("impulse",), None, None)
        for level in (0.7, 1.5):
            noise = shapes.noisy(shapes.noisy(surface, shapes.impulses, level), shapes.white, 0.15 * level)
            add(f"{name}, impulses {level} amid white noise", noise, ("impulse",), None, None)
        add(
            f"{name}, white 0.03",
            shapes.noisy(surface, shapes.white, 0.03),
            ("white", "directional", "none"),
            None,
            None,
        )
        if is_smooth:
            noise = shapes.noisy(surface, shapes.directional, 0.3)
            add(f"{name}, directional 0.3", noise, ("directional",), None, False)
        for step in (0.25, 0.5):
            noise = shapes.noisy(surface, shapes.rounding, step)
            add(f"{name}, rounded to {step}", noise, ("quantized",), None, None)
        for level in (0.5, 0.7):
            noise = shapes.noisy(surface, shapes.correlated, level, seed=1)
            add(f"{name}, correlated {level}", noise, ("correlated",), None, None)
    return made


KINDS = "kinds and levels on 9 shapes, clean and noisy, and on 6 that are coarse, exact or thin"


def level_errors() -> dict[str, float]:
    """By how much levels of white noise are off, over several seeds."""
    found = {}
    for make in (shapes.ellipsoid, shapes.pebble, shapes.knot, shapes.saddle, shapes.washboard, shapes.bracket):
        surface = make()
        for level in (0.1, 0.3):
            true = level * mean_edge_length(surface)
            off = [estimate(shapes.noisy(surface, shapes.white, level, seed)).level / true - 1 for seed in range(4)]
            found[f"{make.__name__} {level}"] = float(np.sqrt(np.mean(np.square(off))))
    return found


def open_level_errors() -> dict[str, float]:
    """The same on open shapes of few vertices inside."""
    found = {}
    for make in (shapes.saddle, shapes.washboard):
        surface = make()
        for level in (0.05, 0.2):
            true = level * mean_edge_length(surface)
            off = [estimate(shapes.noisy(surface, shapes.white, level, seed)).level / true - 1 for seed in range(6)]
            found[f"{make.__name__} {level}"] = float(np.sqrt(np.mean(np.square(off))))
    return found


LEVELS = "levels of white noise against the truth, 4 seeds"


@functools.cache
def level_scatter() -> dict[str, float]:
    """Standard deviation of the level over seeds, times the root of the number of vertices."""
    found = {}
    for make in (shapes.ellipsoid, shapes.graded, shapes.knot, shapes.pebble):
        surface = make()
        levels = [estimate(shapes.noisy(surface, shapes.white, 0.1, seed)).level for seed in range(30)]
        found[make.__name__] = float(np.std(levels) / np.mean(levels) * np.sqrt(len(surface.vertices)))
    return found


@functools.cache
def level_bias() -> dict[str, float]:
    """By how much the mean level over seeds is off."""
    found = {}
    for make in (shapes.ellipsoid, shapes.graded, shapes.knot, shapes.pebble, shapes.saddle):
        surface = make()
        for level in (0.05, 0.1, 0.2):
            true = level * mean_edge_length(surface)
            noises = [estimate(shapes.noisy(surface, shapes.white, level, seed)) for seed in range(12)]
            levels = [noise.level for noise in noises if noise.kind == "white"]
            if len(levels) == len(noises):
                found[f"{make.__name__} {level}"] = abs(float(np.mean(levels)) / true - 1)
    return found


# --- strays, components, the guard, thin triangles ---


@functools.cache
def strays() -> list[Case]:
    """Surfaces with strays planted, which are to be found and no others; and what is none."""
    from meshlab_specsmooth.noise.outliers import replace_outliers

    made: list[Case] = []

    def add(name: str, surface: Surface, planted: Array) -> None:
        ops = mss.assemble(surface.vertices, surface.faces)
        held = None if ops.boundary is None else ops.boundary.vertices
        expected = np.sort(planted)

        def run() -> bool:
            found = replace_outliers(ops.positions, ops.L, held)[1]
            return np.array_equal(np.sort(ops.active[found]), expected)

        made.append((name, run))

    nothing = np.empty(0, dtype=int)
    for make in (*shapes.SMOOTH, *shapes.SHARP, *shapes.OPEN, *shapes.EXACT):
        surface, name = make(), make.__name__
        add(f"{name}, clean", surface, nothing)
        for level in (0.2, 0.5):
            add(f"{name}, white {level}", shapes.noisy(surface, shapes.white, level), nothing)
        if make in shapes.EXACT:
            continue
        add(f"{name}, impulses 4", shapes.noisy(surface, shapes.impulses, 4.0), nothing)
        n, edge = len(surface.vertices), mean_edge_length(surface)
        inside = np.flatnonzero(np.isin(np.arange(n), _rim(surface), invert=True))
        for height, level in ((2.5, 0.05), (4.0, 0.2), (30.0, 0.0)):
            random = np.random.default_rng(int(10 * height))
            planted = random.choice(inside, 7, replace=False)
            noisy = shapes.noisy(surface, shapes.white, level)
            X = noisy.vertices.copy()
            X[planted] += height * edge * vertex_normals(surface)[planted]
            add(f"{name}, 7 strays of {height} edges", Surface(X, surface.faces), planted)
        if make in (shapes.saddle, shapes.washboard, shapes.ellipsoid):  # along the surface
            X = surface.vertices.copy()
            aside = np.cross(vertex_normals(surface)[planted], [0.6, 0.64, 0.48])
            X[planted] += 5 * edge * aside / np.linalg.norm(aside, axis=1)[:, None]
            add(f"{name}, 7 strays along it", Surface(X, surface.faces), planted)
    return made


def _rim(surface: Surface) -> Array:
    ends = np.sort(
        np.concatenate([surface.faces[:, [0, 1]], surface.faces[:, [1, 2]], surface.faces[:, [2, 0]]]), axis=1
    )
    pairs, count = np.unique(ends, axis=0, return_counts=True)
    rim = np.unique(pairs[count == 1])
    near = np.isin(surface.faces, rim).any(axis=1)
    return np.unique(surface.faces[near])


STRAYS = "planted strays and what is none, on 15 shapes"


@functools.cache
def components() -> list[Case]:
    """Two components that are alike or not, in scale or noise: in how many groups they are to be taken."""
    from meshlab_specsmooth.noise.parts import group_components
    from meshlab_specsmooth.operators.components import label_components

    made: list[Case] = []

    def add(name: str, one: Surface, other: Surface, groups: int) -> None:
        V = np.concatenate([one.vertices, other.vertices + np.array([9 * np.ptp(one.vertices), 0, 0])])
        F = np.concatenate([one.faces, other.faces + len(one.vertices)])
        ops = mss.assemble(V, F)

        def run() -> bool:
            return len(group_components(ops, *label_components(ops.L))) == groups

        made.append((name, run))

    for make in (shapes.ellipsoid, shapes.knot, shapes.bracket):
        surface = make()
        base = shapes.noisy(surface, shapes.white, 0.2)
        name = make.__name__
        for scale, groups in ((1.0, 1), (1.1, 1), (1.6, 2), (2.5, 2)):
            other = shapes.noisy(surface, shapes.white, 0.2, seed=1)
            add(f"{name}, {scale} times as large", base, Surface(other.vertices * scale, other.faces), groups)
        for level, groups in ((0.22, 1), (0.4, 2), (0.1, 2)):
            add(f"{name}, noise {level}", base, shapes.noisy(surface, shapes.white, level, seed=2), groups)
        add(f"{name} and a clean one", base, surface, 2)
    surface = shapes.ellipsoid()
    base = shapes.noisy(surface, shapes.white, 0.2)
    edge = mean_edge_length(surface)
    for times, groups in ((1.0, 1), (1.25, 1), (1.9, 2), (4.0, 2)):
        tiny = Surface(_octahedron() * edge * times / np.sqrt(2), _OCTAHEDRON)
        add(f"ellipsoid and an octahedron of {times} edges", base, tiny, groups)
    return made


_OCTAHEDRON = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


def _octahedron() -> Array:
    return np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


COMPONENTS = "two components, alike and unlike in scale or noise"


@functools.cache
def harm() -> list[Case]:
    """Results that keep the shape, and results that lose it: which the guard is to tell apart."""
    from meshlab_specsmooth.noise.shape_change import compare_shapes

    made: list[Case] = []

    def add(name: str, noisy: Surface, after: Array, is_harm: bool, noise: mss.Noise) -> None:
        center = noisy.vertices.mean(axis=0)
        size = np.abs(noisy.vertices - center).max()
        X, Y = (noisy.vertices - center) / size, (after - center) / size
        closed = np.array([len(_rim(noisy)) == 0])
        own = mss.estimate_noise(X, noisy.faces)

        def run() -> bool:
            return bool(compare_shapes(X, Y, noisy.faces, closed, None, own).excessive.any()) == is_harm

        made.append((name, run))

    for make in (*shapes.SMOOTH, *shapes.SHARP, *shapes.OPEN):
        surface = make()
        for kind, level in ((shapes.white, 0.1), (shapes.white, 0.3), (shapes.correlated, 0.5), (shapes.rounding, 0.5)):
            noisy = shapes.noisy(surface, kind, level)
            noise, name = estimate(noisy), f"{make.__name__}, {kind.__name__} {level}"
            if noise.is_left_alone:
                continue
            add(f"{name}: the truth", noisy, surface.vertices, False, noise)
            for share in (0.12, 0.3):  # shrunk towards its middle, as oversmoothing does
                center = surface.vertices.mean(axis=0)
                add(
                    f"{name}: shrunk by {share}", noisy, center + (1 - share) * (surface.vertices - center), True, noise
                )
    return made


HARM = "the truth, and the truth shrunk by 5 and 12 %, against noisy shapes"


@functools.cache
def shared_by() -> dict[str, float]:
    """How many vertices count as one in a mean of correlated noise: n times its variance over that of a vertex."""
    found = {}
    for make in (shapes.ellipsoid, shapes.graded, shapes.knot):
        surface = make()
        random = np.random.default_rng(3)
        fields = [shapes.correlated(surface, 1.0, random)[:, 0] for _ in range(60)]
        means = np.array([field.mean() for field in fields])
        found[make.__name__] = float(len(surface.vertices) * (means**2).mean())
    return found


@functools.cache
def thin() -> list[Case]:
    """Vertices amid thin triangles: none of even noisy ones, all inside slats of more than 12."""
    from meshlab_specsmooth.noise.thin_triangles import find_uneven_vertices

    made: list[Case] = []

    def add(name: str, surface: Surface, low: float, high: float) -> None:
        ops = mss.assemble(surface.vertices, surface.faces)

        def run() -> bool:
            return low <= float(find_uneven_vertices(ops, np.ones(len(ops.positions), dtype=np.bool_)).mean()) <= high

        made.append((name, run))

    for make in (*shapes.SMOOTH, *shapes.SHARP, *shapes.OPEN):
        for level in (0.2, 0.5):
            add(f"{make.__name__}, white {level}", shapes.noisy(make(), shapes.white, level), 0.0, 0.002)
    slats = shapes.slats()
    for times in (2.0, 5.0):
        add(f"slats {times:g} times as long", Surface(slats.vertices * (times, 1, 1), slats.faces), 0.9, 1.0)
    return made


# --- errors of results ---


def _truth_error(surface: Surface, V: Array) -> float:
    """Root mean square along the true normals, in mean edges."""
    along = ((V - surface.vertices) * vertex_normals(surface)).sum(axis=1)
    return float(np.sqrt((along**2).mean()) / mean_edge_length(surface))


def _face_normals(V: Array, F: Array) -> Array:
    N = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    return N / np.maximum(np.linalg.norm(N, axis=1), 1e-300)[:, None]


SET = (
    (shapes.ellipsoid, shapes.white, 0.1),
    (shapes.pebble, shapes.white, 0.3),
    (shapes.knot, shapes.white, 0.2),
    (shapes.gear, shapes.white, 0.2),
    (shapes.bracket, shapes.white, 0.3),
    (shapes.saddle, shapes.white, 0.2),
    (shapes.washboard, shapes.directional, 0.3),
    (shapes.cushion, shapes.white, 0.05),
    (shapes.ellipsoid, shapes.white, 0.7),
)
HIT = tuple(
    (make, shapes.impulses, level) for make in (shapes.pebble, shapes.bracket, shapes.knot) for level in (0.7, 1.5)
)


def _errors_of(
    call: "Callable[[Surface], object]", measure: "Callable[[Surface, np.ndarray], float]", given: tuple = SET
) -> dict[str, float]:
    found = {}
    for make, kind, level in given:
        surface = make()
        noisy = shapes.noisy(surface, kind, level)
        found[f"{make.__name__}, {kind.__name__} {level}"] = measure(surface, call(noisy).vertices)
    return found


@functools.cache
def varying() -> list[Case]:
    """Noise that is the same everywhere, and noise that is not."""
    made: list[Case] = []
    # where edges grow fourfold, noise that does not varies relative to them
    for make in (*(each for each in shapes.SMOOTH if each is not shapes.graded), *shapes.SHARP, *shapes.OPEN):
        surface = make()
        given = {"clean": (surface, False)}
        for level in (0.1, 0.2, 0.4):
            given[f"white {level}"] = shapes.noisy(surface, shapes.white, level), False
            given[f"impulses {level}"] = shapes.noisy(surface, shapes.impulses, 3 * level), False
        for level in (0.2, 0.4):
            given[f"{level} on a half"] = shapes.noisy(surface, shapes.half, level), True
            given[f"from 0 to {level}"] = shapes.noisy(surface, shapes.growing, level), True

        for what, (noisy, expected) in given.items():

            def run(noisy: Surface = noisy, expected: bool = expected) -> bool:
                return estimate(noisy).varies == expected

            made.append((f"{make.__name__}, {what}", run))
    return made


def varying_errors() -> dict[str, float]:
    given = tuple(
        (make, kind, 0.3)
        for make in (shapes.ellipsoid, shapes.pebble, shapes.knot, shapes.saddle)
        for kind in (shapes.half, shapes.growing)
    )
    return _errors_of(lambda s: mss.smooth(s.vertices, s.faces), _truth_error, given)


def varying_denoised() -> dict[str, float]:
    given = tuple((make, kind, 0.3) for make in (shapes.pebble, shapes.gear) for kind in (shapes.half, shapes.growing))
    return _errors_of(lambda s: mss.denoise(s.vertices, s.faces), _truth_error, given)


@functools.cache
def masks() -> list[Case]:
    """Surfaces of masks, and other surfaces on lattices."""
    made: list[Case] = []

    def add(name: str, surface: Surface, expected: bool) -> None:
        made.append((name, lambda: (find_voxels(surface.vertices, surface.faces) is not None) == expected))

    for name, surface in shapes.masks().items():
        add(name, surface, True)
        single = surface.vertices.astype(np.float32).astype(np.float64)
        add(f"{name}, single precision", Surface(single, surface.faces), True)
    for make in (*shapes.SMOOTH, *shapes.SHARP, *shapes.OPEN, *shapes.EXACT[:-1]):
        add(f"{make.__name__}, clean", make(), False)
    add("a box on a lattice", shapes.lattice_box(), False)
    return made


def mask_errors() -> dict[str, float]:
    """RMS angle between the faces of smoothed masks and the ellipsoids that these are of."""
    return {
        name: shapes.mask_error(name, mss.smooth(surface.vertices, surface.faces).vertices, surface.faces)
        for name, surface in shapes.masks().items()
    }


VARYING = "noise that varies, and noise that does not, on 8 shapes"
VARYING_ERRORS, VARYING_DENOISED = "true error of smooth, noise that varies", "true error of denoise, noise that varies"
MASKS = "masks of ellipsoids in several ways, and other surfaces"
MASK_ERRORS = "angle of the faces of smoothed masks"


def smooth_errors() -> dict[str, float]:
    return _errors_of(lambda s: mss.smooth(s.vertices, s.faces), _truth_error)


def impulse_errors() -> dict[str, float]:
    return _errors_of(lambda s: mss.smooth(s.vertices, s.faces), _truth_error, HIT)


def edge_aware_errors() -> dict[str, float]:
    return _errors_of(lambda s: mss.smooth_edge_aware(s.vertices, s.faces), _truth_error)


def edge_aware_hit() -> dict[str, float]:
    return _errors_of(lambda s: mss.smooth_edge_aware(s.vertices, s.faces), _truth_error, HIT)


def edge_aware_correlated() -> dict[str, float]:
    given = tuple((make, shapes.correlated, 0.9) for make in (shapes.ellipsoid, shapes.pebble, shapes.saddle))
    return _errors_of(lambda s: mss.smooth_edge_aware(s.vertices, s.faces), _truth_error, given)


def denoise_errors() -> dict[str, float]:
    return _errors_of(lambda s: mss.denoise(s.vertices, s.faces), _truth_error)


def open_denoised() -> dict[str, float]:
    given = tuple(
        (make, kind, level)
        for make in shapes.OPEN
        for kind, level in ((shapes.white, 0.1), (shapes.white, 0.3), (shapes.directional, 0.3))
    )
    return _errors_of(lambda s: mss.denoise(s.vertices, s.faces), _truth_error, given)


OPEN_DENOISED = "true error of denoise, open shapes"
THIN = "noisy even triangles, and slats of 18 and 45"
DENOISE, EDGE_AWARE_HIT = "true error of denoise", "true error of smooth_edge_aware under impulses"
EDGE_AWARE_CORRELATED = "true error of smooth_edge_aware under much correlated noise"
PROBES = "estimated risks of filters that are not linear against the true ones"
SAMPLED = "levels of meshes of 20 to 25 thousand vertices; more vertices take longer"
OPEN_LEVELS = "levels of white noise on open shapes, 6 seeds"
LARGE_COUNTS = "modes of meshes of 20 to 25 thousand vertices; more samples take longer"
INERTIA = "counts amid eigenvalues of 6 shapes"
SMOOTH = "true error of smooth"
ROBUST, EDGE_AWARE = "true error of smooth under impulses", "true error of smooth_edge_aware"


@functools.cache
def creases() -> list[Case]:
    """Edges that are to be found by an angle under noise, on shapes whose edges are known."""
    made: list[Case] = []
    for make in shapes.SHARP:
        surface = make()
        true = mss.smooth_edge_aware(surface.vertices, surface.faces, creases=50.0).creases
        for level in (0.1, 0.2):
            noisy = shapes.noisy(surface, shapes.white, level)

            def run(noisy: Surface = noisy, true: int = true) -> bool:
                found = mss.smooth_edge_aware(
                    noisy.vertices, noisy.faces, creases=50.0, strength=0.1, range_sigma=0.3, iterations=1
                ).creases
                return 0.8 * true <= found <= 1.2 * true

            made.append((f"{make.__name__}, white {level}", run))
    for make in (shapes.ellipsoid, shapes.pebble):
        noisy = shapes.noisy(make(), shapes.white, 0.2)

        def run(noisy: Surface = noisy) -> bool:
            given = {"strength": 0.1, "range_sigma": 0.3, "iterations": 1}
            return mss.smooth_edge_aware(noisy.vertices, noisy.faces, creases=50.0, **given).creases <= 10

        made.append((f"{make.__name__}, white 0.2", run))
    return made


CREASES = "edges by an angle, found to 20 % on noisy sharp shapes, none on smooth ones"


def probe_errors() -> dict[str, float]:
    """How far estimated risks of filters that are not linear are from the true ones, in squared levels."""
    found = {}
    for make, kind, level in SET[1:5]:
        surface = make()
        noisy = shapes.noisy(surface, kind, level)
        edge = mean_edge_length(surface)

        def keep_edges(V: Array, F: Array = surface.faces) -> Array:
            given = {"strength": 1.0, "range_sigma": 0.35, "iterations": 2, "barycenter_weight": 0.4}
            return mss.smooth_edge_aware(V, F, **given).vertices

        def stop_early(V: Array, F: Array = surface.faces, edge: float = edge) -> Array:
            smooth = mss.smooth(V, F, barycenter_weight=0.4).vertices
            return np.round(smooth / (1e-3 * edge)) * 1e-3 * edge  # as if it stopped at a thousandth of an edge

        for filter_ in (keep_edges, stop_early):
            risk = mss.estimate_error(filter_, noisy.vertices, noisy.faces).risk
            true = _truth_error(surface, filter_(noisy.vertices)) ** 2
            found[f"{make.__name__} {level} {filter_.__name__}"] = abs(risk / edge**2 - true) / level**2
    return found


# --- samples of large meshes ---


@functools.cache
def _large() -> "list[tuple[str, Surface, float]]":
    made = []
    for make in (shapes.pebble, shapes.gear, shapes.knot):
        surface = make()
        for _ in range(2):
            surface = _subdivided(surface)
        noisy = shapes.noisy(surface, shapes.white, 0.2)
        made.append((make.__name__, noisy, 0.2 * mean_edge_length(surface)))
    return made


def _subdivided(surface: Surface) -> Surface:
    V, F = surface.vertices, surface.faces
    sides = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    pairs, at = np.unique(sides, axis=0, return_inverse=True)
    a, b, c = at.reshape(3, -1) + len(V)
    faces = [np.stack(x, axis=1) for x in ((F[:, 0], a, c), (a, F[:, 1], b), (c, b, F[:, 2]), (a, b, c))]
    return Surface(np.concatenate([V, V[pairs].mean(axis=1)]), np.concatenate(faces))


def sampled_levels() -> dict[str, float]:
    """How far the level of a large mesh is off, and a standard error of the whole besides, which no sample beats."""
    return {
        name: float(np.hypot(estimate(surface).level / true - 1, 1.25 / np.sqrt(len(surface.vertices))))
        for name, surface, true in _large()
    }


# --- the spectrum ---


@functools.cache
def _spectra() -> "dict[str, tuple[object, np.ndarray]]":
    """Operators and all eigenvalues of some shapes."""
    found = {}
    for make in (shapes.knot, shapes.gear, shapes.saddle, shapes.washboard, shapes.turned, shapes.decimated):
        surface = make()
        L = mss.assemble(surface.vertices, surface.faces).L
        found[make.__name__] = L, np.linalg.eigvalsh(L.graph.symmetric_laplacian().toarray())
    return found


def _laws() -> "Iterator[tuple[str, object, np.ndarray]]":
    """The law of the modes by five sets of random vectors, with all eigenvalues."""
    from meshlab_specsmooth.spectral import density

    for name, (L, eigenvalues) in _spectra().items():
        for number in range(5):
            with _seed(density, number):
                yield name, density.estimate_density(L), eigenvalues


@contextmanager
def _seed(density: ModuleType, number: int) -> Iterator[None]:
    plain, density.SEED = density.SEED, number
    try:
        yield
    finally:
        density.SEED = plain


def count_errors() -> dict[str, float]:
    """Relative error of the number of modes below the cut-off of so many: root mean squares over numbers and seeds."""
    found: dict[str, list[float]] = {}
    for name, law, eigenvalues in _laws():
        for count in (20, 35, 50, 75, 100, 150, 200, 300, 400):
            below = np.searchsorted(eigenvalues, law.cutoff(count).eigenvalue)
            found.setdefault(name, []).append(below / count - 1)
    return {name: float(np.sqrt(np.mean(np.square(off)))) for name, off in found.items()}


@functools.cache
def _large_spectra() -> "list[tuple[str, object, Array, list[int]]]":
    """Operators of large meshes, some eigenvalues, and how many modes lie below each."""
    from meshlab_specsmooth.spectral import inertia

    made = []
    for name, surface, _ in _large():
        L = mss.assemble(surface.vertices, surface.faces).L
        S, at = L.graph.symmetric_laplacian(), np.array([0.01, 0.03, 0.1, 0.3])
        made.append((name, L, at, [inertia.count_below(S, float(x)) for x in at]))
    return made


def large_count_errors() -> dict[str, float]:
    """Relative error of the number of modes below some eigenvalues, root mean square over these and seeds."""
    from meshlab_specsmooth.spectral import density

    found = {}
    for name, L, at, true in _large_spectra():
        off = []
        for number in range(3):
            with _seed(density, number):
                law = density.estimate_density(L)
            off.append(np.interp(at, law.eigenvalues, law.below) / true - 1)
        found[name] = float(np.sqrt(np.mean(np.square(off))))
    return found


def score_loss() -> dict[str, float]:
    """How well stated errors fit the true ones: one over the geometric mean of the likelihoods of these."""
    found: dict[str, list[float]] = {}
    for name, law, eigenvalues in _laws():
        at = np.geomspace(law.eigenvalues[np.searchsorted(law.below, 20)], 1.8, 60)
        off = np.interp(at, law.eigenvalues, law.below) - np.searchsorted(eigenvalues, at)
        error = np.interp(at, law.eigenvalues, law.error)
        found.setdefault(name, []).append(float(np.mean(np.log(error) + (off / error) ** 2 / 2)))
    return {name: float(np.exp(np.mean(loss))) for name, loss in found.items()}


COUNTS, SCORES = (
    "modes below cut-offs against all eigenvalues",
    "stated errors of counts against true ones (likelihood)",
)


@functools.cache
def fill() -> dict[str, float]:
    """Entries of L over n log2 n."""
    from meshlab_specsmooth.spectral import inertia

    found = {}
    for name, surface, _ in _large():
        S = mss.assemble(surface.vertices, surface.faces).L.graph.symmetric_laplacian()
        n = S.shape[0]
        found[name] = inertia.factorize(S, 0.05).lu.L.nnz / (n * np.log2(n))
    for name, (L, _) in _spectra().items():
        S = L.graph.symmetric_laplacian()
        found[name] = inertia.factorize(S, 0.05).lu.L.nnz / (S.shape[0] * np.log2(S.shape[0]))
    return found


@functools.cache
def inertia_counts() -> list[Case]:
    """Counts by factorization, which are to be exact, at values amid eigenvalues, and near many equal ones."""
    from meshlab_specsmooth.spectral import inertia

    made: list[Case] = []
    for name, (L, eigenvalues) in _spectra().items():
        S = L.graph.symmetric_laplacian()
        for share in (0.01, 0.05, 0.2, 0.4):
            k = int(share * len(eigenvalues))
            gap = np.diff(eigenvalues[k : k + 20]).argmax() + k
            at = float(eigenvalues[gap : gap + 2].mean())

            def run(S: object = S, at: float = at, expected: int = gap + 1) -> bool:
                return inertia.count_below(S, at) == expected

            made.append((f"{name}, {gap + 1} modes", run))
    return made


@functools.cache
def _lanczos_matrices() -> "dict[str, tuple[object, int]]":
    return {
        make.__name__: (mss.assemble(*vars(make()).values()).L.graph.symmetric_laplacian(), count)
        for make, count in ((shapes.ellipsoid, 100), (shapes.knot, 60), (shapes.decimated, 80), (shapes.washboard, 100))
    }


def solves() -> dict[str, float]:
    """Columns that are solved for, by Lanczos' method for some eigenpairs."""
    from meshlab_specsmooth.spectral import eigenbasis, lanczos

    found, plain = {}, lanczos._solve
    for name, (S, count) in _lanczos_matrices().items():
        columns = []

        def counted(shifted: object, X: Array, columns: list = columns) -> Array:
            columns.append(X.shape[1])
            return plain(shifted, X)

        lanczos._solve = counted
        try:
            eigenbasis.lowest(S, count)
        finally:
            lanczos._solve = plain
        found[name] = sum(columns)
    return found


@functools.cache
def eigenpairs() -> list[Case]:
    """Eigenpairs that are to be complete, accurate and orthogonal."""
    from meshlab_specsmooth.spectral import eigenbasis

    made: list[Case] = []
    for name, (S, count) in _lanczos_matrices().items():
        true = np.linalg.eigvalsh(S.toarray())[:count]

        def run(S: object = S, count: int = count, true: Array = true) -> bool:
            basis = eigenbasis.lowest(S, count)
            U = basis.vectors
            is_orthogonal = np.abs(U.T @ U - np.eye(count)).max() < 1e-7
            return bool(np.abs(basis.eigenvalues - true).max() < 1e-8) and bool(is_orthogonal)

        made.append((f"{name}, {count} pairs", run))
    return made


EIGENPAIRS, SOLVES = "eigenpairs complete, to 1e-8, orthogonal", "columns solved for by Lanczos' method"


# --- tolerances ---


def displacement_off() -> dict[str, float]:
    """Share of itself that a displacement is off by, against eigenvectors and least squares to 1e-9."""
    found = {}
    for make in (shapes.knot, shapes.gear, shapes.saddle, shapes.graded):
        noisy = shapes.noisy(make(), shapes.white, 0.2)
        ops = mss.assemble(noisy.vertices, noisy.faces)
        edge = float(np.ldexp(ops.mean_edge, ops.exponent))
        for response in ("butterworth", "heat"):
            for weight in (0.03, 0.1, 0.3, 1.0):
                given = {"wavelength": 8 * edge, "response": response, "barycenter_weight": weight}
                exact = mss.smooth(ops, method="exact", tolerance=1e-9, **given).vertices
                x = mss.smooth(ops, method="chebyshev", **given).vertices
                moved = float(np.linalg.norm(exact - ops.surface.vertices))
                found[f"{make.__name__} {response} {weight}"] = float(np.linalg.norm(x - exact)) / moved
    return found


def sweeps() -> dict[str, float]:
    """Sweeps over a mesh that the least squares take."""
    from meshlab_specsmooth.operators import preconditioner

    found = {}
    for make in (shapes.ellipsoid, shapes.gear, shapes.saddle, shapes.graded):
        noisy = shapes.noisy(make(), shapes.white, 0.2)
        ops = mss.assemble(noisy.vertices, noisy.faces)
        for weight in (0.03, 0.1, 0.3, 0.7):
            count = mss.smooth(ops, barycenter_weight=weight, boundary="free").cg_iterations[0]
            # a product with the matrix is two sweeps, and the rest of an iteration about one
            kept = preconditioner.precondition(ops.L, weight**2 * ops.gram.diagonal, is_uniform=True, free=None)
            found[f"{make.__name__} {weight}"] = count * (3.0 + (0 if kept is None else len(kept.series[0])))
    return found


def polynomial_between() -> dict[str, float]:
    """Rise of a polynomial between the points that it is looked at in, 1 over cos(pi / 2 m) at the most."""
    from meshlab_specsmooth.spectral import chebyshev

    return {"m": float(1 / np.cos(np.pi / (2 * chebyshev._OVERSAMPLING)))}


# --- memory, in a process of its own ---


def peak_bytes(call: str, per: str) -> Callable[[], dict[str, float]]:
    """Peak of a process during a call, beyond what it held before, in bytes a vertex or face.

    Of vertices in the order of the surface, in random order, and without the compiled kernels.
    """

    def measure() -> dict[str, float]:
        found = {}
        environment = {key: value for key, value in os.environ.items() if key != "NUMBA_NUM_THREADS"}
        for variant in ("compiled", "shuffled", "scipy"):
            code = _MEMORY.format(call=call, per=per, variant=variant)
            done = subprocess.run(
                [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True, env=environment
            )
            found[variant] = float(done.stdout.splitlines()[-1])
        return found

    return measure


_MEMORY = """
import pathlib, resource, sys
if "{variant}" == "scipy":
    sys.modules["numba"] = None
import numpy as np
import meshlab_specsmooth as mss

def mesh(nx, ny):
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    t, p = 2 * np.pi * i / nx, 2 * np.pi * j / ny
    V = np.stack([(3 + np.cos(p)) * np.cos(2 * t), (3 + np.cos(p)) * np.sin(2 * t), np.sin(p) + np.sin(t)], axis=1)
    a, b, c, d = (((i + k) % nx * ny + (j + m) % ny) for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    random = np.random.default_rng(1)
    V += 0.2 * np.linalg.norm(V[F[:, 0]] - V[F[:, 1]], axis=1).mean() * random.standard_normal(V.shape)
    if "{variant}" == "shuffled":
        at = random.permutation(len(V))
        V, F = V[at], np.argsort(at)[F]
    return np.ascontiguousarray(V), np.ascontiguousarray(F)

V, F = mesh(60, 40)
{call}
V, F = mesh(1500, 600)
held = int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
pathlib.Path("/proc/self/clear_refs").write_text("5")
{call}
peak = next(l for l in pathlib.Path("/proc/self/status").read_text().splitlines() if "VmHWM" in l)
print((int(peak.split()[1]) * 1024 - held) / len({per}))
"""
