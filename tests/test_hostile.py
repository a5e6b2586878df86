"""Files from strangers: one line and an exit code, the target untouched, and never a hang, a crash or all memory."""

import json
import os
import resource
import shutil
import struct
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.batching import work
from meshlab_specsmooth.batching.work import Job
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.meshlab import headers, mesh_files, meshset
from meshlab_specsmooth.operators import reconstruction
from tests.meshes import rough, torus

CORNERS = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
FACE = struct.pack("<B3i", 3, 0, 1, 2)
GARBAGE = np.random.default_rng(1).bytes(5000)


def ply(vertices=3, faces=1, body=CORNERS + FACE, kind="binary_little_endian", more=""):
    names = "".join(f"property float {x}\n" for x in "xyz")
    lists = "property list uchar int vertex_indices\n"
    return (
        f"ply\nformat {kind} 1.0\n{more}element vertex {vertices}\n{names}element face {faces}\n{lists}end_header\n"
    ).encode() + body


def stl(count, *facets):
    return bytes(80) + struct.pack("<I", count) + b"".join(struct.pack("<12f", 0, 0, 1, *f) + b"\0\0" for f in facets)


def obj(faces, corners="v 0 0 0\nv 1 0 0\nv 0 1 0\n"):
    return (corners + faces).encode()


XML_BOMB = b"".join(
    [
        b'<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "aaaaaaaaaa">',
        *(f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">'.encode() for i in range(9)),
        b"]><COLLADA>&j;</COLLADA>",
    ]
)

NAN = float("nan")
REFUSED = {
    "truncated.ply": ply()[:-5],
    "header alone.ply": b"ply\nformat ascii 1.0\nelement vertex 3\n",
    "header without an end.ply": ply()[:60] + b"comment x\n" * 200_000,
    "too many vertices.ply": ply(vertices=4_000_000_000),
    "many vertices.ply": ply(vertices=20_000_000),
    "many vertices of text.ply": ply(vertices=20_000_000, kind="ascii"),
    "too many faces.ply": ply(faces=4_000_000_000),
    "fewer than no vertices.ply": ply(vertices=-3),
    "more than any vertices.ply": ply(vertices="9" * 40),
    "not a number of vertices.ply": ply(vertices="three"),
    "an element without name.ply": ply(more="element\n"),
    "a property without type.ply": ply(vertices=4_000_000, more="property\n"),
    "a long name.ply": ply(more=f"element {'v' * 100_000} 0\n"),
    "index too large.ply": ply(body=CORNERS + struct.pack("<B3i", 3, 0, 1, 200_000_000)),
    "index negative.ply": ply(body=CORNERS + struct.pack("<B3i", 3, 0, 1, -7)),
    "not finite.ply": ply(body=struct.pack("<9f", NAN, 0, 0, 1, 0, 0, 0, np.inf, 0) + FACE),
    "another format.ply": obj("f 1 2 3\n"),
    "missing index.obj": obj("f 1 2 9\n"),
    "index zero.obj": obj("f 0 1 2\n"),
    "negative index.obj": obj("f -1 -2 -9\n"),
    "words.obj": b"v a b c\nv 1\nf x y z\n",
    "no vertices.obj": b"f\n",
    "one vertex.obj": b"v 0 0 0\nf 1 1 1\n",
    "no faces.obj": obj(""),
    "not finite.obj": obj("f 1 2 3\n", "v nan 0 0\nv 1 0 0\nv 0 1 0\n"),
    "beyond double.obj": obj("f 1 2 3\n", "v 1e400 0 0\nv 1 0 0\nv 0 1 0\n"),
    "another format.obj": ply(),
    "not finite.stl": stl(1, (NAN, 0, 0, 1, 0, 0, 0, 1, 0)),
    "truncated.stl": stl(1000, (0, 0, 0, 1, 0, 0, 0, 1, 0)),
    "endless.stl": stl(4_000_000_000, (0, 0, 0, 1, 0, 0, 0, 1, 0)),
    "zeros.stl": bytes(500),
    "text.stl": b"hello\n" * 100,
    "broken off.stl": b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n",
    "one line.stl": b"solid x facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 endsolid",
    "solid and zeros.stl": b"solid x\n" + bytes(5000),
    "another format.stl": ply(),
    "missing index.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n",
    "negative index.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -9\n",
    "one number.off": b"OFF\n3\n",
    "a number alone.off": b"3",
    "no numbers.off": b"OFF\n",
    "truncated.off": b"OFF\n3 1 0\n0 0 0\n1 0",
    "too many vertices.off": b"OFF # all\n4000000000 1 0\n0 0 0\n",
    "too many faces.off": b"OFF\n3 2000000000 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "too many corners.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2000000000 0 1 2\n",
    "entities.dae": XML_BOMB,
    "outside.dae": b'<!DOCTYPE l [<!ENTITY a SYSTEM "file:///etc/passwd">]><COLLADA>&a;</COLLADA>',
    **{f"empty.{ending}": b"" for ending in ("ply", "obj", "stl", "off", "gltf", "dae", "3ds", "wrl", "x3d", "ctm")},
    **{f"garbage.{ending}": GARBAGE for ending in ("ply", "obj", "stl", "off", "glb", "dae", "3ds", "wrl", "x3d")},
    "garbage.xyzzy": GARBAGE,
}


def in_a_copy(folder, *arguments):
    """Exit code, output and errors of a command in a copy of this process, with 512 MiB to live on.

    pymeshlab's readers may write where they should not: the process that reads garbage is not to be used any more.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads that a copy has not; it needs none of them
        copy = os.fork()
    printed = [folder / "standard output", folder / "standard error"]
    if copy == 0:
        for number, path in enumerate(printed, start=1):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), number)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", encoding="utf-8") for number in (1, 2))
        data = int(Path("/proc/self/statm").read_text().split()[5]) * os.sysconf("SC_PAGE_SIZE")
        resource.setrlimit(resource.RLIMIT_DATA, (data + 2**29, resource.RLIM_INFINITY))
        code = -1
        try:
            code = main([str(argument) for argument in arguments])
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)  # whatever is raised, it is not to go on with the tests
    code = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
    return code, *(path.read_text(encoding="utf-8") for path in printed)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as Linux does it")
@pytest.mark.no_cover
@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_is_no_mesh_is_one_line_and_leaves_the_target(tmp_path, name):
    folder = tmp_path / "folder"
    folder.mkdir()
    source, target = folder / name, folder / "target.ply"
    source.write_bytes(REFUSED[name])
    target.write_bytes(b"as it was")
    code, out, err = in_a_copy(tmp_path, "smooth", source, target)
    assert code == 1
    assert out.strip() == ""
    assert err.startswith("specsmooth: ")
    assert err.count("\n") == 1
    assert target.read_bytes() == b"as it was"
    assert source.read_bytes() == REFUSED[name]
    assert sorted(file.name for file in folder.iterdir()) == sorted([name, "target.ply"])


ACCEPTED = {
    "fine.ply": ply(),
    "windows.ply": ply(kind="ascii", body=b"0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2").replace(b"\n", b"\r\n"),
    "backward.obj": obj("f -1 -2 -3\n"),
    "huge and tiny.obj": obj("f 1 2 3\nf 1 2 4\n", "v 1e300 0 0\nv 1e-300 0 0\nv 0 1e300 0\nv 0 0 1e300\n"),
    "fine.stl": stl(1, (0, 0, 0, 1, 0, 0, 0, 1, 0)),
    "text.stl": b"solid caf\xc3\xa9\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    b"endloop\nendfacet\nendsolid\n",
    "fine.off": b"OFF\n# a triangle\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2",
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_an_unusual_but_valid_file_is_smoothed(tmp_path, name):
    (tmp_path / name).write_bytes(ACCEPTED[name])
    assert main(["smooth", str(tmp_path / name), str(tmp_path / "out.obj")]) == 0
    assert np.isfinite(meshset.get_arrays(mesh_files.read(tmp_path / "out.obj"))[0]).all()


POLYGONS = {
    "a triangle upon a quadrilateral": [[0, 1, 2, 3], [0, 2, 3]],
    "a crossed quadrilateral upon another": [[0, 1, 2, 3], [0, 2, 1, 3]],
    "repeated corners": [[0, 1, 2, 3], [0, 1, 1, 2, 3]],
    "twice around": [[0, 1, 2, 3, 0, 1, 2, 3]],
}


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as Linux does it")
@pytest.mark.parametrize("ending", ["obj", "off"])
@pytest.mark.parametrize("name", POLYGONS)
def test_polygons_that_pymeshlab_writes_without_end_are_an_error_with_a_remedy(tmp_path, capfd, name, ending):
    source, target = tmp_path / "polygons.ply", tmp_path / f"out.{ending}"
    rows = [" ".join(map(str, [len(corners), *corners])) for corners in POLYGONS[name]]
    body = "\n".join(["0 0 0", "1 0 0", "1 1 0", "0 1 0", *rows, ""]).encode()
    source.write_bytes(ply(4, len(rows), body, "ascii"))
    target.write_bytes(b"as it was")
    assert main(["smooth", str(source), str(target)]) == 1
    *_, problem = capfd.readouterr().err.splitlines()  # after the notice that so small a mesh is left as it is
    assert problem.startswith(f"specsmooth: {target}: cannot be written: memory ran out")
    assert target.read_bytes() == b"as it was"
    assert main(["smooth", str(source), str(tmp_path / "out.ply")]) == 0
    ms = mesh_files.read(source)
    ms.meshing_poly_to_tri()  # as the error says
    mesh_files.write(ms, target)
    assert mesh_files.read(target).current_mesh().face_number() == len(meshset.get_arrays(ms)[1])


@pytest.mark.parametrize("ending", ["ply", "stl", "off"])
def test_files_written_by_pymeshlab_pass_the_header_checks(tmp_path, ending):
    path = tmp_path / f"mesh.{ending}"
    mesh_files.write(meshset.new(*torus(8, 6)), path)
    headers.check(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 10])
    with pytest.raises(mss.FileError):
        mesh_files.read(path)


@pytest.mark.no_cover
@pytest.mark.parametrize("cut", range(0, 100, 9))
@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "off"])
def test_a_file_cut_anywhere_is_an_error_or_a_mesh(tmp_path, ending, cut):
    path = tmp_path / f"mesh.{ending}"
    mesh_files.write(meshset.new(*torus(8, 6)), path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * cut // 100])
    assert main(["smooth", str(path), str(tmp_path / "out.ply")]) in (0, 1)


@pytest.mark.skipif(sys.platform == "win32", reason="names of POSIX")
@pytest.mark.parametrize("name", ["a b.ply", "it's.ply", 'a "b".ply', "a\nb.ply", "ünï.ply", "-o.ply", "100%.ply"])
def test_strange_names_are_names(tmp_path, name):
    source, target = tmp_path / name, tmp_path / f"out {name}"
    mesh_files.write(meshset.new(*torus(8, 6)), source)
    assert main(["smooth", str(source), str(target)]) == 0
    assert mesh_files.read(target).current_mesh().vertex_number() == 48
    source.unlink()
    assert main(["smooth", str(source), str(target)]) == 1


# the command line with a limit on the size of files, at which writing is refused as on a full disk
FULL_DISK = """
import contextlib, io, json, resource, signal, sys
from meshlab_specsmooth.cli import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
for source, target, most in json.loads(sys.argv[1]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    with contextlib.redirect_stderr(io.StringIO()) as problem:
        code = main(["smooth", source, target, "--barycenter-weight", "0.5"])
    print(json.dumps([code, problem.getvalue()]))
"""


@pytest.mark.no_cover
@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_full_disk_leaves_the_old_file(tmp_path, untraced):
    source = tmp_path / "in.ply"
    mesh_files.write(meshset.new(*torus(30, 20)), source)
    cases = []
    for ending in ("ply", "obj", "stl", "off", "dae", "wrl"):
        target = tmp_path / f"out.{ending}"
        assert main(["smooth", str(source), str(target), "--barycenter-weight", "0.5"]) == 0
        cases += [(str(source), str(target), int(target.stat().st_size * share)) for share in (0.5, 0.999)]
        target.write_bytes(b"as it was")
    before = sorted(tmp_path.iterdir())
    command = [sys.executable, "-c", FULL_DISK, json.dumps(cases)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    printed = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(printed) == len(cases)
    for (_, target, _), (code, problem) in zip(cases, printed, strict=True):
        assert code == 1
        assert problem.startswith(f"specsmooth: {target}: cannot be written: ")
        assert problem.count("\n") == 1
        assert Path(target).read_bytes() == b"as it was"
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.skipif(sys.platform != "linux", reason="places of Linux")
@pytest.mark.parametrize("place", ["/proc", "/sys"])
def test_a_place_where_nobody_may_write_is_one_line(tmp_path, capfd, place):
    """Read-only for root as well, who may write into folders that say otherwise."""
    source = tmp_path / "in.ply"
    mesh_files.write(meshset.new(*torus(8, 6)), source)
    assert main(["smooth", str(source), f"{place}/out.ply", "--barycenter-weight", "1000"]) == 1
    printed = capfd.readouterr()
    assert printed.err.startswith(f"specsmooth: {place}/out.ply: ")
    assert printed.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [source]


def test_a_solve_that_does_not_converge_is_one_line_and_leaves_the_target(tmp_path, capfd, monkeypatch):
    source, target = tmp_path / "in.ply", tmp_path / "out.ply"
    mesh_files.write(meshset.new(*rough(torus(40, 24))), source)
    target.write_bytes(b"as it was")
    monkeypatch.setattr(reconstruction, "MAX_ITERATIONS", 1)
    assert main(["smooth", str(source), str(target), "--barycenter-weight", "0.01"]) == 1
    printed = capfd.readouterr()
    assert printed.err.startswith("specsmooth: the least-squares solve stands at a relative error of ")
    assert printed.err.count("\n") == 1
    assert target.read_bytes() == b"as it was"
    job = Job(str(source), str(target), "apply_coord_spectral_smoothing", {"barycenter_weight": 0.01})
    outcome = work.run(job)
    assert outcome.status == "failed"
    assert outcome.reason.startswith("the least-squares solve stands at")
    assert target.read_bytes() == b"as it was"


def test_a_batch_of_invalid_files_reports_a_line_for_each(tmp_path):
    inputs = tmp_path / "in"
    inputs.mkdir()
    for name, data in REFUSED.items():
        (inputs / name).write_bytes(data)
    mesh_files.write(meshset.new(*torus(8, 6)), inputs / "fine.ply")
    shutil.copy(inputs / "fine.ply", inputs / "fine too.ply")
    summary = mss.batch([inputs, inputs / "garbage.xyzzy"], tmp_path / "out", pictures=False, workers=1)
    # pymeshlab's readers may write where they should not: of that a process dies, or does not
    assert set(summary.counts) <= {"done", "failed", "crashed"}
    assert summary.counts["done"] == len(summary.outcomes) - len(REFUSED) == 2
    assert all(outcome.reason for outcome in summary.outcomes if not outcome.is_there)
    assert {path.name for path in (tmp_path / "out").glob("*.*") if "specsmooth" not in path.name} == {
        "fine.ply",
        "fine too.ply",
        "summary.json",
        "summary.csv",
    }
