import io
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from meshlab_specsmooth.batching import local
from meshlab_specsmooth.batching.worker import serve
from meshlab_specsmooth.isolation import processes
from meshlab_specsmooth.isolation.exit_status import describe_exit
from meshlab_specsmooth.isolation.messages import read_message, write_message
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed

# what Python imports as it starts, and what our processes do
NAMES = ["encodings", "io", "json", "numpy", "os", "pathlib", "signal", "site", "sitecustomize", "usercustomize"]


@pytest.fixture
def hostile_folder(tmp_path, monkeypatch):
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write('{name} ')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("path", [None, "", os.pathsep, f"{os.curdir}{os.pathsep}{{folder}}/none", "./"])
@pytest.mark.parametrize("safe", ["", "1"])  # Python 3.11 has it
def test_a_process_imports_nothing_from_the_working_directory(path, safe, hostile_folder, monkeypatch):
    monkeypatch.setenv("PYTHONSAFEPATH", safe)
    if path is None:
        monkeypatch.delenv("PYTHONPATH", raising=False)
    else:
        monkeypatch.setenv("PYTHONPATH", path.format(folder=hostile_folder))
    command = processes.command(processes.environment)
    monkeypatch.setenv("PYTHONWARNINGS", "error")
    done = subprocess.run(command, env=processes.environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not (hostile_folder / "ran").exists()


@pytest.mark.no_cover  # what traces a process imports json before
def test_a_process_that_is_started_in_another_way_does(hostile_folder, monkeypatch):
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    subprocess.run([sys.executable, "-c", "import json"], check=True)
    assert (hostile_folder / "ran").read_text() == "json "


def test_entries_of_the_python_path_stay(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", str(tmp_path), ".", "modules", ""]))
    assert processes.environment()["PYTHONPATH"] == os.pathsep.join([str(tmp_path), "modules"])
    monkeypatch.delenv("PYTHONPATH")
    assert processes.environment() == dict(os.environ)


def test_the_worker_of_a_batch_starts_in_this_way(hostile_folder):
    assert local.command() == processes.command(serve)
    given = {"stdin": subprocess.DEVNULL, "capture_output": True, "check": False, "env": processes.environment()}
    done = subprocess.run(local.command(), **given)
    assert (done.stdout, done.stderr) == (b"", b"")
    assert not (hostile_folder / "ran").exists()


def test_a_message_keeps_every_bit_of_numbers_and_arrays_and_their_order():
    values = [
        0.1,
        -0.0,
        2.0**-1074,
        float("inf"),
        2**70,
        True,
        None,
        "\udcff\n",
        {"a": []},
        np.float32(0.1),
        np.int8(3),
    ]
    C = np.random.default_rng(0).standard_normal((5, 3))
    arrays = [C, np.asfortranarray(C), C[::2, 1:], np.empty((0, 3)), np.arange(3, dtype=np.int32), np.array([True])]
    stream = io.BytesIO()
    write_message(stream, [values, arrays])
    write_message(stream, "the next")
    stream.seek(0)
    (numbers, (*got,)), following = read_message(stream), read_message(stream)
    assert (numbers, following) == (values, "the next")
    assert str(numbers[1]) == "-0.0"
    for array, expected in zip(got, arrays, strict=True):
        assert array.dtype == expected.dtype
        assert np.array_equal(array, expected)
        assert array.flags.c_contiguous == expected.flags.c_contiguous or not expected.flags.forc
        assert array.flags.writeable
    for length in range(len(stream.getvalue()) - len(b'"the next"\n')):
        with pytest.raises(EOFError):
            read_message(io.BytesIO(stream.getvalue()[:length]))


WORKER = """
import os, sys, time
from meshlab_specsmooth.isolation.worker import serve
def answer(request):
    print("noise")
    os.write(1, b"noise")
    if request == "hang":
        time.sleep(60)
    return os._exit(request) if isinstance(request, int) else [request, os.getpid()]
serve(answer)
"""


def test_a_worker_answers_until_it_ends_and_then_another_one_does():
    with Worker([sys.executable, "-c", WORKER], {"PYTHONUNBUFFERED": "1"}) as worker:
        (_, first), (_, same) = worker.ask("a"), worker.ask("b")
        assert first == same
        with pytest.raises(WorkerFailed, match="^ended with exit code 3$"):
            worker.ask(3)
        request, second = worker.ask("c")
        assert request == "c"
        assert second != first
        with pytest.raises(WorkerFailed, match=r"^took more than 0.1 s$"):
            worker.ask("hang", timeout=0.1)
        with pytest.raises(TypeError, match="cannot be part of a message"):
            worker.ask(object())
        worker.terminate()
        with pytest.raises(WorkerFailed, match="was not started"):
            worker.ask("d")


@pytest.mark.skipif(sys.platform != "linux", reason="Linux has /proc")
def test_a_worker_ends_when_its_caller_does(tmp_path):
    code = f"""
import os, sys
from meshlab_specsmooth.isolation.worker import Worker
worker = Worker([sys.executable, "-c", {WORKER!r}])
print(worker.ask("a")[1], flush=True)
os.kill(os.getpid(), 9)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    end = time.monotonic() + 60
    while Path(f"/proc/{int(done.stdout)}").exists():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_an_exit_is_described_by_its_code_or_signal():
    assert [describe_exit(code) for code in (0, 3, -11)] == [
        "ended with exit code 0",
        "ended with exit code 3",
        "crashed (SIGSEGV)",
    ]
    assert describe_exit(-50) == "crashed (signal 50)"  # a real-time signal
