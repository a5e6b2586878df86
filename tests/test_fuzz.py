"""Readers and the gate on anything at all; seeded, so that every run tries the same."""

import contextlib
import time

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra import numpy as hnp

import meshlab_specsmooth as mss
from meshlab_specsmooth import descriptors
from meshlab_specsmooth.bridge import scripts
from meshlab_specsmooth.xmltree import LARGEST_FILE, parse
from tests.meshes import meshes

fuzz = settings(max_examples=300, derandomize=True, deadline=None)

PIECES = [
    *("<FilterScript>", "</FilterScript>", "<filter name=", "</filter>", "<Param name=", "/>", ">", "<", "&", '"', "'"),
    *(
        "<!DOCTYPE a [",
        "<!ENTITY b 'c'>",
        "]>",
        "&b;",
        "&#0;",
        "&#x10FFFF;",
        "<![CDATA[",
        "]]>",
        "<!--",
        "-->",
        "<?x ?>",
    ),
    *(
        '"Spectral Smooth"',
        '"modes"',
        ' value="1"',
        ' value="1e999"',
        ' value="nan"',
        ' type="RichInt"',
        "\0",
        "\ufeff",
    ),
]
SHIPPED = [
    descriptors.files("meshlab_specsmooth.filters_xml").joinpath(f"{n}.xml").read_bytes() for n in descriptors.names()
]
SCRIPT = (
    "<!DOCTYPE FilterScript>\n<FilterScript>\n"
    + scripts.step_of(
        descriptors.load("get_spectrum"),
        {p.name: p.default for p in descriptors.load("get_spectrum").parameters},
    )
    + "</FilterScript>\n"
).encode()

soup = st.one_of(
    st.binary(max_size=300),
    st.lists(st.one_of(st.sampled_from(PIECES), st.text(max_size=5)), max_size=20).map(
        lambda words: "".join(words).encode("utf-8", "surrogatepass")
    ),
)


@st.composite
def damaged(draw, originals):
    """A good document with some bytes replaced, cut out, or doubled."""
    data = bytearray(draw(st.sampled_from(originals)))
    for _ in range(draw(st.integers(1, 4))):
        first = draw(st.integers(0, len(data)))
        last = min(len(data), first + draw(st.integers(0, 20)))
        data[first:last] = draw(
            st.one_of(
                st.binary(max_size=8), st.sampled_from(PIECES).map(str.encode), st.just(bytes(data[first:last] * 2))
            )
        )
    return bytes(data)


@pytest.mark.no_cover
@fuzz
@given(st.one_of(soup, damaged(SHIPPED)))
def test_a_descriptor_of_any_bytes_is_read_or_refused(data):
    with contextlib.suppress(mss.InvalidXml):
        assert descriptors.read(data, "x.xml").function


@pytest.mark.no_cover
@fuzz
@given(st.one_of(soup, damaged([SCRIPT])))
def test_a_script_of_any_bytes_is_read_or_refused(data):
    with contextlib.suppress(mss.InvalidXml):
        script = scripts._script(data, "x.mlx")
        ours = scripts._ours()
        for step in script.steps:
            if step.name in ours:
                scripts._values(step, ours[step.name], script.source)


@pytest.mark.parametrize(
    "data",
    [
        b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>',
        b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
        b'<!DOCTYPE a SYSTEM "http://127.0.0.1:1/x.dtd"><a>&b;</a>',
        b'<!DOCTYPE a [<!ENTITY % b SYSTEM "file:///etc/passwd">%b;]><a/>',
        b"<a>" * 40 + b"</a>" * 40,
        b"<a>" + b" " * LARGEST_FILE + b"</a>",
    ],
)
def test_entities_depth_and_size_are_refused(data):
    with pytest.raises(mss.InvalidXml):
        parse(data, "x.xml")


def test_a_document_takes_as_long_as_it_is():
    """Text came a line at a time, and was copied at every line: half a megabyte of them took 24 s."""
    for filling in (b"\n", b"&#10;", b"<!---->\n", b"<![CDATA[\n]]>"):
        data = b"<a>" + filling * (2**19 // len(filling)) + b"</a>"
        start = time.process_time()
        parse(data, "x.xml")
        assert time.process_time() - start < 1
    assert parse(b"<a>one<b>two</b> &lt;\nthree</a>", "x.xml").text == "one <\nthree"


@pytest.mark.parametrize("text", ["__import__('os').getcwd()", "1+1", "meshDoc.current().bboxDiag()**9", "9" * 5000])
def test_no_default_is_evaluated(text):
    data = SHIPPED[0].decode()
    name = next(p.name for p in descriptors.read(SHIPPED[0], "x").parameters if p.type in ("int", "float"))
    before, _, after = data.partition(f'parName="{name}"')
    head, _, tail = after.partition('parDefault="')
    changed = before + f'parName="{name}"' + head + f'parDefault="{text}"' + tail.partition('"')[2]
    with pytest.raises(mss.InvalidXml):
        descriptors.read(changed.encode(), "x.xml")


anything = st.one_of(
    st.none(),
    st.text(max_size=3),
    st.lists(st.one_of(st.none(), st.floats(), st.integers(), st.lists(st.floats(), max_size=4)), max_size=4),
    hnp.arrays(
        st.sampled_from(
            [np.float64, np.float32, np.float16, np.int8, np.uint64, np.complex128, np.bool_, "U2", object]
        ),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3),
    ),
    meshes().map(lambda mesh: mesh[0]),
    meshes().map(lambda mesh: mesh[1]),
)


@pytest.mark.no_cover
@fuzz
@given(anything, anything)
def test_the_gate_takes_anything_and_says_what_is_wrong(vertices, faces):
    with contextlib.suppress(mss.InvalidSurface):
        surface = mss.Surface(vertices, faces)
        assert np.isfinite(surface.vertices).all()
        assert 0 <= surface.faces.min() <= surface.faces.max() < len(surface.vertices)
