"""Filter scripts: ours among MeshLab's, recorded, saved, replayed, refused."""

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import descriptors, filters, meshset, scripts, xmltree
from tests.meshes import rough, torus

MESH = rough(torus(20, 12))
# more digits than MeshLab's files hold
WEIGHT = 0.312345678901234567


def session(ms):
    """A session that mixes MeshLab's filters and ours."""
    ms.apply_coord_taubin_smoothing(stepsmoothnum=2)
    mss.apply_coord_spectral_smoothing(ms, barycenter_weight=WEIGHT, wavelength=pymeshlab.PercentageValue(33.3333))
    ms.meshing_decimation_quadric_edge_collapse(targetfacenum=400)
    mss.apply_coord_spectral_enhancement(ms, gain=1.3)
    ms.apply_coord_laplacian_smoothing(stepsmoothnum=1)
    return ms.current_mesh().vertex_matrix()


@pytest.fixture
def recorded(tmp_path):
    """A saved script and what it made."""
    ms = meshset.new(*MESH)
    result = session(ms)
    path = tmp_path / "session.mlx"
    ms.save_filter_script(str(path))
    return path, result


def test_calls_are_recorded_with_every_parameter_and_every_digit(recorded):
    path, _ = recorded
    script = scripts.read(path)
    assert [step.name for step in script.steps] == [
        "Taubin Smooth",
        "Spectral Smooth",
        "Simplification: Quadric Edge Collapse Decimation",
        "Spectral Enhance",
        "Laplacian Smooth",
    ]
    values = {p["name"]: p["value"] for p in script.steps[1].parameters}
    assert float(values["barycenter_weight"]) == WEIGHT
    assert values["selected"] == "false"
    assert set(values) == {p.name for p in descriptors.load("apply_coord_spectral_smoothing").parameters}


def test_a_mixed_script_replays_to_the_bit_and_is_not_recorded_anew(recorded):
    path, result = recorded
    ms = meshset.new(*MESH)
    scripts.run(ms, scripts.read(path), filters.FILTERS)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), result)
    assert scripts.script_of(ms).steps == ()


@pytest.mark.parametrize("how", ["subclass", "registered"])
def test_methods_load_and_apply_what_was_saved(recorded, how, request):
    path, result = recorded
    if how == "registered":
        mss.register()
        request.addfinalizer(mss.unregister)
    ms = (mss if how == "subclass" else pymeshlab).MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    ms.load_filter_script(str(path))
    before = scripts.script_of(ms)
    ms.apply_filter_script()
    assert np.array_equal(ms.current_mesh().vertex_matrix(), result)
    assert scripts.script_of(ms) == before


def test_a_script_in_memory_applies_again(request):
    ms = mss.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    session(ms)
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    ms.apply_filter_script()
    other = meshset.new(*MESH)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), session(other))


def test_a_script_of_meshlab_s_own_filters_keeps_its_digits_in_memory():
    ms, native = mss.MeshSet(), pymeshlab.MeshSet()
    for m in (ms, native):
        m.add_mesh(pymeshlab.Mesh(*MESH))
        m.apply_coord_taubin_smoothing(lambda_=0.123456789, mu=-0.1334567, stepsmoothnum=3)
        m.apply_filter_script()
    assert np.array_equal(ms.current_mesh().vertex_matrix(), native.current_mesh().vertex_matrix())


FROM_MESHLAB = """<!DOCTYPE FilterScript>
<FilterScript>
 <filter name="Laplacian Smooth">
  <Param type="RichInt" value="2" name="stepSmoothNum" description="Smoothing steps" tooltip="steps"/>
  <Param type="RichBool" value="true" name="Boundary" description="1D Boundary Smoothing" tooltip="b"/>
  <Param type="RichBool" value="false" name="cotangentWeight" description="Cotangent weighting" tooltip="c"/>
  <Param type="RichBool" value="false" name="Selected" description="Affect only selected faces" tooltip="s"/>
 </filter>
</FilterScript>
"""


def test_ours_are_understood_by_their_python_names_and_meshlab_s_are_refused_with_theirs(recorded):
    path, _ = recorded
    text = path.read_text()
    path.write_text(text.replace("Spectral Smooth", "apply_coord_spectral_smoothing"))
    assert [step.name for step in scripts.read(path).steps][1] == "Spectral Smooth"
    path.write_text(text.replace("Laplacian Smooth", "apply_coord_laplacian_smoothing"))
    with pytest.raises(mss.InvalidXml, match="is a name of pymeshlab's; .* write 'Laplacian Smooth'"):
        scripts.check(scripts.read(path))


def test_a_script_saved_by_meshlab_runs(tmp_path):
    path = tmp_path / "meshlab.mlx"
    path.write_text(FROM_MESHLAB)
    ms, native = meshset.new(*MESH), meshset.new(*MESH)
    scripts.run(ms, scripts.read(path), filters.FILTERS)
    native.apply_coord_laplacian_smoothing(stepsmoothnum=2, cotangentweight=False)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), native.current_mesh().vertex_matrix())


def ours(**parameters):
    lines = "".join(f'\n  <Param name="{n}" value="{v}" type="RichString"/>' for n, v in parameters.items())
    return FROM_MESHLAB.replace(
        "</FilterScript>", f' <filter name="Spectral Smooth">{lines}\n </filter>\n</FilterScript>'
    )


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "not well-formed XML .no element found."),
        (FROM_MESHLAB[:300], 6, "not well-formed"),
        ("<Script/>", 1, "expected <FilterScript>, found <Script>"),
        ("<FilterScript><Filter/></FilterScript>", 1, 'expected <filter name="...">, found <Filter>'),
        (FROM_MESHLAB.replace("<Param type", "<Parm type", 1), 4, 'expected <Param name="...">, found <Parm>'),
        (FROM_MESHLAB.replace("Laplacian Smooth", "Laplacien Smooth"), 3, "nearest known name is 'Laplacian Smooth'"),
        (ours().replace("Spectral Smooth", "Spectral Smoth"), 9, "nearest known name is 'Spectral Smooth'"),
        (ours(nodes=3), 9, "filter 'Spectral Smooth' has no parameter 'nodes'"),
        (ours(modes="3.5"), 9, "modes of filter 'Spectral Smooth' is '3.5', which is not of type int"),
        (ours(modes="9", wavelength="2"), 9, "has both modes and a wavelength"),
        (ours(wavelength="inf"), 9, "wavelength of filter 'Spectral Smooth' is 'inf'"),
        (ours(modes="9").replace("<Param name", '<Param name="modes" value="8"/><Param name'), 9, "has 'modes' twice"),
        (ours(modes="-3"), 9, "modes of filter 'Spectral Smooth' is '-3'"),
        (ours(response="box"), 9, "response of filter 'Spectral Smooth' is 'box', which is not of type enum"),
        (ours(selected="maybe"), 9, "is 'maybe', which is not of type bool"),
        (ours(barycenter_weight="nan"), 9, "barycenter_weight of filter 'Spectral Smooth' is 'nan'"),
    ],
)
@pytest.mark.parametrize("how", ["run", "method"])
def test_an_invalid_script_is_refused_before_anything_runs(tmp_path, text, line, words, how):
    path = tmp_path / "bad.mlx"
    path.write_text(text)
    ms = mss.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    if how == "run":
        with pytest.raises(mss.InvalidXml, match=rf"bad\.mlx:{line}: .*{words}"):
            scripts.run(ms, scripts.read(path), filters.FILTERS)
    else:

        def load_and_apply():
            ms.load_filter_script(str(path))
            ms.apply_filter_script()

        with pytest.raises(pymeshlab.PyMeshLabException, match=words):
            load_and_apply()
    assert np.array_equal(ms.current_mesh().vertex_matrix(), MESH[0])


def test_a_missing_script_is_refused(tmp_path):
    with pytest.raises(mss.FileError, match="none.mlx: cannot be read: No such file"):
        scripts.read(tmp_path / "none.mlx")
    with pytest.raises(pymeshlab.PyMeshLabException, match="none.mlx: cannot be read"):
        mss.MeshSet().load_filter_script(str(tmp_path / "none.mlx"))


def test_names_are_known_exactly_as_meshlab_writes_them():
    known = ("Laplacian Smooth", "Simplification: Quadric Edge Collapse Decimation", "Alpha Wrap")
    unknown = ("laplacian smooth", "Laplacian-Smooth", "Alpha Warp Drive")
    assert scripts._find_unknown(known + unknown) == set(unknown)


def test_a_long_session_is_recorded_to_its_end(monkeypatch):
    monkeypatch.setattr(xmltree, "MAX_FILE_SIZE", 2000)
    ms = meshset.new(*MESH)
    for _ in range(3):
        mss.get_spectrum(ms)
    monkeypatch.undo()
    assert [step.name for step in scripts.script_of(ms).steps] == ["Spectrum"] * 3


def test_a_script_that_makes_its_own_mesh_runs_on_an_empty_meshset():
    ms = mss.MeshSet()
    ms.create_sphere(subdiv=4)
    ms.apply_coord_spectral_smoothing(modes=9)
    script = scripts.script_of(ms)
    empty = pymeshlab.MeshSet()
    scripts.run(empty, script, filters.FILTERS)
    assert np.array_equal(empty.current_mesh().vertex_matrix(), ms.current_mesh().vertex_matrix())


def test_parameters_without_a_type_are_accepted(tmp_path):
    path = tmp_path / "by_hand.mlx"
    path.write_text(
        '<FilterScript><filter name="Spectral Smooth"><Param name="modes" value="9"/></filter></FilterScript>'
    )
    ms, other = mss.MeshSet(), meshset.new(*MESH)
    ms.add_mesh(pymeshlab.Mesh(*MESH))
    ms.load_filter_script(str(path))
    ms.apply_filter_script()
    mss.apply_coord_spectral_smoothing(other, modes=9)
    assert np.array_equal(ms.current_mesh().vertex_matrix(), other.current_mesh().vertex_matrix())


def test_a_script_that_fails_half_way_keeps_the_meshset_s_own_script(recorded, monkeypatch):
    path, _ = recorded
    ms = meshset.new(*MESH)
    ms.apply_coord_taubin_smoothing(stepsmoothnum=1)
    before = scripts.script_of(ms)

    def fail(*_, **__):
        raise KeyboardInterrupt

    failing = dict(filters.FILTERS) | {"apply_coord_spectral_enhancement": fail}
    with pytest.raises(KeyboardInterrupt):
        scripts.run(ms, scripts.read(path), failing)
    assert scripts.script_of(ms) == before
