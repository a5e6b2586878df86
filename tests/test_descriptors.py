import dataclasses
import inspect
import re

import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth import parameters
from meshlab_specsmooth.errors import InvalidXml
from meshlab_specsmooth.meshlab import xmltree
from meshlab_specsmooth.meshlab.descriptors import Length, load, names, read

GOOD = """<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE MESHLAB_FILTER_INTERFACE>
<MESHLAB_FILTER_INTERFACE mfiVersion="2.0">
 <PLUGIN pluginName="P" pluginAuthor="A" pluginEmail="E">
  <FILTER filterName="Flatten All" filterFunction="apply_coord_flat" filterClass="Smoothing" filterPre="MM_NONE" filterPost="MM_VERTCOORD" filterArity="SingleMesh" filterRasterArity="NoRaster" filterIsInterruptible="false">
   <FILTER_HELP><![CDATA[ Makes <i>flat</i>. ]]></FILTER_HELP>
   <PARAM parName="much" parType="Boolean" parDefault="true" parIsImportant="true" parIsPersistent="false"><PARAM_HELP>Very?</PARAM_HELP><CHECKBOX_GUI guiLabel="Much"/></PARAM>
   <PARAM parName="count" parType="Int" parDefault="3" parIsImportant="false" parIsPersistent="false"><PARAM_HELP>How many.</PARAM_HELP><EDIT_GUI guiLabel="Count"/></PARAM>
   <PARAM parName="share" parType="Real" parDefault="0.5" parIsImportant="false" parIsPersistent="false"><PARAM_HELP>Share.</PARAM_HELP><SLIDER_GUI guiLabel="Share" guiMin="0" guiMax="1"/></PARAM>
   <PARAM parName="reach" parType="Real" parDefault="meshDoc.current().bboxDiag() / 50" parIsImportant="false" parIsPersistent="false"><PARAM_HELP>Reach.</PARAM_HELP><ABSPERC_GUI guiLabel="Reach" guiMin="0" guiMax="meshDoc.current().bboxDiag()"/></PARAM>
   <PARAM parName="way" parType="Enum {up : 0 | down : 1}" parDefault="down" parIsImportant="false" parIsPersistent="false"><PARAM_HELP>Way.</PARAM_HELP><ENUM_GUI guiLabel="Way"/></PARAM>
  </FILTER>
 </PLUGIN>
</MESHLAB_FILTER_INTERFACE>
"""  # noqa: E501


def test_every_part_is_read():
    filter_ = read(GOOD.encode(), "x.xml")
    assert (filter_.function, filter_.name, filter_.category) == ("apply_coord_flat", "Flatten All", "Smoothing")
    assert filter_.help == "Makes <i>flat</i>."
    assert [p.type for p in filter_.parameters] == ["bool", "int", "float", "length", "enum"]
    assert [p.default for p in filter_.parameters] == [True, 3, 0.5, Length(0.02), "down"]
    assert filter_["way"].values == ("up", "down")
    assert (filter_["share"].minimum, filter_["share"].maximum) == (0, 1)
    assert (filter_["reach"].label, filter_["reach"].help) == ("Reach", "Reach.")


@pytest.mark.parametrize(
    ("old", "new", "line", "reason"),
    [
        ('mfiVersion="2.0"', 'mfiVersion="1.0"', 3, "mfiVersion is '1.0'"),
        ('mfiVersion="2.0"', "", 3, "lacks mfiVersion"),
        ("MESHLAB_FILTER_INTERFACE", "INTERFACE", 3, "expected <MESHLAB_FILTER_INTERFACE>, found <INTERFACE>"),
        (' pluginEmail="E"', "", 4, "<PLUGIN> lacks pluginEmail"),
        (' pluginEmail="E"', ' pluginEmail="E" pluginFax="7"', 4, "unknown pluginFax"),
        ("apply_coord_flat", "flat out", 5, "'flat out' is not a Python name"),
        ("<FILTER_HELP><![CDATA[ Makes <i>flat</i>. ]]></FILTER_HELP>", "", 5, "expected <FILTER_HELP>, <PARAM>"),
        ("<FILTER_HELP>", "<HINT/><FILTER_HELP>", 5, "contains <HINT>, <FILTER_HELP>"),
        ("<PARAM_HELP>Very?</PARAM_HELP>", "", 7, "one PARAM_HELP and one GUI element"),
        ('parDefault="true"', 'parDefault="yes"', 7, "'yes' is neither true nor false"),
        ('<CHECKBOX_GUI guiLabel="Much"/>', '<STRING_GUI guiLabel="Much"/>', 7, "does not go with STRING_GUI"),
        ('parType="Boolean"', 'parType="Color"', 7, "parType 'Color' does not go with"),
        ('parName="count"', 'parName="the count"', 8, "'the count' is not a Python name"),
        ('parName="count"', 'parName="much"', 8, "'much' is described twice"),
        ('parDefault="3"', 'parDefault="3.5"', 8, "'3.5' is not an integer"),
        ('parDefault="0.5"', 'parDefault="half"', 9, "'half' is not a finite number"),
        ('parDefault="0.5"', 'parDefault="1.5"', 9, r"parDefault 1.5 lies outside \[0, 1\]"),
        ('guiMax="1"', 'guiMax="inf"', 9, "'inf' is not a finite number"),
        ("bboxDiag() / 50", "bboxDiag() / 0", 10, "divides by zero"),
        ("bboxDiag() / 50", "bboxDiag(); import os", 10, "is not a finite number"),
        ("{up : 0 | down : 1}", "{up : 1 | down : 0}", 11, "is not of the form"),
        ("Enum {up : 0 | down : 1}", "Enum up, down", 11, "is not of the form"),
        ('parDefault="down"', 'parDefault="left"', 11, "'left' is not one of up, down"),
        ('"SingleMesh"', '"Banana"', 5, "filterArity has 'Banana', which is not one of SingleMesh"),
        ('filterPre="MM_NONE"', 'filterPre="MM_NONE | MM_FOO"', 5, "filterPre has 'MM_FOO'"),
        ('"Smoothing"', '"Cooking"', 5, "filterClass has 'Cooking'"),
        ('filterIsInterruptible="false"', 'filterIsInterruptible="no"', 5, "filterIsInterruptible has 'no'"),
        ("<FILTER_HELP>", '<FILTER_HELP lang="de">', 6, "<FILTER_HELP> has unknown lang"),
        ('parIsPersistent="false"><PARAM_HELP>Very', 'parIsPersistent="x"><PARAM_HELP>Very', 7, "'x' is neither true"),
        ("{up : 0 | down : 1}", "{up : 0 | up : 1}", 11, "is not of the form"),
        ("</PLUGIN>", "</PLUGING>", 13, "not well-formed XML .mismatched tag."),
    ],
)
def test_a_malformed_descriptor_is_refused_with_file_line_and_reason(old, new, line, reason):
    assert old in GOOD
    broken = GOOD.replace(old, new)
    with pytest.raises(InvalidXml, match=rf"^bad\.xml:{line}: .*{reason}") as caught:
        read(broken.encode(), "bad.xml")
    assert caught.value.line == line


@pytest.mark.parametrize("text", ["0.02", "meshDoc.current().bboxDiag() * 0.02", "meshDoc.current().bboxDiag()"])
def test_the_expression_of_lengths_is_parsed_not_evaluated(text):
    filter_ = read(GOOD.replace("meshDoc.current().bboxDiag() / 50", text).encode(), "x.xml")
    share = {"0.02": 0.02, "meshDoc.current().bboxDiag()": Length(1.0)}.get(text, Length(0.02))
    assert filter_["reach"].default == share


def test_entities_and_depth_and_size_are_bounded(monkeypatch):
    bomb = b'<!DOCTYPE a [<!ENTITY b "boom">]><a>&b;</a>'
    with pytest.raises(InvalidXml, match="declares entities"):
        read(bomb, "x.xml")
    with pytest.raises(InvalidXml, match="deeper than"):
        read(b"<a>" * 100, "x.xml")
    monkeypatch.setattr(xmltree, "MAX_FILE_SIZE", 10)
    with pytest.raises(InvalidXml, match="has 43 bytes; at most 10"):
        read(bomb, "x.xml")
    with pytest.raises(InvalidXml, match="no element found"):
        read(b"", "x.xml")


def test_the_package_s_own_descriptors_are_well_formed_and_named_as_their_files():
    assert "apply_coord_spectral_smoothing" in names()
    for name in names():
        filter_ = load(name)
        assert filter_.function == name
        assert re.fullmatch(r"(apply|compute|get)_\w+", name)
        for parameter in filter_.parameters:
            assert parameter.help.endswith("."), (name, parameter.name)


# The classes of settings that a filter's parameters are fields of, and those of the operators
ISOTROPIC, EDGE_AWARE = {"laplacian": "uniform", "weld": True}, {"weld": True}
BOUNDARY = {
    name: each.default
    for name, each in inspect.signature(mss.smooth_boundary).parameters.items()
    if name not in ("mesh", "faces", "progress")
}
SETTINGS = {
    "apply_coord_spectral_smoothing": ((mss.Smoothing, mss.Region), ISOTROPIC),
    "compute_scalar_by_spectral_displacement": ((mss.Smoothing, mss.Region), ISOTROPIC),
    "apply_coord_spectral_low_pass": ((mss.LowPass, mss.Region), ISOTROPIC),
    "apply_coord_spectral_enhancement": ((mss.Enhancement, mss.Region), ISOTROPIC),
    "apply_coord_spectral_denoising": ((mss.Denoising, mss.EdgeAwareRegion), EDGE_AWARE),
    "apply_coord_edge_aware_smoothing": ((mss.EdgeAware, mss.EdgeAwareRegion), EDGE_AWARE),
    "compute_scalar_by_noise_level": ((), {"unit": "mesh"} | EDGE_AWARE),
    "compute_scalar_by_estimated_error": ((), {"after": "denoising"} | EDGE_AWARE),
    "apply_coord_boundary_smoothing": ((), BOUNDARY),
    "get_spectrum": (
        (),
        {"laplacian": "uniform", "bands": inspect.signature(mss.spectrum).parameters["bands"].default},
    ),
}
# taken from the MeshSet by a filter, and passed as arrays to a function; the third entry of the spacing
FROM_THE_MESH = {"features", "selected", "creases", "crease_angle", "slice_spacing"}
ARRAYS = {"mask", "features", "creases"}
# fields without effect in a filter; meaning of "auto" for enhancement, which chooses no weight
WITHOUT = {
    "compute_scalar_by_spectral_displacement": {"feature_gain", "max_displacement"},
    "apply_coord_spectral_low_pass": {"boundary", "feature_gain"},
    "apply_coord_spectral_enhancement": {"feature_gain"},
}
MEANT = {"apply_coord_spectral_enhancement": {"boundary": "fixed"}}
# accepted by the numerics; None: any positive number
BOUNDS = {
    "max_displacement": None,
    "rings": (0, 100),
    "corner_angle": (0, 180),
    "modes": None,
    "wavelength": None,
    "longest": None,
    "shortest": None,
    "barycenter_weight": parameters.BARYCENTER_WEIGHT_BOUNDS,
    "feature_gain": parameters.GAIN_BOUNDS,
    "gain": parameters.GAIN_BOUNDS,
    "strength": parameters.STRENGTH_BOUNDS,
    "range_sigma": parameters.RANGE_SIGMA_BOUNDS,
    "iterations": (1, parameters.MAX_ITERATIONS),
    "bands": parameters.BAND_BOUNDS,
    "tolerance": parameters.TOLERANCE_BOUNDS,
    "spacing": parameters.SPACING_BOUNDS,
}
FACE_BOUNDS = BOUNDS | {"iterations": (1, parameters.MAX_FACE_ITERATIONS)}


def fields_of(name):
    """Fields of the settings of a filter and their defaults, of which the numerics are the only source."""
    classes, found = SETTINGS[name]
    for setting in classes:
        for field in dataclasses.fields(setting):
            found = found | setting.replaced.get(field.name, {field.name: field.default})
    return found


def test_every_filter_has_settings():
    assert SETTINGS.keys() == set(names())


@pytest.mark.parametrize("name", SETTINGS)
def test_a_filter_and_its_function_on_arrays_have_the_same_parameters_and_defaults(name):
    described = {p.name: p.default for p in load(name).parameters if p.name not in FROM_THE_MESH}
    left_out = ARRAYS | WITHOUT.get(name, set())
    fields = {key: value for key, value in fields_of(name).items() if key not in left_out}
    assert described.keys() == fields.keys()
    # every parameter of a filter has a value: 0 stands for None
    assert described == {key: 0 if value is None else value for key, value in (fields | MEANT.get(name, {})).items()}


@pytest.mark.parametrize("name", SETTINGS)
def test_the_bounds_of_a_filter_are_within_those_of_its_function(name):
    fields = fields_of(name)
    known = FACE_BOUNDS if mss.EdgeAware in SETTINGS[name][0] else BOUNDS
    for parameter in load(name).parameters:
        if parameter.type not in ("int", "float", "length") or parameter.name in FROM_THE_MESH:
            continue
        bounds = known[parameter.name]
        if bounds is not None:
            assert parameter.maximum <= bounds[1], parameter.name
        low = 0 if bounds is None else bounds[0]
        stands_for_none = fields[parameter.name] is None and parameter.minimum == 0
        assert stands_for_none or parameter.minimum >= low, parameter.name
