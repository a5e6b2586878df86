"""At the ends of what numbers and parameters can be: a finite result or a typed error, and no warning."""

import contextlib

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import meshset
from meshlab_specsmooth.meshlab.descriptors import load
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.meshlab.parameters import PyMeshLabException
from tests.meshes import TETRAHEDRON, TRIANGLE, rough, sheet, together, torus

V, F = rough(torus(8, 6))
S = rough(sheet(6, 5))
rng = np.random.default_rng(0)
MESHES = {
    "1e300": (V * 1e300, F),
    "1e-300": (V * 1e-300, F),
    "beyond what is taken": (V * 1e307, F),
    "components at 1e-300 and 1e300": together((V * 1e-300, F), (V * 1e300, F)),
    "components at 1e-6 and 1e6": together((V * 1e-6, F), (V * 1e6, F)),
    "far away": (V + 1e16, F),
    "so far that all is one point": (V + 1e300, F),
    "coordinates of 1e200 and 1e-200": (np.where(rng.random(V.shape) < 0.5, V * 1e200, V * 1e-200), F),
    "subnormal": (V * 1e-315, F),
    "subnormal in parts": (np.concatenate([V[:9] * 5e-324, V[9:]]), F),
    "flat but for subnormals": (V * [1, 1, 1e-315], F),
    "one spike": (np.concatenate([V[:-1], [[1e300, 0, 0]]]), F),
    "near 1e157 but for one": (np.concatenate([V[:-1] * 1e157, [[1e300, 0, 0]]]), F),
    "far from a component without extent": together((V * 0 + 1e300, F), (V * 1e-10, F)),
    "slivers": (V * [1, 1, 1e-6], F),
    "flat": (V * [1, 1, 0], F),
    "a line": (V * [1, 0, 0], F),
    "a point": (V * 0, F),
    "open": S,
    "open, 1e300": (S[0] * 1e300, S[1]),
    "one vertex": (np.zeros((1, 3)), np.array([[0, 0, 0]])),
    "two vertices": (np.eye(3)[:2], np.array([[0, 1, 1]])),
    "three vertices": TRIANGLE,
    "four vertices": TETRAHEDRON,
    "a fan": (rng.random((20, 3)), np.array([[0, 1, k] for k in range(2, 20)])),
    "a soup, all at the boundary": (rng.random((30, 3)), np.arange(30).reshape(10, 3)),
    "every face three times": (V, np.concatenate([F, F, F])),
}
CALLS = {
    "smooth": [
        *({}, {"modes": 1}, {"wavelength": 1e-300}, {"wavelength": 1e300}, {"iterations": 3}, {"boundary": "curve"}),
        *({"barycenter_weight": w} for w in (1e-3, 1e3)),
        *({"response": name, "method": "chebyshev"} for name in ("ideal", "butterworth", "gaussian", "heat")),
        {"boundary": "free", "response": "butterworth", "wavelength": 1e300},
    ],
    "low_pass": [{}, {"modes": 1}, {"wavelength": 1e-300}, {"wavelength": 1e300}, {"method": "chebyshev"}],
    "enhance": [{}, {"gain": 0.0}, {"gain": 1e3}, {"longest": 1e300, "shortest": 1e-300}, {"method": "chebyshev"}],
}


def assert_finite(result, shape):
    assert result.vertices.shape == shape
    assert np.isfinite(result.vertices).all()
    numbers = {name: x for name, x in vars(result).items() if isinstance(x, float)}
    assert np.isnan(numbers.pop("modes_error")) or result.modes_error >= 0  # of Weyl's law there is none
    assert all(np.isfinite(x) for x in numbers.values()), numbers


@pytest.mark.no_cover
@pytest.mark.parametrize("laplacian", ["uniform", "cotangent"])
@pytest.mark.parametrize("name", MESHES)
def test_a_result_is_finite_or_refused(name, laplacian):
    vertices, faces = MESHES[name]
    before = vertices.copy()
    try:
        ops = mss.assemble(vertices, faces, laplacian=laplacian)
    except mss.InvalidSurface:
        assert name == "beyond what is taken"
        return
    for method, calls in CALLS.items():
        for call in calls:
            with contextlib.suppress(mss.InvalidParameter):
                assert_finite(getattr(mss, method)(ops, **call), vertices.shape)
    try:
        spectrum = mss.spectrum(vertices, faces, laplacian=laplacian)
    except (mss.InvalidSurface, mss.InvalidParameter):
        pass
    else:
        assert np.isfinite(spectrum.coordinate_power).all()
        assert not np.isnan(spectrum.wavelength).any()
    for function in (mss.smooth_edge_aware, mss.denoise):
        if laplacian == "uniform":
            with contextlib.suppress(mss.InvalidSurface):
                assert np.isfinite(function(vertices, faces).vertices).all()
    assert np.array_equal(vertices, before)


def at_its_ends(parameter):
    if parameter.type == "enum":
        return parameter.values
    if parameter.type == "bool":
        return (False, True)
    if parameter.type == "int":
        return (int(parameter.minimum), min(int(parameter.maximum), 5))
    return (0.0, 1e300) if parameter.type == "length" else (parameter.minimum, parameter.maximum)


@pytest.mark.no_cover
@pytest.mark.parametrize("function", FILTERS)
def test_a_filter_at_the_ends_of_each_parameter_changes_the_mesh_to_a_finite_one_or_not_at_all(function):
    for name in ("open", "1e300", "one vertex"):
        vertices, faces = MESHES[name]
        for parameter in load(function).parameters:
            for value in at_its_ends(parameter):
                ms = meshset.new(vertices, faces)
                try:
                    FILTERS[function](ms, **{parameter.name: value})
                except (mss.SpecsmoothError, PyMeshLabException):
                    assert np.array_equal(ms.current_mesh().vertex_matrix(), vertices)
                else:
                    assert np.isfinite(ms.current_mesh().vertex_matrix()).all()
                assert ms.mesh_number() == 1
