"""A command whose process dies of a file is one line and an exit code, as other failures are."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from meshlab_specsmooth.meshlab import mesh_files, meshset
from tests.meshes import rough, torus

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux alone")

# the command line, in whose process reading or writing comes to such an end
MAIN = """
import atexit, ctypes, os, select, signal, sys, time
from pathlib import Path
import pymeshlab
from meshlab_specsmooth.runtime import memory
from meshlab_specsmooth.meshlab import mesh_files
from meshlab_specsmooth.cli import main

memory.available = lambda: 2**28

def end(*_):
    {how}

owner, name = {{
    "read": (pymeshlab.MeshSet, "load_new_mesh"),
    "written": (mesh_files, "copy_textures"),
}}[{where!r}]
setattr(owner, name, end)
sys.exit(main())
"""
SCRIPT = '<FilterScript><filter name="Spectral Smooth"/></FilterScript>'


@pytest.fixture
def folder(tmp_path, untraced):
    mesh_files.write(meshset.new(*rough(torus(8, 6))), tmp_path / "scan.ply")
    (tmp_path / "script.mlx").write_text(SCRIPT)
    (tmp_path / "out.ply").write_bytes(b"as it was")
    return tmp_path


def start(folder, how, where, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", MAIN.format(how=how, where=where), *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_what_a_killed_command_left_is_removed_by_the_next(folder):
    process = start(folder, WAITS, "written", "smooth", "scan.ply", "out.ply")
    until(lambda: (folder / "copy").is_file() and (folder / "copy").read_text(), process)
    os.kill(int((folder / "copy").read_text()), signal.SIGKILL)
    process.kill()
    process.communicate()
    (folder / "copy").unlink()
    process = start(folder, "raise MemoryError", "read", "smooth", "scan.ply", "out.ply")
    assert process.communicate()[1] == "specsmooth: scan.ply: cannot be read: memory ran out\n"
    assert {path.name for path in folder.iterdir()} == {"scan.ply", "script.mlx", "out.ply"}


@pytest.mark.parametrize(
    ("how", "where", "command", "name"),
    [
        ("ctypes.string_at(0)", "read", ["smooth"], "SIGSEGV"),
        ("os.abort()", "read", ["denoise"], "SIGABRT"),
        ("os.kill(os.getpid(), signal.SIGKILL)", "written", ["run", "script.mlx"], "SIGKILL"),
        # as where a reader damages the memory of its process, which is noticed at its end
        (
            "atexit.register(os.abort); os.write(2, b'free()'); return ()",
            "written",
            ["smooth"],
            "SIGABRT",
        ),
    ],
)
def test_a_file_that_kills_the_process_is_one_line_and_leaves_the_target(folder, how, where, command, name):
    process = start(folder, how, where, *command, "scan.ply", "out.ply")
    printed, problem = process.communicate()
    assert (process.returncode, printed) == (1, "")
    assert problem == f"specsmooth: scan.ply: the process that read, changed or wrote it crashed ({name})\n"
    assert (folder / "out.ply").read_bytes() == b"as it was"
    assert {path.name for path in folder.iterdir()} == {"scan.ply", "script.mlx", "out.ply"}


def test_a_reader_that_takes_all_memory_is_one_line(folder):
    process = start(folder, "held = [bytes(2**20) for _ in range(2**12)]", "read", "smooth", "scan.ply", "out.ply")
    _, problem = process.communicate()
    assert (process.returncode, problem) == (1, "specsmooth: scan.ply: cannot be read: memory ran out\n")


def test_a_file_system_without_locks_is_written_to_as_well(folder):
    code = """
import sys
from meshlab_specsmooth.cli import main
from meshlab_specsmooth.runtime import temporary
temporary._try_lock = lambda file: False
sys.exit(main())
"""
    command = [sys.executable, "-c", code, "smooth", "scan.ply", "out.ply"]
    assert subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode == 0
    assert (folder / "out.ply").read_bytes().startswith(b"ply")
    assert not list(folder.glob(".specsmooth-*"))


def until(condition, process=None, seconds=300.0):
    end = time.monotonic() + seconds
    while not condition():
        assert process is None or process.poll() is None, process.communicate()
        assert time.monotonic() < end, "it never came"
        time.sleep(0.01)


# until there is a signal: one that is held back does not end a sleep
WAITS = """
    read, write = os.pipe()
    os.set_blocking(write, False)
    signal.set_wakeup_fd(write)
    Path("copy").write_text(str(os.getpid()))
    select.select([read], [], [], 60)
"""


@pytest.mark.parametrize(
    ("name", "code"), [("SIGINT", 1), ("SIGTERM", 128 + signal.SIGTERM), ("SIGKILL", -signal.SIGKILL)]
)
def test_a_signal_ends_both_processes(folder, name, code):
    process = start(folder, WAITS, "written", "smooth", "scan.ply", "out.ply", "--barycenter-weight", "1000")
    until(lambda: (folder / "copy").is_file() and (folder / "copy").read_text(), process)
    copy = int((folder / "copy").read_text())
    assert copy != process.pid
    process.send_signal(getattr(signal, name))
    printed, problem = process.communicate()  # at its end neither process is there to write
    assert (process.returncode, printed) == (code, "")
    assert problem == ("specsmooth: interrupted\n" if name == "SIGINT" else "")
    assert (folder / "out.ply").read_bytes() == b"as it was"
    until(lambda: not Path(f"/proc/{copy}").exists())
    if name != "SIGKILL":
        assert not list(folder.glob(".specsmooth-*"))
