"""The spectrum of a surface: how its shape, its detail and its noise are spread over frequencies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from meshlab_specsmooth.adapters import Mesh, accept_meshes
from meshlab_specsmooth.arrays import Floats
from meshlab_specsmooth.choices import LaplacianKind
from meshlab_specsmooth.describe import Described, Rows, format_length
from meshlab_specsmooth.errors import InvalidParameter
from meshlab_specsmooth.geometry.surface import LARGEST_EXPONENT, check_extent
from meshlab_specsmooth.noise.model import Noise
from meshlab_specsmooth.operators.assemble import Operators, as_operators, as_uniform
from meshlab_specsmooth.parameters import BAND_BOUNDS, check_count
from meshlab_specsmooth.risk.estimate_error import estimate_noise_of
from meshlab_specsmooth.runtime import blocks
from meshlab_specsmooth.spectral import density, eigenbasis

# Defaults; those of the filter, in filters_xml/, are the same
_BANDS = 64
_LAPLACIAN: LaplacianKind = "uniform"

# Noise is flat over the modes and shape is not: beyond this eigenvalue (waves shorter than 2.9 edges) there is little
# but noise on a mesh that resolves its shape
NOISE_BEGINS = 1.2

_LEAKS_FROM = 0.1


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum(Described):
    """Power over bands of the Laplacian's spectrum; (k,) arrays, from low to high frequency.

    Attributes
    ----------
    eigenvalue : float64
        Middle of each band, in [0, 2]; up to 1000 vertices each eigenvalue is a band by itself.
    wavelength : float64
        Length of the surface wave there, in mesh units; infinite at 0.
    modes : float64
        Number of modes in each band.
    coordinate_power : float64
        Energy of the centered coordinates, summed over x, y and z, in squared mesh units.
    differential_power : float64
        Energy of the differential coordinates.
    noise_floor : float
        Standard deviation of the noise on each coordinate that would explain the power beyond eigenvalue 1.2, in mesh
        units. On uneven triangles up to 40 % too high.
    method : str
        ``"exact"`` from eigenvalues, ``"chebyshev"`` from moments, which leak a little between neighboring bands.
    noise : Noise
        The estimate of :func:`meshlab_specsmooth.estimate_noise`, which the filters go by. The noise floor is another
        quantity: it takes all short waves for noise, fine detail and uneven triangles as well.
    """

    eigenvalue: Floats
    wavelength: Floats
    modes: Floats
    coordinate_power: Floats
    differential_power: Floats
    noise_floor: float
    method: str
    noise: Noise

    @property
    def summary(self) -> str:
        """The noise, and what the spectrum consists of, in a few words."""
        bands = "eigenvalues" if self.method == "exact" else "bands"
        return f"spectrum of {round(float(self.modes.sum()))} modes in {len(self.modes)} {bands}; {self.noise.summary}"

    def rows(self) -> Rows:
        """The noise, and the noise floor for comparison."""
        edge = self.noise.mean_edge
        return [
            ("noise", self.noise.describe_level()),
            (
                "noise floor",
                f"{format_length(self.noise_floor, edge)} a coordinate, detail and uneven triangles included",
            ),
            ("method", self.method),
            ("mean edge", f"{edge:.4g}"),
        ]


@accept_meshes
def spectrum(
    mesh: Mesh, faces: npt.ArrayLike | None = None, *, bands: int = _BANDS, laplacian: LaplacianKind = _LAPLACIAN
) -> Spectrum:
    """Measure the spectrum of a surface.

    Parameters
    ----------
    mesh : (n, 3) real array, or a mesh of any kind
    faces : (m, 3) integer array, optional
        As for :func:`meshlab_specsmooth.smooth`.
    bands : int
        Number of bands, equally wide in frequency; without effect up to 1000 vertices.
    laplacian : {"uniform", "cotangent"}

    Raises
    ------
    InvalidSurface
        The arrays are no triangle mesh.
    InvalidParameter
        Fewer than 2 or more than 4096 bands, or a mesh without an edge, which has no spectrum.

    Examples
    --------
    >>> import numpy as np
    >>> import meshlab_specsmooth as mss
    >>> octahedron = np.vstack([np.eye(3), -np.eye(3)])
    >>> faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    >>> mss.spectrum(octahedron, faces).eigenvalue.round(9) + 0.0
    array([0. , 1. , 1. , 1. , 1.5, 1.5])
    """
    bands = check_count("bands", bands, *BAND_BOUNDS)
    ops = as_operators(mesh, faces, laplacian)
    if len(ops.active) == 0:
        raise InvalidParameter("a mesh without edges has no spectrum")
    check_extent(ops.exponent, LARGEST_EXPONENT, "power, which is their square")
    with blocks.one_blas_thread():
        noise = estimate_noise_of(as_uniform(ops)).scaled(ops.exponent)
    return _measure(ops, bands, noise)


@blocks.one_blas_thread()
def _measure(ops: Operators, bands: int, noise: Noise) -> Spectrum:
    L, n = ops.L, len(ops.active)
    # scaled so that energies x^T D x are those of plain coordinates
    X = (ops.positions - ops.positions.mean(axis=0)) / np.sqrt(L.degree.mean())
    Y = L @ X
    if n <= eigenbasis.DENSE_VERTICES:
        basis = eigenbasis.full(L.graph.symmetric_laplacian())
        eigenvalue, modes, method = np.clip(basis.eigenvalues, 0, 2), np.ones(n), "exact"
        powers = [((basis.vectors.T @ (np.sqrt(L.degree) * Z)) ** 2).sum(axis=1) for Z in (X, Y)]
    else:
        # frequency is arccos(1 - lambda), the angle that the polynomials resolve evenly
        angles = np.linspace(0, np.pi, bands + 1)
        eigenvalue, method = 1 - np.cos((angles[1:] + angles[:-1]) / 2), "chebyshev"
        signs = density.random_signs(n, density.PROBES) / np.sqrt(L.degree)
        modes = density.band_energies(L, signs, angles) / density.PROBES
        powers = [np.maximum(density.band_energies(L, Z, angles), 0.0) for Z in (X, Y)]
        # shape is so much stronger than detail that a trace of it leaks everywhere; not where it was differentiated
        powers[0] = np.where(eigenvalue < _LEAKS_FROM, powers[0], powers[1] / eigenvalue**2)
    unit = np.ldexp(1.0, ops.exponent)
    edge = ops.mean_edge * unit
    wavelength = np.full(len(eigenvalue), np.inf)
    np.divide(np.pi * edge, np.sqrt(eigenvalue), out=wavelength, where=eigenvalue > 0)
    noisy = eigenvalue > NOISE_BEGINS
    floor = np.sqrt(powers[0][noisy].sum() / (3 * max(modes[noisy].sum(), 1.0)))
    return Spectrum(
        eigenvalue,
        wavelength,
        modes,
        powers[0] * unit**2,
        powers[1] * unit**2,
        float(floor) * float(unit),
        method,
        noise,
    )
