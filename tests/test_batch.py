"""Many meshes: what is finished stays finished, whatever dies; here and on a cluster."""

import contextlib
import csv
import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pymeshlab
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.batching import cluster, local, record, work
from meshlab_specsmooth.batching.inputs import sources
from meshlab_specsmooth.batching.record import RECORD_ENDING
from meshlab_specsmooth.batching.work import Job
from meshlab_specsmooth.cli import batch as command_line
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.geometry.surface import signed_volume
from meshlab_specsmooth.meshlab import mesh_files, meshset
from meshlab_specsmooth.pieces import whole
from meshlab_specsmooth.pieces.piece import run_piece
from meshlab_specsmooth.reports import contact_sheet
from meshlab_specsmooth.runtime import backend, temporary
from tests.meshes import noisy, rough, sheet, torus

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def scans(folder, count=3, size=(20, 12)):
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        mesh_files.write(meshset.new(*rough(torus(*size), seed=number)), folder / f"scan{number}.ply")
    return folder


def batch(inputs, out, **given):
    return mss.batch(inputs, out, **{"pictures": False, "workers": 1, **given})


def statuses(summary):
    return {Path(outcome.input).stem: outcome.status for outcome in summary.outcomes}


def outputs(out):
    """Digests of the meshes in a folder."""
    return {str(p.relative_to(out)): record.compute_digest(str(p)) for p in sorted(out.rglob("*.ply"))}


@pytest.fixture
def in_this_process(monkeypatch):
    """Processes take seconds to start; where they make no difference there are none."""
    monkeypatch.setattr(local, "outcomes", lambda jobs, workers, time_limit: (work.run(job) for job, _ in jobs))


# a worker whose process ends, in one way or another, on meshes that are called so
DYING = """
import atexit, os, time
from meshlab_specsmooth.batching import work, worker
def fake(job):
    if "killed" in job.source:
        os.kill(os.getpid(), 9)
    if "exits" in job.source:
        os._exit(3)
    if "damaged" in job.source:
        atexit.register(os.abort)
    if "endless" in job.source:
        time.sleep(1000)
    if "garbles" in job.source:
        os.write(answers, b'{"half')
        os.kill(os.getppid(), 9)
    return work.run(job)
answers = os.dup(1)
worker.serve(fake)
"""


def test_each_mesh_becomes_what_smooth_makes_of_it(tmp_path):
    inputs = scans(tmp_path / "in", 2)
    (inputs / "sub").mkdir()
    mesh_files.write(meshset.new(*rough(sheet())), inputs / "sub" / "open.ply")
    seen, fractions = [], []
    summary = batch(inputs, tmp_path / "out", barycenter_weight=0.5, each=seen.append, progress=fractions.append)
    assert summary.is_complete
    assert summary.counts == {"done": 3}
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert {outcome.input for outcome in seen} == {outcome.input for outcome in summary.outcomes}
    for outcome in summary.outcomes:
        assert main(["smooth", outcome.input, str(tmp_path / "one.ply"), "--barycenter-weight", "0.5"]) == 0
        assert (tmp_path / "one.ply").read_bytes() == Path(outcome.output).read_bytes()
        assert Path(outcome.output).relative_to(tmp_path / "out") == Path(outcome.input).relative_to(inputs)
    by_name = {Path(outcome.input).stem: outcome for outcome in summary.outcomes}
    assert by_name["open"].volume_change is None
    assert by_name["scan0"].vertices == 240
    ends = (by_name["scan0"].input, by_name["scan0"].output)
    before, after = (signed_volume(mss.Surface(*meshset.get_arrays(mesh_files.read(path)))) for path in ends)
    assert by_name["scan0"].volume_change == pytest.approx(after / before - 1, abs=1e-6)
    assert by_name["scan0"].seconds > 0


def test_what_numba_would_bring_is_said_by_the_process_that_has_a_standard_error(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "outcomes", lambda *_: (outcome for outcome in ()))
    monkeypatch.setattr(backend, "_has_warned", threading.Event())
    monkeypatch.setattr(backend, "LARGE", 100)
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.warns(mss.Slow, match="numba is not installed"):
        batch(scans(tmp_path / "in", 1), tmp_path / "out", pictures=False)


def test_the_summary_is_a_file_for_programs_and_one_for_tables(tmp_path, in_this_process):
    summary = batch(scans(tmp_path / "in", 2), tmp_path / "out")
    document = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert document["counts"] == {"done": 2}
    assert [mss.Outcome(**mesh) for mesh in document["meshes"]] == list(summary.outcomes)
    with (tmp_path / "out" / "summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["input"] for row in rows] == [outcome.input for outcome in summary.outcomes]
    assert [float(row["cutoff"]) for row in rows] == [outcome.cutoff for outcome in summary.outcomes]


def test_a_damaged_mesh_is_a_line_and_an_exit_code(tmp_path, capsys):
    inputs = scans(tmp_path / "in", 2)
    (inputs / "damaged.ply").write_bytes((inputs / "scan0.ply").read_bytes()[:1000])
    (inputs / "empty.obj").touch()
    arguments = ["batch", str(inputs), str(inputs / "none.ply"), "--out", str(tmp_path / "out"), "--no-pictures"]
    assert main([*arguments, "--workers", "1"]) == 1
    printed = capsys.readouterr()
    assert printed.err == f"specsmooth: 3 of 5 meshes failed; see {tmp_path}/out/summary.csv\n"
    failed = [line for line in printed.out.splitlines() if line.startswith("failed")]
    assert sorted(Path(line.split(": ")[0]).name for line in failed) == ["damaged.ply", "empty.obj", "none.ply"]
    assert "none.ply: no such file" in printed.out
    assert "2 done, 3 failed" in printed.out
    assert set(outputs(tmp_path / "out")) == {"scan0.ply", "scan1.ply"}


@posix
@pytest.mark.no_cover
def test_a_mesh_that_takes_its_process_down_costs_no_other(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "command", lambda *_: (sys.executable, "-c", DYING))
    inputs = scans(tmp_path / "in", 3)
    for name in ("killed", "exits", "garbles", "damaged"):
        shutil.copy(inputs / "scan0.ply", inputs / f"{name}.ply")
    summary = batch(inputs, tmp_path / "out")
    expected = {"scan0": "done", "scan1": "done", "scan2": "done"}
    assert statuses(summary) == expected | {
        "killed": "crashed",
        "exits": "crashed",
        "garbles": "crashed",
        "damaged": "crashed",
    }
    assert set(outputs(tmp_path / "out")) == {f"{name}.ply" for name in expected}
    assert {path.name.split(".")[0] for path in records(tmp_path / "out")} == set(expected)
    assert not list((tmp_path / "out").glob(f"{temporary.PREFIX}*"))
    reasons = {Path(outcome.input).stem: outcome.reason for outcome in summary.outcomes}
    assert "crashed (SIGKILL)" in reasons["killed"]
    assert "exit code 3" in reasons["exits"]
    assert not summary.is_complete
    shutil.copy(inputs / "scan0.ply", tmp_path / "endless.ply")
    (outcome,) = batch(tmp_path / "endless.ply", tmp_path / "out", time_limit=1.0).outcomes
    assert (outcome.status, outcome.reason) == ("crashed", "the process that read or smoothed it took more than 1 s")


def test_what_is_done_is_skipped_and_what_changed_is_done_again(tmp_path, in_this_process):
    inputs, out = scans(tmp_path / "in", 3), tmp_path / "out"
    first = batch(inputs, out)
    times = {name: (out / name).stat().st_mtime_ns for name in outputs(out)}
    again = batch(inputs, out)
    assert again.counts == {"skipped": 3}
    assert {name: (out / name).stat().st_mtime_ns for name in outputs(out)} == times
    found = [(o.vertices, o.cutoff, o.volume_change, o.seconds) for o in first.outcomes]
    assert [(o.vertices, o.cutoff, o.volume_change, o.seconds) for o in again.outcomes] == found
    shutil.copy(inputs / "scan1.ply", inputs / "scan0.ply")  # another input
    (out / "scan1.ply").write_bytes(b"torn")  # an output that is not what was written
    (out / f"scan2.ply{RECORD_ENDING}").write_text('{"half')  # a record that is none
    assert batch(inputs, out).counts == {"done": 3}
    assert batch(inputs, out).counts == {"skipped": 3}


def test_other_settings_another_version_and_a_wish_are_reasons_to_do_it_again(tmp_path, monkeypatch, in_this_process):
    inputs, out = scans(tmp_path / "in", 1), tmp_path / "out"
    batch(inputs, out)
    assert batch(inputs, out, barycenter_weight=0.0).counts == {"skipped": 1}  # that is the default
    assert batch(inputs, out, barycenter_weight=0.5).counts == {"done": 1}
    assert batch(inputs, out, barycenter_weight=0.5, wavelength=pymeshlab.PercentageValue(10)).counts == {"done": 1}
    assert batch(inputs, out, barycenter_weight=0.5, wavelength=pymeshlab.PercentageValue(10)).counts == {"skipped": 1}
    assert batch(inputs, out, resume=False).counts == {"done": 1}
    assert batch(inputs, out, filter_name="apply_coord_spectral_low_pass").counts == {"done": 1}
    assert batch(inputs, out).counts == {"done": 1}
    assert batch(inputs, out).counts == {"skipped": 1}
    monkeypatch.setattr(work, "VERSION", "0.0.0")
    assert batch(inputs, out).counts == {"done": 1}


def test_a_share_of_the_diagonal_is_one_of_each_mesh(tmp_path, in_this_process):
    inputs = scans(tmp_path / "in", 1)
    V, F = torus()
    mesh_files.write(meshset.new(100 * V, F), inputs / "large.ply")
    cutoffs = [o.cutoff for o in batch(inputs, tmp_path / "a", wavelength=pymeshlab.PercentageValue(25)).outcomes]
    mesh_files.write(meshset.new(V, F), inputs / "large.ply")
    same = [o.cutoff for o in batch(inputs, tmp_path / "b", wavelength=pymeshlab.PercentageValue(25)).outcomes]
    assert same == pytest.approx(cutoffs, rel=1e-5)


def test_the_noise_that_was_measured_is_in_the_summary(tmp_path, in_this_process):
    path = scans(tmp_path / "in", 1) / "scan0.ply"
    (outcome,) = batch([path], tmp_path / "out", filter_name="apply_coord_edge_aware_smoothing").outcomes
    V, F = meshset.get_arrays(mesh_files.read(path))
    assert outcome.noise == pytest.approx(mss.smooth_edge_aware(V, F).noise.level)
    assert outcome.cutoff is None
    (outcome,) = batch([path], tmp_path / "other").outcomes
    assert outcome.noise == pytest.approx(mss.estimate_noise(V, F).level)
    assert outcome.cutoff > 0


def test_denoising_takes_its_own_options_and_reports_a_selection(tmp_path, in_this_process, capsys):
    ms = meshset.new(*rough(sheet(9, 6)))
    ms.compute_selection_by_condition_per_vertex(condselect="vi < 30")
    ms.save_current_mesh(str(tmp_path / "tile.ply"), save_vertex_flag=True)
    out = tmp_path / "out"
    options = ["--denoise", "--boundary", "fixed", "--crease-angle", "60", "--no-pictures"]
    assert main(["batch", str(tmp_path / "tile.ply"), "--out", str(out), *options]) == 0
    line = "30 of 54 vertices are selected: only these are smoothed"
    printed = capsys.readouterr()
    assert line in printed.out
    assert line not in printed.err
    assert line in (out / "summary.csv").read_text()
    V, F = meshset.get_arrays(mesh_files.read(tmp_path / "tile.ply"))
    expected = mss.denoise(V, F, mask=np.arange(54) < 30, boundary="fixed", creases=60)
    assert np.array_equal(meshset.get_arrays(mesh_files.read(out / "tile.ply"))[0], expected.vertices)


def test_wrong_settings_are_refused_before_anything_is_done(tmp_path):
    inputs, out = scans(tmp_path / "in", 1), tmp_path / "out"
    for wrong in (
        {"color": 1},
        {"iterations": 0},
        {"response": "box"},
        {"filter_name": "get_spectrum"},
        {"ending": "ply"},
    ):
        with pytest.raises(mss.InvalidParameter):
            batch(inputs, out, **wrong)
    with pytest.raises(mss.InvalidParameter, match="workers is 0"):
        batch(inputs, out, workers=0)
    with pytest.raises(mss.InvalidParameter, match="time_limit is 0"):
        batch(inputs, out, time_limit=0.0)
    assert not out.exists() or not list(out.iterdir())


def test_folders_patterns_manifests_and_files_keep_their_places(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a/x.ply", "a/b/x.PLY", "a/b/notes.md", "a/.hidden.ply", "a/.tmp/x.ply", "c/y.obj", "out/z.ply"):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()
    Path("c/list.txt").write_text("# all\n\ny.obj\n../a/x.ply\n")

    def places(*inputs, **given):
        return [str(Path(s.output).relative_to(tmp_path / "out")) for s in sources(inputs, "out", **given)]

    assert places("a") == ["b/x.PLY", "x.ply"]
    assert places("a/**/*.ply", "c") == ["x.ply", "y.obj"]
    assert places("a/*/x.*", ending=".stl") == ["b/x.stl"]
    assert places("c/list.txt") == ["y.obj", "x.ply"]
    assert places("a/x.ply", "a/x.ply", "./a") == ["x.ply", "b/x.PLY"]  # each once
    assert places(".") == ["a/b/x.PLY", "a/x.ply", "c/y.obj"]  # what lies in the output folder is no input
    with pytest.raises(mss.InvalidParameter, match="would both become"):
        sources(["a/x.ply", "out/../a/b/x.PLY"], "out", ".ply")
    with pytest.raises(mss.InvalidParameter, match="would be replaced by its own result"):
        sources("a/x.ply", "a")
    for nothing in ("empty", "c/*.stl"):
        Path("empty").mkdir(exist_ok=True)
        with pytest.raises(mss.FileError, match="no mesh"):
            sources(nothing, "out")
    with pytest.raises(mss.InvalidParameter, match="no mesh"):
        sources([], "out")
    Path("bad.txt").write_bytes(b"\xff\xfe\x00")
    for manifest in ("bad.txt", "none.txt"):
        with pytest.raises(mss.FileError, match=f"{manifest}: cannot be read"):
            sources(manifest, "out")
    Path("bad.txt").write_text("x" * 5000)
    with pytest.raises(mss.FileError, match="bad.txt:1: is not a path"):
        sources("bad.txt", "out")


def test_as_many_run_at_once_as_there_is_memory_for(monkeypatch):
    running, most = set(), [0]

    class Recorder(local.MeshWorker):
        def do(self, job, limit, time_limit):
            running.add(job.source)
            most[0] = max(most[0], sum(needed for job, needed in jobs if job.source in running))
            time.sleep(0.01)
            running.discard(job.source)
            return work.failure(job, "failed", "")

    budget = 2 * local.bytes_needed("x.ply", 9 * 10**6)
    monkeypatch.setattr(local, "MeshWorker", Recorder)
    monkeypatch.setattr(local.memory, "available", lambda: budget)
    needs = {f"{n}.ply": local.bytes_needed(f"{n}.ply", n * 10**6) for n in range(1, 13)}
    jobs = [(Job(source, "", "", {}), needed) for source, needed in needs.items()]
    assert len(list(local.outcomes(jobs, 8, 60.0))) == 12
    assert 0 < most[0] <= budget
    monkeypatch.setattr(local.memory, "available", lambda: 0)  # then one by one
    assert len(list(local.outcomes(jobs, 8, 60.0))) == 12


@pytest.mark.skipif(sys.platform != "linux", reason="Linux sees to it")
def test_a_mesh_that_takes_more_memory_than_its_share_fails_by_itself(tmp_path, monkeypatch):
    inputs = scans(tmp_path / "in", 1)
    code = """
from meshlab_specsmooth.batching import work, worker
def greedy(job):
    try:
        bytearray(3 * 2**30)
    except MemoryError:
        return work.failure(job, "failed", "memory ran out")
    return work.run(job)
worker.serve(greedy)
"""
    monkeypatch.setattr(local, "command", lambda *_: (sys.executable, "-c", code))
    monkeypatch.setattr(local.memory, "available", lambda: 2**30)
    assert [outcome.reason for outcome in batch(inputs, tmp_path / "out").outcomes] == ["memory ran out"]


# a weight that is given leaves little to compute, and several iterations make it last long enough to be interrupted
LONG = {"iterations": 5, "barycenter_weight": 0.3}


def command(*arguments):
    given = [word for name, value in LONG.items() for word in ("--" + name.replace("_", "-"), value)]
    return [sys.executable, "-m", "meshlab_specsmooth", "batch", *map(str, [*arguments, *given]), "--no-pictures"]


def until(condition, seconds=300):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.005)


def records(out):
    return list(out.glob(f"*{RECORD_ENDING}"))


def assert_nothing_looks_finished_that_is_not(out):
    """Each mesh in the folder can be read, and is whole; what has a record is what is recorded."""
    for path in out.glob("*.ply"):
        assert mesh_files.read(path).current_mesh().vertex_number() > 0
    for path in records(out):
        output = str(path)[: -len(RECORD_ENDING)]
        assert record.read_record(output).is_of(output)


@posix
@pytest.mark.no_cover
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_run_that_is_killed_is_gone_on_with(tmp_path, monkeypatch, number):
    inputs, out = scans(tmp_path / "in", 6, (60, 50)), tmp_path / "out"
    with subprocess.Popen(
        command(inputs, "--out", out, "--workers", 2), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        until(lambda: len(records(out)) >= 2)
        process.send_signal(number)
        _, error = process.communicate()
    assert process.returncode != 0
    assert b"Traceback" not in error
    finished = {str(path): path.stat().st_mtime_ns for path in records(out)}
    assert_nothing_looks_finished_that_is_not(out)
    if number != signal.SIGKILL:  # what was going on was cleaned up, and told
        assert not list(out.glob(".specsmooth-*"))
        counts = json.loads((out / "summary.json").read_text())["counts"]
        assert counts.get("done", 0) + counts["not run"] == 6
    monkeypatch.setattr(local, "outcomes", lambda jobs, workers, time_limit: (work.run(job) for job, _ in jobs))
    again = batch(inputs, out, **LONG)
    assert again.is_complete
    assert again.counts["skipped"] >= len(finished)
    assert all(Path(name).stat().st_mtime_ns == then for name, then in finished.items())
    # one that was killed before it had its lock is kept for a day
    assert not [folder for folder in out.glob(".specsmooth-*") if (folder / "lock").is_file()]
    fresh = batch(inputs, tmp_path / "fresh", **LONG)
    assert fresh.is_complete
    assert outputs(out) == outputs(tmp_path / "fresh")


@posix
def test_what_is_left_by_the_dead_is_removed_and_by_the_living_not(tmp_path):
    def folder_of_a_copy(ends):
        """A temporary folder of a copy of this process, which ends at once or waits to be killed."""
        reader, writer = os.pipe()
        process = os.fork()
        if process == 0:
            os.write(writer, str(temporary.create(tmp_path).root).encode())
            if not ends:
                time.sleep(60)
            os._exit(0)
        if ends:
            os.waitpid(process, 0)
        return process, Path(os.read(reader, 1000).decode())

    _, dead = folder_of_a_copy(ends=True)
    process, alive = folder_of_a_copy(ends=False)
    old, begun, strange = (tmp_path / f"{temporary.PREFIX}{name}" for name in ("old", "begun", "strange"))
    for folder in (old, begun):
        folder.mkdir()
    os.utime(old, (0, 0))
    strange.write_text("a file")
    temporary.remove_stale(tmp_path)
    assert not dead.exists()
    assert set(tmp_path.iterdir()) == {alive, begun, strange}  # whatever number its process has, and where
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    temporary.remove_stale(tmp_path)
    assert set(tmp_path.iterdir()) == {begun, strange}


@contextlib.contextmanager
def dask(folder, count, **environment):
    """A scheduler and so many workers, each a process: its address, the workers, and the scheduler."""
    pytest.importorskip("distributed")
    file = folder / "scheduler.json"
    given = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    untraced = {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")}
    given["env"] = {**untraced, **environment}
    command = [sys.executable, "-m", "dask"]
    here = ["--host", "127.0.0.1", "--scheduler-file", file, "--no-dashboard"]
    processes = [subprocess.Popen([*command, "scheduler", *here, "--port", "0"], **given)]
    try:
        until(lambda: file.exists() and file.stat().st_size > 0)  # it is made empty, and written in one go
        worker = [*command, "worker", *here, "--nthreads", "1", "--no-nanny", "--local-directory", folder]
        processes += [subprocess.Popen(worker, **given) for _ in range(count)]
        yield json.loads(file.read_text())["address"], processes[1:], processes[0]
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


# what the workers of a cluster may run instead: their processes die of meshes that are called so, or they do
FATAL = f"""
import os, sys
from meshlab_specsmooth.batching import cluster, local
run_there = cluster.run_there
def run_or_die(job, *rest):
    if "worker" in job.source:
        os._exit(1)
    local.command = lambda *_: (sys.executable, "-c", {DYING!r})
    return run_there(job, *rest)
"""


@pytest.fixture(scope="module")
def four_workers(tmp_path_factory):
    """One cluster for all tests, as its processes take seconds to start; its address, workers, folder and scheduler."""
    folder = tmp_path_factory.mktemp("dask")
    (folder / "fatal_jobs.py").write_text(FATAL)
    # with this setting Dask gives up all that a worker had which died
    environment = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0", "PYTHONPATH": str(folder)}
    with dask(folder, 4, **environment) as (address, workers, scheduler):
        yield address, workers, folder, scheduler


@posix
@pytest.mark.no_cover
def test_a_cluster_gives_the_same_bits_though_a_worker_is_killed(tmp_path, four_workers):
    inputs = scans(tmp_path / "in", 4)
    (inputs / "damaged.ply").write_text("ply\n")
    out, here = tmp_path / "cluster", tmp_path / "local"
    address, workers, _, _ = four_workers
    given = command(inputs, "--out", out, "--scheduler", address)
    with subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        until(lambda: records(out))
        workers[0].kill()
        printed, error = process.communicate()
    workers[0].wait()
    assert process.returncode == 1
    assert "1 of 5 meshes failed" in error
    lines = printed.splitlines()
    # a record may be there while its worker dies before it can say so: then it is found by the other one
    assert sum(line.startswith(("done", "skipped")) for line in lines) == 4
    assert {Path(line.split(": ")[0]).name for line in lines if line.startswith("failed")} == {"damaged.ply"}
    assert batch(inputs, here, **LONG).counts == {"done": 4, "failed": 1}
    assert outputs(out) == outputs(here)
    assert batch(inputs, out, **LONG).counts == {"skipped": 4, "failed": 1}


@posix
@pytest.mark.no_cover
def test_pieces_of_one_mesh_on_a_cluster_give_the_same_bytes(tmp_path, monkeypatch, four_workers):
    address, *_ = four_workers
    meshset.new(*noisy(torus(200, 128), 0.2)).save_current_mesh(str(tmp_path / "scan.ply"))
    monkeypatch.setattr(whole, "_MIN_PIECE", 4000)
    monkeypatch.setattr(whole, "_MAX_PIECE", 12_000)
    given = {"barycenter_weight": 0.5, "memory_limit": "1G"}
    there = mss.smooth_pieces(tmp_path / "scan.ply", tmp_path / "there.ply", scheduler=address, **given)
    monkeypatch.setattr(local, "outcomes", lambda jobs, *_: (run_piece(job) for job, _ in jobs))
    here = mss.smooth_pieces(tmp_path / "scan.ply", tmp_path / "here.ply", **given)
    assert there.pieces == here.pieces >= 3
    assert (tmp_path / "there.ply").read_bytes() == (tmp_path / "here.ply").read_bytes()


@posix
def test_on_a_cluster_a_mesh_that_kills_its_process_or_its_worker_costs_no_other(tmp_path, monkeypatch, four_workers):
    inputs, out = scans(tmp_path / "in", 2), tmp_path / "out"
    for path in (inputs / "killed.ply", inputs / "kills its worker.ply", tmp_path / "endless.ply"):
        shutil.copy(inputs / "scan0.ply", path)
    address, workers, folder, _ = four_workers
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(cluster, "run_there", importlib.import_module("fatal_jobs").run_or_die)
    alive = [worker for worker in workers if worker.poll() is None]
    summary = batch(inputs, out, scheduler=address)
    late = batch(tmp_path / "endless.ply", out, scheduler=address, time_limit=1.0)
    assert sum(worker.poll() is not None for worker in alive) == 2  # it was tried twice
    assert statuses(summary) == {
        "scan0": "done",
        "scan1": "done",
        "killed": "crashed",
        "kills its worker": "crashed",
    }
    reasons = {Path(outcome.input).stem: outcome.reason for outcome in summary.outcomes}
    assert "crashed (SIGKILL)" in reasons["killed"]
    assert reasons["kills its worker"] == "every Dask worker that ran it died"
    assert [outcome.reason for outcome in late.outcomes] == ["the process that read or smoothed it took more than 1 s"]


@pytest.mark.parametrize(
    "address",
    ["127.0.0.1", "nonsense", "", ":", "tcp://127.0.0.1:none", "tcp://127.0.0.1:99999", "a://b:1", "inproc://a"],
)
def test_an_address_that_is_none_is_refused_at_once(address, tmp_path):
    pytest.importorskip("distributed")
    before = threading.active_count()
    with pytest.raises(mss.ClusterError, match="there is no Dask scheduler"):
        batch(scans(tmp_path / "in", 1), tmp_path / "out", scheduler=address)
    assert threading.active_count() == before  # a client that finds none leaves one, for which the process waits


@posix
@pytest.mark.no_cover
def test_a_scheduler_that_dies_is_one_line(tmp_path, four_workers):
    address, _, _, scheduler = four_workers
    given = command(scans(tmp_path / "in"), "--out", tmp_path / "lost", "--scheduler", address)
    with subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()  # that of the first mesh
        scheduler.kill()
        _, complaint = process.communicate(timeout=60)
    expected = f"specsmooth: {address}: the scheduler is lost; what is done is recorded\n"
    assert (process.returncode, complaint) == (1, expected)


@pytest.mark.no_cover
def test_no_cluster_is_one_line(tmp_path, monkeypatch, capsys):
    inputs = scans(tmp_path / "in", 1)
    arguments = ["batch", str(inputs), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:1"]
    environment = {**os.environ, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s"}
    done = subprocess.run(
        [sys.executable, "-m", "meshlab_specsmooth", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("specsmooth: tcp://127.0.0.1:1: there is no Dask scheduler")
    assert done.stderr.count("\n") == 1
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(arguments) == 1
    assert "pip install 'meshlab-specsmooth[cluster]'" in capsys.readouterr().err


def test_contact_sheets_show_each_mesh_before_and_after(tmp_path, monkeypatch, in_this_process):
    pytest.importorskip("pyvista")
    summary = batch(scans(tmp_path / "in", 2), tmp_path / "out", pictures=True)
    assert summary.pictures == (str(tmp_path / "out" / "contact-1.png"),)
    assert Path(summary.pictures[0]).read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["pictures"] == list(summary.pictures)
    pairs = [(outcome.input, outcome.output) for outcome in summary.outcomes]
    assert contact_sheet.draw_apart(tmp_path, [("none.ply", "none.ply")]) == ()  # the process fails, and that is all
    monkeypatch.setattr(contact_sheet.importlib.util, "find_spec", lambda name: None)
    assert contact_sheet.draw_apart(tmp_path, pairs) == ()


def test_a_line_is_one_line_whatever_the_file_is_called(tmp_path):
    name = "a\nb\x1b[31m\udcff ü"
    lines = [
        command_line.line(mss.Outcome(name, name, "done", vertices=3, noise=0.1, cutoff=0.2, volume_change=-0.01)),
        command_line.line(mss.Outcome(name, name, "failed", "no such file")),
    ]
    for line in lines:
        assert line.encode()
        assert line.isprintable()
        assert r"a\nb\x1b[31m\udcff ü" in line
    assert "noise 0.1 in mesh units volume -1.000 %" in lines[0]


@posix
def test_strange_names_are_names(tmp_path, in_this_process):
    inputs = tmp_path / "in"
    inputs.mkdir()
    scan = scans(tmp_path / "made", 1) / "scan0.ply"
    names = ["with space.ply", 'it\'s "quoted".ply', "new\nline.ply", "ünïcödé.ply", "-dash.ply", "100%.ply"]
    for name in names:
        shutil.copy(scan, inputs / name)
    summary = batch(inputs, tmp_path / "out")
    assert summary.counts == {"done": len(names)}
    assert set(outputs(tmp_path / "out")) == set(names)
