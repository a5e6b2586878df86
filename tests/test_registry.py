"""Our filters among pymeshlab's, and out again without a trace."""

import contextlib
import io
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import descriptors, filters
from tests.meshes import rough, torus

MESH = rough(torus(20, 12))


@pytest.fixture(autouse=True)
def unregistered():
    """Whatever ran before, these tests start and end without."""
    mss.unregister()
    yield
    mss.unregister()


@pytest.fixture
def registered(unregistered):
    mss.register()


def everything():
    return {target: dict(vars(target)) for target in (pymeshlab.MeshSet, pymeshlab)}


def test_registering_is_idempotent_and_unregistering_restores_everything():
    before = everything()
    for _ in range(2):
        mss.register()
        mss.register()
        assert hasattr(pymeshlab.MeshSet, "apply_coord_spectral_smoothing")
        mss.unregister()
        mss.unregister()
        after = everything()
        for target, names in before.items():
            assert names.keys() == after[target].keys()
            assert all(after[target][name] is value for name, value in names.items())


def test_threads_may_register_at_once():
    before = everything()
    threads = [threading.Thread(target=mss.register if i % 2 else mss.unregister) for i in range(40)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    mss.unregister()
    assert everything() == before


@pytest.mark.no_cover
@pytest.mark.parametrize("name", filters.FILTERS)
def test_each_filter_is_called_in_all_the_ways_of_a_native_one(registered, name):
    given = {p.name: p.values[-1] for p in descriptors.load(name).parameters if p.values}
    given = dict([*given.items()][:1]) or {"weld": False}
    results = []
    for call in (
        lambda ms: getattr(ms, name)(**given),
        lambda ms: ms.apply_filter(name, **given),
        lambda ms: filters.FILTERS[name](ms, **given),
    ):
        ms = pymeshlab.MeshSet()
        ms.add_mesh(pymeshlab.Mesh(*MESH))
        output = call(ms)
        assert isinstance(output, dict)
        results.append((ms.current_mesh().vertex_matrix(), ms.current_mesh().vertex_scalar_array()))
    for other in results[1:]:
        assert np.array_equal(results[0][0], other[0])
        assert np.array_equal(results[0][1], other[1])


def printed(function, *arguments):
    """What a pymeshlab function prints through Python."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        function(*arguments)
    return text.getvalue()


def test_filters_are_found_and_listed(registered):
    assert set(filters.FILTERS) <= set(pymeshlab.filter_list())
    assert pymeshlab.filter_list() == sorted(pymeshlab.filter_list())
    assert "apply_coord_taubin_smoothing" in pymeshlab.filter_list()
    assert "apply_coord_spectral_smoothing" in printed(pymeshlab.search, "spectral")
    for words in ("Spectral Smooth", "spectral smoothing", "smoothing spectral", "apply_coord_spectral_smoothing"):
        assert "apply_coord_spectral_smoothing" in printed(pymeshlab.search, words)
    assert "get_spectrum" not in printed(pymeshlab.search, "taubin")
    lines = printed(pymeshlab.search, "smooth").splitlines()
    assert {line.split()[0] for line in lines} == set(filters.FILTERS) - {"get_spectrum"}
    assert len({line.index(":") for line in lines}) == 1
    assert all(line.split()[2] == f"help(meshlab_specsmooth.{line.split()[0]})" for line in lines)
    for words in ("low-pass", "lowpass", "Low Pass", "low_pass"):
        assert "apply_coord_spectral_low_pass " in printed(pymeshlab.search, words)
    assert "get_spectrum" in printed(pymeshlab.print_filter_list)
    listed = printed(pymeshlab.print_filter_parameter_list, "apply_coord_spectral_smoothing")
    assert "barycenter_weight : float in [0, 1000] = 0.0" in listed
    with pytest.raises(pymeshlab.PyMeshLabException, match="nope filter not found"):
        pymeshlab.print_filter_parameter_list("nope")


def test_parameter_values_are_those_that_a_call_would_use(registered):
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    values = ms.filter_parameter_values("apply_coord_spectral_smoothing", wavelength=pymeshlab.PercentageValue(10))
    assert values["wavelength"] == pytest.approx(0.1 * ms.current_mesh().bounding_box().diagonal())
    assert values["selected"] is False
    ms.set_selection_all()
    assert ms.filter_parameter_values("apply_coord_spectral_smoothing")["selected"] is True
    marked = ms.filter_parameter_values("apply_coord_spectral_smoothing", features="vertex_selection")
    assert marked["selected"] is False  # as in a call: the selection marks, it does not restrict
    assert ms.filter_parameter_values("apply_coord_taubin_smoothing")["stepsmoothnum"] == 10
    with pytest.raises(pymeshlab.PyMeshLabException, match="requires at least one mesh loaded"):
        pymeshlab.MeshSet().filter_parameter_values("apply_coord_spectral_smoothing")


def test_other_filters_are_passed_through(registered):
    ms = pymeshlab.MeshSet()
    with pytest.raises(pymeshlab.PyMeshLabException, match="Failed to apply filter: nope"):
        ms.apply_filter("nope")
    with pytest.raises(pymeshlab.PyMeshLabException, match=r"Did you mean apply_coord_spectral_smoothing\?"):
        ms.apply_filter("apply_coord_spectral_smothing")
    assert ms.create_sphere() is None
    assert ms.apply_filter("create_sphere") == {}
    assert ms.get_geometric_measures()["mesh_volume"] > 0


def test_the_subclass_knows_them_without_registering():
    ms = mss.MeshSet()
    assert isinstance(ms, pymeshlab.MeshSet)
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    ms.apply_coord_spectral_smoothing(modes=20)
    ms.apply_filter("apply_coord_spectral_low_pass", modes=20)
    ms.apply_coord_taubin_smoothing()
    assert not hasattr(pymeshlab.MeshSet, "apply_coord_spectral_smoothing")
    assert "mesh" in mss.MeshSet.apply_coord_spectral_smoothing.__doc__


NATIVE_TESTS = Path(pymeshlab.__file__).parent / "tests"
EXAMPLES = sorted(path.stem for pattern in ("example_*.py", "test_*.py") for path in NATIVE_TESTS.glob(pattern))
RUN = """
import importlib, sys
if sys.argv[1] == "registered":
    import meshlab_specsmooth
    meshlab_specsmooth.register()
sys.path.insert(0, ".")
for name in sys.argv[2:]:
    try:
        module = importlib.import_module("tests." + name)
        getattr(module, name)()
        outcome = "passed"
    except BaseException as error:
        outcome = type(error).__name__ + " " + str(error).splitlines()[0]
    print("\\nOUTCOME", name, outcome, flush=True)
"""


@pytest.mark.no_cover
@pytest.mark.skipif(not EXAMPLES, reason="this pymeshlab comes without its examples")
def test_pymeshlab_s_own_examples_have_the_same_outcome(tmp_path):
    def outcomes(how, names):
        folder = tmp_path / how
        shutil.copytree(NATIVE_TESTS, folder / "tests")
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
        command = [sys.executable, "-c", RUN, how, *names]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment, check=False)
        lines = [line.split(maxsplit=2) for line in done.stdout.splitlines() if line.startswith("OUTCOME")]
        return {name: outcome for _, name, outcome in lines}

    found = outcomes("registered", EXAMPLES)
    failed = [name for name in EXAMPLES if found.get(name) != "passed"]
    if failed:  # so they do without us
        native = outcomes("native", failed)
        assert {name: found.get(name) for name in failed} == {name: native.get(name) for name in failed}
    assert len(EXAMPLES) - len(failed) > 15
