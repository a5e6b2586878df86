"""Random meshes for fuzz.py: valid, damaged, with extreme coordinates, invalid, and in various containers."""

from typing import Any

import numpy as np

Rng = np.random.Generator


def torus(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    nx, ny = (int(x) for x in rng.integers(3, 8, 2))
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    t, p = 2 * np.pi * i / nx, 2 * np.pi * j / ny
    V = np.stack([(3 + np.cos(p)) * np.cos(t), (3 + np.cos(p)) * np.sin(t), np.sin(p)], axis=1)
    a, b, c, d = (((i + x) % nx) * ny + (j + y) % ny for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return V, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def sheet(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    nx, ny = (int(x) for x in rng.integers(2, 7, 2))
    i, j = (x.ravel() for x in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    a = (np.arange(nx - 1)[:, None] * ny + np.arange(ny - 1)).ravel()
    V = np.stack([i, j, 0.1 * i * j], axis=1).astype(float)
    return V, np.concatenate([np.stack([a, a + ny, a + ny + 1], axis=1), np.stack([a, a + ny + 1, a + 1], axis=1)])


def soup(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    n = int(rng.integers(1, 20))
    return rng.normal(size=(n, 3)), rng.integers(0, n, (int(rng.integers(1, 24)), 3))


def fan(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    n = int(rng.integers(4, 20))
    return rng.random((n, 3)), np.array([[0, 1, k] for k in range(2, n)])


def triangles(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    n = int(rng.integers(1, 8))
    return rng.random((3 * n, 3)), np.arange(3 * n).reshape(n, 3)


def tetrahedron(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    return np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


SHAPES = (torus, torus, sheet, sheet, soup, soup, fan, triangles, tetrahedron)


def damage_faces(F: np.ndarray, n: int, rng: Rng) -> np.ndarray:
    """Add the defects of real files: duplicate and degenerate faces, more than two faces at an edge."""
    what = int(rng.integers(0, 8))
    if what == 0:
        return np.concatenate([F, F[: len(F) // 2]])
    if what == 1:
        return np.concatenate([F, np.repeat(rng.integers(0, n, (2, 1)), 3, axis=1)])
    if what == 2:
        return np.concatenate([F, rng.integers(0, n, (3, 3))])
    if what == 3:
        return F[rng.permutation(len(F))][: max(1, len(F) // 2)]
    return F


def distort(V: np.ndarray, rng: Rng) -> np.ndarray:
    """Scale coordinates to extreme values, or flatten the shape in some direction."""
    V = V + rng.choice([0.0, 0.05, 0.3]) * rng.normal(size=V.shape)
    what = int(rng.integers(0, 24))
    if what == 0:
        return V * 10.0 ** rng.integers(-300, 300)
    if what == 1:
        return np.ldexp(V, int(rng.integers(-1080, 998)))
    if what == 2:
        return V * 10.0 ** rng.integers(-150, 150, V.shape)
    if what == 3:
        return V * 10.0 ** rng.integers(-300, 300, (len(V), 1))
    if what == 4:
        V = V * 10.0 ** rng.choice([-300, -157, -10, 0, 10, 100, 153, 154, 157, 200])
        V[rng.integers(len(V))] = rng.choice([1e300, -1e300, 1e157, 1e10, 1e-300])
        return V
    if what == 5:
        return V * rng.choice([0.0, 1.0, 1e-8, 1e-160, 1e-315], 3)
    if what == 6:
        return V + rng.choice([1e6, 1e12, 1e16, 1e100, 1e300])
    if what == 7:
        return np.repeat(V[:1], len(V), axis=0)
    if what == 8:
        V[: len(V) // 2] = V[0]
        return V
    if what == 9:
        V[rng.integers(len(V))] *= 5e-324
        return V
    if what == 10:
        return np.round(V * 4) / 4
    if what == 11:
        V[::2] *= rng.choice([1e-200, 1e-20, 1e20, 1e200])
        return V
    return V


class Odd:
    """An object that raises unexpected exceptions."""

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        raise ZeroDivisionError("no array")

    def __repr__(self) -> str:
        raise RuntimeError("no text")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("not to be compared")

    __hash__ = None  # type: ignore[assignment]


def hostile_vertices(V: np.ndarray, rng: Rng) -> Any:
    W = V.copy()
    W[rng.integers(len(W)), rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf, 1e308])
    choices = (
        *(W, W, V[:, :2], V.ravel(), V[None], V[:0], [], None, "surface", b"surface", 3.0, object(), Odd(), {}, {1, 2}),
        *(V.astype(complex), V > 0, V.astype(str), V.astype(object), [[1, 2, 3], [4]], [[10**400, 0, 0]] * len(V)),
        *([[None, None, None]] * len(V), np.ma.masked_greater(V, 0.5), np.full(V.shape, 3, "m8[s]"), iter(V.tolist())),
        *(np.full(V.shape, np.longdouble("1e4000")), np.array(V.tolist(), dtype=np.longdouble), V.T),
    )
    return choices[rng.integers(len(choices))]


def hostile_faces(F: np.ndarray, n: int, rng: Rng) -> Any:
    G = F.astype(np.int64)
    G[rng.integers(len(G)), rng.integers(3)] = rng.choice([-1, n, 2**31, 2**62, -(2**63)])
    choices = (
        *(G, G, G, F[:, :2], F.ravel(), F[None], F[:0], [], None, "faces", 3, object(), Odd(), {}, F > 0),
        *(F.astype(float), F.astype(complex), F.astype(str), F.astype(object), [[0, 1, 2], [0]], [[10**400, 0, 0]]),
        *([[None, None, None]], np.array([[2**64 - 1, 0, 0]], dtype=np.uint64), F.astype("m8[s]"), iter(F.tolist())),
    )
    return choices[rng.integers(len(choices))]


def contained(V: np.ndarray, F: np.ndarray, rng: Rng) -> tuple[Any, Any]:
    """Wrap a mesh in one of the containers that users pass."""
    what = int(rng.integers(0, 12))
    if what == 0:
        return V.tolist(), F.tolist()
    if what == 1:
        return np.asfortranarray(V), np.asfortranarray(F)
    if what == 2 and np.abs(V).max() < 1e38:
        return V.astype(np.float32), F.astype(np.uint64)
    if what == 3:
        return V.astype(np.longdouble), F.astype(np.uint8)
    if what == 4 and np.abs(V).max() < 6e4:
        return V.astype(np.float16), F.astype(np.int16)
    if what == 5:
        V.flags.writeable = F.flags.writeable = False
    if what == 6:
        return V[::-1][::-1], tuple(map(tuple, F.tolist()))
    return V, F


def mesh_of(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    """Make arrays that Surface accepts."""
    V, F = SHAPES[rng.integers(len(SHAPES))](rng)
    if rng.random() < 0.2:
        V = np.concatenate([V, rng.normal(size=(2, 3))])  # unreferenced
    F = damage_faces(F, len(V), rng)
    return distort(V, rng), F
