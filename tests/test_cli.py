import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.cli import demo, main
from meshlab_specsmooth.cli.denoise import count_self_intersections
from meshlab_specsmooth.cli.progress import bar
from meshlab_specsmooth.comparison.filter_specs import DEMO
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.meshlab.descriptors import load, names
from meshlab_specsmooth.meshlab.filters import FILTERS
from meshlab_specsmooth.runtime import atomic, backend
from tests.meshes import rough, torus


@pytest.fixture
def scan(tmp_path):
    path = tmp_path / "scan.ply"
    mesh_files.write(meshset.new(*rough(torus(20, 12))), path)
    return path


def run(*arguments):
    """As from a shell: exit code, standard output, standard error."""
    done = subprocess.run(
        [sys.executable, "-m", "meshlab_specsmooth", *map(str, arguments)], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def run_here(capfd):
    """The same without the shell, as a process takes seconds to start."""

    def run_here(*arguments):
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as ended:  # of the parser
            code = ended.code
        return code, *capfd.readouterr()

    return run_here


def test_smooth_reads_smooths_and_writes(scan, tmp_path, capsys):
    out = tmp_path / "out.obj"
    assert main(["smooth", str(scan), str(out), "--modes", "31", "--barycenter-weight", "0.5"]) == 0
    V, F = meshset.get_arrays(mesh_files.read(scan))
    expected = mss.smooth(V, F, modes=31, barycenter_weight=0.5)
    written, _ = meshset.get_arrays(mesh_files.read(out))
    assert written == pytest.approx(expected.vertices, abs=1e-6)
    printed = capsys.readouterr()
    assert "240 vertices" in printed.out
    assert f"--barycenter-weight 0.5 --response ideal --wavelength {expected.wavelength:.4g}" in printed.out
    assert f"({expected.modes:.0f} modes kept)" in printed.out
    assert printed.err == ""


def test_smooth_reports_the_noise_the_choice_and_warnings(scan, tmp_path, capsys):
    V, F = meshset.get_arrays(mesh_files.read(scan))
    expected = mss.smooth(V, F)
    assert main(["smooth", str(scan), str(tmp_path / "out.ply")]) == 0
    printed = capsys.readouterr()
    assert f"--barycenter-weight {expected.barycenter_weight:.4g}" in printed.out
    noise = expected.noise
    assert f"  {expected.summary}\n" in printed.out
    assert f"noise white {noise.level / noise.mean_edge:.3f} edges ({noise.level:.3g})" in printed.out
    assert printed.err == (f"specsmooth: {expected.warning}\n" if expected.warning else "")
    assert main(["smooth", str(scan), str(tmp_path / "out.ply"), "--wavelength", "1%"]) == 0
    assert "specsmooth: the wavelength is so short" in capsys.readouterr().err


def test_a_point_cloud_is_refused_with_a_remedy(tmp_path, capsys):
    points = tmp_path / "points.ply"
    ms = pymeshlab.MeshSet()
    ms.add_mesh(pymeshlab.Mesh(np.eye(3)))
    ms.save_current_mesh(str(points))
    assert main(["smooth", str(points), str(tmp_path / "out.ply")]) == 1
    assert "reconstruct a surface from the points first" in capsys.readouterr().err
    assert not (tmp_path / "out.ply").exists()


def test_denoise_reads_denoises_writes_and_reports(scan, tmp_path, capsys):
    out = tmp_path / "out.ply"
    assert main(["denoise", str(scan), str(out), "--boundary", "fixed"]) == 0
    V, F = meshset.get_arrays(mesh_files.read(scan))
    expected = mss.denoise(V, F, boundary="fixed")
    written, _ = meshset.get_arrays(mesh_files.read(out))
    assert written == pytest.approx(expected.vertices, abs=1e-6)
    printed = capsys.readouterr().out
    assert f"  {expected.summary}\n" in printed
    assert re.search(
        r"took .* smoothing, .*: estimated error .* edges; (isotropic|edge-aware) .*; noise white", printed
    )
    assert len(printed.splitlines()) == 3
    assert "  self-intersecting faces: 0 (0 new); flipped faces: 0" in printed


def test_only_faces_that_did_not_intersect_before_are_new():
    flat, aside = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0]]), np.array([9, 0, 0])
    upright = np.array([[0.5, 0.2, -1], [0.5, 0.4, -1], [0.5, 0.3, 1]])
    apart, across = upright + [0, 0, 5], upright
    faces = np.arange(12).reshape(-1, 3)
    before = np.concatenate([flat, across, flat + aside, apart + aside])
    after = np.concatenate([flat, across, flat + aside, across + aside])
    assert count_self_intersections(before, after, faces) == (4, 2)
    assert count_self_intersections(after, before, faces) == (2, 0)
    assert count_self_intersections(after, np.concatenate([flat, apart, flat + aside, apart + aside]), faces) == (0, 0)


@pytest.mark.parametrize("length", ["25%", "2.5"])
def test_a_wavelength_is_a_number_or_a_percentage(scan, tmp_path, capsys, length):
    assert main(["smooth", str(scan), str(tmp_path / "o.ply"), "--wavelength", length]) == 0
    ms = mesh_files.read(scan)
    wave = 2.5 if length == "2.5" else 0.25 * ms.current_mesh().bounding_box().diagonal()
    assert f"--wavelength {wave:.4g} " in capsys.readouterr().out


def test_input_and_output_may_be_the_same_file_if_one_says_so(scan, capsys):
    before = scan.read_bytes()
    assert main(["smooth", str(scan), str(scan.parent / "." / scan.name)]) == 2
    assert "is both input and output; --overwrite replaces it" in capsys.readouterr().err
    assert scan.read_bytes() == before
    assert main(["smooth", str(scan), str(scan), "--overwrite"]) == 0
    assert scan.read_bytes() != before


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["smooth", "SCAN"], 2, "required: OUT"),
        (["smooth", "SCAN", "OUT", "--wavelength", "far"], 2, "invalid length value: 'far'"),
        (["smooth", "SCAN", "OUT", "--wavelength=-5%"], 2, "wavelength: length value -"),
        (["smooth", "SCAN", "OUT", "--response", "box"], 2, "invalid choice: 'box'"),
        (
            ["smooth", "SCAN", "OUT", "--barycenter-weight", "-1"],
            2,
            "barycenter_weight: float value -1.0 out of bounds",
        ),
        (["smooth", "SCAN", "OUT", "--modes", "3", "--wavelength", "2"], 2, "give one of them"),
        (["smooth", "SCAN", "OUT", "--modes", "241"], 2, "modes is 241; it must be 1 or more; this mesh has 240"),
        (["smooth", "NOWHERE", "OUT"], 1, "no such file"),
        (["smooth", "SCAN", "FOLDER"], 1, "is a folder"),
        (["smooth", "SCAN", "OUT.xyzzy"], 1, "cannot be written"),
        (
            ["smooth", "SCAN", "OUT", "--baricenter-weight", "0.5", "--xyz=3"],
            2,
            "specsmooth smooth: error: unrecognized arguments: --baricenter-weight --xyz. Did you mean "
            "--barycenter-weight?",
        ),
        (["smooth", "SCAN", "OUT", "more"], 2, "specsmooth smooth: error: unrecognized arguments: more"),
        ([], 2, "required: COMMAND"),
        (["fly"], 2, "invalid choice: 'fly'"),
    ],
)
def test_errors_are_one_line_and_an_exit_code(scan, tmp_path, run_here, arguments, code, words):
    places = {"SCAN": scan, "OUT": tmp_path / "o.ply", "FOLDER": tmp_path, "NOWHERE": tmp_path / "no.ply"}
    places["OUT.xyzzy"] = tmp_path / "o.xyzzy"
    got, out, err = run_here(*(places.get(a, a) for a in arguments))
    assert (got, out) == (code, "")
    assert words in err.splitlines()[-1]
    assert "Traceback" not in err
    assert err.startswith("usage: specsmooth smooth") or "unrecognized" not in words
    assert [line for line in err.splitlines() if line.startswith("specsmooth")] == err.splitlines()[-1:]
    assert [file.name for file in tmp_path.iterdir()] == ["scan.ply"]


@pytest.mark.parametrize("name", ["out.xyzzy", "none/out.ply"])
def test_smooth_refuses_its_target_before_it_computes(scan, tmp_path, monkeypatch, capsys, name):
    def compute(*_, **__):
        raise AssertionError("it read or computed first")

    monkeypatch.setattr(mesh_files, "read", compute)
    monkeypatch.setitem(FILTERS, "apply_coord_spectral_smoothing", compute)
    assert main(["smooth", str(scan), str(tmp_path / name)]) == 1
    assert name in capsys.readouterr().err


def test_an_error_of_meshlab_while_it_works_is_a_failure_and_no_wrong_usage(scan, tmp_path, monkeypatch, capsys):
    def fail(*_, **__):
        raise pymeshlab.PyMeshLabException("Failed to apply filter:\nout of luck")

    monkeypatch.setitem(FILTERS, "apply_coord_spectral_smoothing", fail)
    assert main(["smooth", str(scan), str(tmp_path / "o.ply")]) == 1
    assert capsys.readouterr().err == "specsmooth: Failed to apply filter: out of luck\n"


def test_smooth_keeps_the_textures(tmp_path):
    sample = mesh_files.sample("bunny10k_textured.obj")
    assert main(["smooth", str(sample), str(tmp_path / "o.obj"), "--modes", "50"]) == 0
    texture = sample.with_name("TextureDouble_A.png")
    assert (tmp_path / texture.name).read_bytes() == texture.read_bytes()


def test_an_interrupt_is_a_failure_without_a_traceback(scan, tmp_path, monkeypatch, capsys):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(mesh_files, "read", interrupt)
    assert main(["smooth", str(scan), str(tmp_path / "o.ply")]) == 1
    assert capsys.readouterr().err == "specsmooth: interrupted\n"


# leaves little to compute
GIVEN = ("--barycenter-weight", "20")


def shell(command, *arguments):
    """Exit code and standard error of a shell command in which "$@" is the command line with these arguments."""
    line = [sys.executable, "-m", "meshlab_specsmooth", *map(str, arguments)]
    bash = ["/bin/bash", "-o", "pipefail", "-c", command, "-", *line]
    buffered = {**os.environ, "PYTHONUNBUFFERED": ""}  # unbuffered, argparse itself swallows errors of its help
    done = subprocess.run(bash, capture_output=True, text=True, check=False, env=buffered)
    return done.returncode, done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="a shell of POSIX")
@pytest.mark.parametrize(
    ("what", "command", "problem"),
    [
        ("help", '"$@" | true', ""),
        ("smooth", '"$@" >&-', "specsmooth: standard output is closed\n"),
        *(
            pytest.param(
                what,
                '"$@" >/dev/full',
                "specsmooth: standard output: No space left on device\n",
                marks=pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux"),
            )
            for what in ("smooth", "help")
        ),
        ("smooth", '"$@" 2>&- >&-', ""),
    ],
)
@pytest.mark.no_cover
def test_an_output_that_cannot_be_printed_is_a_failure_without_a_traceback(scan, tmp_path, command, problem, what):
    # true is gone before anything is printed, as Python takes longer to start
    arguments = ["smooth", scan, tmp_path / "o.ply", *GIVEN] if what == "smooth" else ["--help"]
    assert shell(command, *arguments) == (1, problem)


@pytest.mark.skipif(sys.platform == "win32", reason="a shell of POSIX")
@pytest.mark.no_cover
def test_a_closed_standard_error_is_no_failure(scan, tmp_path):
    assert shell('"$@" 2>&-', "smooth", scan, tmp_path / "o.ply", *GIVEN) == (0, "")
    assert (tmp_path / "o.ply").is_file()


def test_an_error_of_the_operating_system_is_one_line(scan, tmp_path, monkeypatch, capsys):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied", "some/file")

    monkeypatch.setattr(mesh_files, "read", refuse)
    assert main(["smooth", str(scan), str(tmp_path / "o.ply")]) == 1
    assert capsys.readouterr().err == "specsmooth: some/file: Permission denied\n"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_leaves_nothing_behind(scan, tmp_path, monkeypatch, name):
    number = getattr(signal, name)

    def end_it(*_, **__):
        assert len(list(tmp_path.glob(".specsmooth-*"))) == 1
        os.kill(os.getpid(), number)
        time.sleep(5)

    monkeypatch.setattr(mesh_files, "_save", lambda *_: None)  # by check_target
    monkeypatch.setattr(mesh_files, "copy_textures", end_it)
    with pytest.raises(SystemExit) as ended:
        main(["smooth", str(scan), str(tmp_path / "o.ply")])
    assert ended.value.code == 128 + number
    assert [file.name for file in tmp_path.iterdir()] == ["scan.ply"]
    assert signal.getsignal(number) is signal.SIG_DFL


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_signals_that_are_taken_or_ignored_stay_so_and_threads_have_none(scan, tmp_path, monkeypatch):
    seen = []

    def look(target):
        seen.append(signal.getsignal(signal.SIGHUP))
        return atomic.check_place(target)

    monkeypatch.setattr(mesh_files, "check_target", look)
    arguments = ["smooth", str(scan), str(tmp_path)]  # a folder: the end comes early
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert main(arguments) == 1
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
    thread = threading.Thread(target=main, args=(arguments,))
    thread.start()
    thread.join()
    assert seen == [signal.SIG_IGN, signal.SIG_DFL]


# Each line has a command's arguments and the file for its standard error. It is run in a copy of a process in which
# all is imported: what comes before main and after it is Python's, and nothing has been done or all.
COPIES = """
import json, os, sys
from meshlab_specsmooth.cli import main
for line in sys.stdin:
    arguments, problem = json.loads(line)
    copy = os.fork()
    if copy == 0:
        os.dup2(os.open(problem, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        print(os.getpid(), flush=True)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os._exit(main(arguments))
    print(os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]), flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.no_cover
def test_an_interrupt_at_any_moment_leaves_the_old_output_or_the_whole_new_one(tmp_path, monkeypatch):
    places = {name: tmp_path / name for name in ("scan.ply", "expected.ply", "folder", "temporary", "problem")}
    folder, temporary = places["folder"], places["temporary"]
    folder.mkdir()
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    mesh_files.write(meshset.new(*rough(torus(80, 60))), places["scan.ply"])
    waits = np.random.default_rng(3)
    usual, codes = 0.0, []
    with subprocess.Popen(
        [sys.executable, "-c", COPIES], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        for trial in range(13):
            out = places["expected.ply"] if trial == 0 else folder / "out.ply"
            before = b"what was there" if trial % 2 else None
            out.unlink(missing_ok=True)
            if before is not None:
                out.write_bytes(before)
            line = json.dumps([["smooth", str(places["scan.ply"]), str(out)], str(places["problem"])])
            print(line, file=process.stdin, flush=True)
            copy = int(process.stdout.readline())
            start = time.perf_counter()
            if trial > 0:
                time.sleep(waits.uniform(0, 0.9 * usual))
                with contextlib.suppress(ProcessLookupError):  # it has ended already
                    os.kill(copy, signal.SIGINT)
            code, took = int(process.stdout.readline()), time.perf_counter() - start
            problem = places["problem"].read_text()
            if code == 0:
                usual = min(usual, took) if trial > 0 else took
                assert out.read_bytes() == places["expected.ply"].read_bytes()
                # Python drops an exception in a destructor or a callback of C, as numba has them; the work goes on then
                assert problem == "" or problem.startswith("Exception ignored ")
            else:
                # destructors of numba may complain of what they were interrupted in, before the message and after it
                problem = problem[problem.find("specsmooth:") :].partition("Exception ignored ")[0]
                assert (code, problem) == (1, "specsmooth: interrupted\n")
                found = out.read_bytes() if out.exists() else None
                assert found in (before, places["expected.ply"].read_bytes())
            codes.append(code)
            assert {file.name for file in folder.iterdir()} <= {"out.ply"}
            assert list(temporary.iterdir()) == []
        process.stdin.close()
    assert process.returncode == 0
    assert codes[0] == 0
    assert codes.count(1) > 2


def test_the_process_of_a_command_has_its_exit_code_and_streams(scan, tmp_path):
    assert run("--version") == (0, f"specsmooth {mss.__version__}\n", "")
    nowhere = tmp_path / "no.ply"
    assert run("smooth", nowhere, tmp_path / "o.ply") == (1, "", f"specsmooth: {nowhere}: no such file\n")
    assert run("smooth", scan, tmp_path / "o.ply", "--modes", "241")[0] == 2


def test_that_something_is_slow_is_a_line_and_other_warnings_are_pythons(scan, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setattr(backend, "LARGE", 100)
    monkeypatch.setattr(backend, "_has_warned", threading.Event())
    assert main(["smooth", str(scan), str(tmp_path / "o.ply"), "--modes", "31"]) == 0
    line = (
        "numba is not installed (pip install numba threadpoolctl); without numba this takes two to five times as long"
    )
    assert capsys.readouterr().err == f"specsmooth: {line}\n"
    monkeypatch.setattr(mesh_files, "read", lambda *_, **__: warnings.warn("other", stacklevel=1))
    with pytest.raises(UserWarning, match="other"):
        main(["smooth", str(scan), str(tmp_path / "o.ply")])


# importing the command line is interrupted, or finds no memory
IMPORTING = """
import signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "meshlab_specsmooth.cli":
            from meshlab_specsmooth.errors import FileError
            {how}
sys.meta_path.insert(0, Finder())
import specsmooth
sys.exit(specsmooth.main())
"""


@pytest.mark.parametrize(
    ("how", "problem"),
    [
        ("signal.raise_signal(signal.SIGINT)", "interrupted"),
        ("raise MemoryError", "memory ran out"),
        ("raise FileError('filters_xml: missing')", "filters_xml: missing"),
        ("raise ImportError('cannot map a file')", "cannot be imported: cannot map a file"),
    ],
)
def test_what_goes_wrong_while_the_command_is_imported_is_one_line(how, problem):
    command = [sys.executable, "-c", IMPORTING.format(how=how)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"specsmooth: {problem}\n")


@pytest.mark.parametrize(
    ("error", "problem"),
    [(MemoryError(), "memory ran out"), (OSError("of another kind"), "standard output: of another kind")],
)
def test_an_error_without_message_is_one_line(scan, tmp_path, monkeypatch, capsys, error, problem):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(mesh_files, "read", fail)
    assert main(["smooth", str(scan), str(tmp_path / "o.ply")]) == 1
    assert capsys.readouterr().err == f"specsmooth: {problem}\n"


@pytest.mark.skipif(sys.platform != "linux", reason="names of POSIX")
def test_names_that_cannot_be_printed_are_spelled_out(scan, tmp_path):
    (tmp_path / "bad folder \udcff").mkdir()
    script = tmp_path / "bad folder \udcff" / "s.mlx"
    script.write_text("nothing")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    command = [sys.executable, "-m", "meshlab_specsmooth"]
    for arguments, code in ((["smooth", scan, tmp_path / "ü.ply"], 0), (["run", script, scan, tmp_path / "o.ply"], 1)):
        done = subprocess.run([*command, *map(str, arguments)], capture_output=True, check=False, env=environment)
        assert done.returncode == code
        assert b"Traceback" not in done.stderr
        assert (b"\\xfc.ply: 240 vertices" in done.stdout) if code == 0 else (b"bad folder \\udcff" in done.stderr)


@pytest.mark.no_cover
def test_modules_in_the_working_directory_are_not_imported(tmp_path):
    for name in ("argparse", "json", "numpy", "pymeshlab", "scipy"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('imported from the working directory')")
    command = [sys.executable, "-m", "meshlab_specsmooth", "filters"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_command_has_help(run_here):
    for command in ("smooth", "run", "filters", "demo"):
        code, out, _ = run_here(command, "--help")
        assert code == 0
        assert "examples:" in out
    _, out, _ = run_here("smooth", "--help")
    for parameter in load("apply_coord_spectral_smoothing").parameters:
        assert "--" + parameter.name.replace("_", "-") in out
        assert f"(default: {parameter.shown_default})" in " ".join(out.split())


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_gets_a_bar_and_a_pipe_gets_none(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with bar("smoothing") as progress:
        progress(0.25)
        time.sleep(0.15)  # the bar is drawn ten times a second
        progress(1.0)
    assert "smoothing" in terminal.getvalue()
    assert "100%" in terminal.getvalue()
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with bar("smoothing") as progress:
        assert progress is None


def test_without_the_extra_a_terminal_gets_a_notice(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setitem(sys.modules, "tqdm", None)
    with bar("smoothing") as progress:
        assert progress is None
    assert terminal.getvalue().count("\n") == 1
    assert "meshlab-specsmooth[progress]" in terminal.getvalue()


def test_the_demo_shows_that_ours_is_ahead_and_keeps_the_volume(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    assert main(["demo", "--out", str(tmp_path / "new" / "folder")]) == 0
    out = tmp_path / "new" / "folder"
    assert {file.name for file in out.iterdir()} == {"bunny.png", "table.txt"}
    table = (out / "table.txt").read_text()
    assert table.strip() in capsys.readouterr().out
    rows = {line[:32].strip(): line[32:].split() for line in table.splitlines() if len(line[32:].split()) == 4}
    normals = {name: float(values[0]) for name, values in rows.items() if name}
    ours = normals.pop(DEMO[-1].name)
    assert len(normals) == len(DEMO)  # the others, and the noisy surface
    assert ours < min(normals.values())
    assert abs(float(rows[DEMO[-1].name][2])) < 0.5
    for spec in DEMO:
        assert f"ms.{spec.call}" in table


def test_the_demo_says_which_folder_cannot_be_made(tmp_path, run_here):
    (tmp_path / "file").write_text("")
    code, out, err = run_here("demo", "--out", tmp_path / "file" / "sub")
    assert (code, out) == (1, "")
    assert err == f"specsmooth: {tmp_path / 'file' / 'sub'}: cannot be created: Not a directory\n"


@pytest.mark.parametrize(
    ("option", "value", "problem"),
    [
        ("--noise", "nan", "nan is not a finite number from 0"),
        ("--noise", "inf", "inf is not a finite number from 0"),
        ("--noise", "-0.2", "-0.2 is not a finite number from 0"),
        ("--noise", "much", "invalid noise value: 'much'"),
        ("--seed", "-1", "-1 is less than 0"),
        ("--seed", "1.5", "invalid seed value: '1.5'"),
    ],
)
def test_the_demo_refuses_invalid_noise_and_seeds(tmp_path, capsys, option, value, problem):
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--out", str(tmp_path / "out"), option, value])
    assert ended.value.code == 2
    assert capsys.readouterr().err.splitlines()[-1] == f"specsmooth demo: error: argument {option}: {problem}"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["bunny.png", "table.txt"])
def test_the_demo_refuses_a_folder_in_the_place_of_its_files_before_it_computes(tmp_path, monkeypatch, capsys, name):
    monkeypatch.setattr(demo, "run_side_by_side", None)  # not callable
    (tmp_path / name).mkdir()
    assert main(["demo", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr().err == f"specsmooth: {tmp_path / name}: is a folder\n"
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_the_console_script_is_installed(scan):
    script = Path(sys.executable).with_name("specsmooth")
    done = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"specsmooth {mss.__version__}\n"
    assert np.isfinite(meshset.get_arrays(mesh_files.read(scan))[0]).all()


def test_filters_are_listed_and_described(capsys):
    assert main(["filters"]) == 0
    listed = capsys.readouterr().out
    for name in names():
        assert f"{name} " in listed
        assert main(["filters", name]) == 0
        described = capsys.readouterr().out
        for parameter in load(name).parameters:
            assert f"{parameter.name} : {parameter.kind} = {parameter.shown_default}" in described
    with pytest.raises(SystemExit) as stopped:
        main(["filters", "apply_coord_magic"])
    assert stopped.value.code == 2
    assert "invalid choice: 'apply_coord_magic'" in capsys.readouterr().err


def test_run_applies_a_script_to_a_file(scan, tmp_path, capsys):
    ms = mss.MeshSet()
    ms.load_new_mesh(str(scan))
    ms.apply_coord_taubin_smoothing()
    ms.apply_coord_spectral_smoothing(modes=30)
    ms.save_filter_script(str(tmp_path / "s.mlx"))
    assert main(["run", str(tmp_path / "s.mlx"), str(scan), str(tmp_path / "o.ply")]) == 0
    written, _ = meshset.get_arrays(mesh_files.read(tmp_path / "o.ply"))
    assert written == pytest.approx(ms.current_mesh().vertex_matrix(), abs=1e-6)
    assert capsys.readouterr().out == f"{tmp_path / 'o.ply'}: Taubin Smooth, Spectral Smooth\n"


def test_an_empty_script_says_that_it_did_nothing(scan, tmp_path, capsys):
    (tmp_path / "s.mlx").write_text("<FilterScript/>")
    assert main(["run", str(tmp_path / "s.mlx"), str(scan), str(tmp_path / "o.ply")]) == 0
    assert "the script has no filters" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "s.mlx: cannot be read: No such file"),
        ("<FilterScript>", "s.mlx:1: is not well-formed"),
        (
            '<FilterScript>\n<filter name="Spectral Smoth"/></FilterScript>',
            "s.mlx:2: no filter is called 'Spectral Smoth'",
        ),
    ],
)
def test_a_bad_script_is_one_line_and_writes_nothing(scan, tmp_path, run_here, text, words):
    if text is not None:
        (tmp_path / "s.mlx").write_text(text)
    code, out, err = run_here("run", tmp_path / "s.mlx", scan, tmp_path / "o.ply")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert words in err
    assert not (tmp_path / "o.ply").exists()
