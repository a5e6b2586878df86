"""Readers and public functions on anything at all; seeded, so that every run tries the same."""

import contextlib
import importlib.util
import math
import time
from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

import meshlab_specsmooth as mss
from meshlab_specsmooth.meshlab import descriptors, scripts
from meshlab_specsmooth.meshlab.xmltree import MAX_FILE_SIZE, parse

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
SHIPPED = [descriptors.folder().joinpath(f"{n}.xml").read_bytes() for n in descriptors.names()]
SCRIPT = (
    "<!DOCTYPE FilterScript>\n<FilterScript>\n"
    + scripts.format_step(
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
        b"<a>" + b" " * MAX_FILE_SIZE + b"</a>",
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


def fuzz_script():
    """The module that ``scripts/fuzz.py`` is; it makes no environment where it is imported."""
    path = Path(__file__).parent.parent / "scripts" / "fuzz.py"
    spec = importlib.util.spec_from_file_location("fuzz_script", path)
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(path.parent))
        spec.loader.exec_module(module)
    return module


def test_any_call_ends_finite_or_with_a_typed_error():
    script = fuzz_script()
    wrong, seen = [], set()
    for number in range(250):
        call = script.make(11, number)
        outcome = script.outcome_of(call)
        seen.add(outcome)
        if script.is_failure(outcome):
            wrong.append((number, outcome, call.text))
    assert not wrong
    assert {"finite", "InvalidSurface", "InvalidParameter", "FilterFailed", "WrongType"} <= seen


def test_a_process_that_dies_or_never_ends_is_a_failure_and_costs_no_other_call(monkeypatch, tmp_path):
    script = fuzz_script()
    worker = tmp_path / "worker.py"
    worker.write_text(
        "import os, time\n"
        "from meshlab_specsmooth.isolation.worker import serve\n"
        "serve(lambda i: os.abort() if i == 1 else time.sleep(60) if i == 3 else 'finite')\n"
    )
    monkeypatch.setattr(script, "__file__", str(worker))
    monkeypatch.setattr(script, "TIMEOUT", 2.0)
    found = dict(script.outcomes(0, 5, math.inf))
    assert [number for number, outcome in found.items() if outcome == "finite"] == [0, 2, 4]
    assert found[1] == "FAILURE: the process crashed (SIGABRT)"
    assert found[3] == "FAILURE: the process took more than 2 s"
