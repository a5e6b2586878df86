"""Memory is known before it is taken."""

import os
import sys
import threading

import numpy as np
import pytest

import meshlab_specsmooth as mss
from meshlab_specsmooth.runtime import memory
from meshlab_specsmooth.runtime.workspace import Workspace

GIB = 2**30


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A machine of 8 GiB available memory without control groups; a function adds files to it."""
    monkeypatch.setattr(memory, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "_CGROUPS", tmp_path / "groups")

    def add(**files):
        for name, text in files.items():
            path = tmp_path / name.replace("__", "/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(str(text))

    add(proc__meminfo=f"MemTotal: 16777216 kB\nMemFree:  1048576 kB\nMemAvailable:  {8 * 2**20} kB\n")
    return lambda files: add(**files)


def test_linux_says_what_is_available(machine):
    assert memory.available() == 8 * GIB


@pytest.mark.parametrize(
    ("limit", "used", "cache", "expected"),
    [
        (4 * GIB, GIB, 0, 3 * GIB),
        (4 * GIB, 3 * GIB, 2 * GIB, 3 * GIB),  # files that were read give way
        (4 * GIB, 5 * GIB, 0, 0),
        (64 * GIB, GIB, 0, 8 * GIB),  # more than the machine has
        ("max", GIB, 0, 8 * GIB),
    ],
)
def test_a_control_group_of_version_2_limits_it(machine, limit, used, cache, expected):
    machine(
        {
            "proc__self__cgroup": "0::/user/job\n",
            "groups__user__job__memory.max": f"{limit}\n",
            "groups__user__job__memory.current": f"{used}\n",
            "groups__user__job__memory.stat": f"anon 7\ninactive_file {cache}\nactive_file 5\n",
        }
    )
    assert memory.available() == expected


def test_a_group_around_it_limits_it_as_well(machine):
    machine(
        {
            "proc__self__cgroup": "0::/user/job\n",
            "groups__user__job__memory.max": "max\n",
            "groups__user__job__memory.current": f"{GIB}\n",
            "groups__user__memory.max": f"{6 * GIB}\n",
            "groups__user__memory.current": f"{GIB}\n",
        }
    )
    assert memory.available() == 5 * GIB


def test_in_a_container_the_group_is_the_root_that_is_seen(machine):
    machine(
        {
            "proc__self__cgroup": "0::/\n",
            "groups__memory.max": f"{2 * GIB}\n",
            "groups__memory.current": f"{GIB}\n",
        }
    )
    assert memory.available() == GIB


@pytest.mark.parametrize("path", ["/", "/docker/123"])
def test_a_control_group_of_version_1_limits_it(machine, path):
    # inside a container the path is one of the host's, and what is mounted is the container's own
    machine(
        {
            "proc__self__cgroup": f"12:cpu,cpuacct:/\n5:hugetlb,memory:{path}\n1:name=systemd:/\n",
            "groups__memory__memory.limit_in_bytes": f"{3 * GIB}\n",
            "groups__memory__memory.usage_in_bytes": f"{2 * GIB}\n",
            "groups__memory__memory.stat": f"cache 3\ntotal_inactive_file {GIB}\n",
        }
    )
    assert memory.available() == 2 * GIB


def test_without_linux_free_pages_count_and_without_posix_nothing(machine, monkeypatch):
    machine({"proc__meminfo": ""})
    monkeypatch.setattr(os, "sysconf", {"SC_AVPHYS_PAGES": 1000, "SC_PAGE_SIZE": 4096}.__getitem__, raising=False)
    assert memory.available() == 4096000

    def unknown(name):
        raise ValueError("unrecognized configuration name")

    monkeypatch.setattr(os, "sysconf", unknown)
    assert memory.available() == 2**63 - 1
    monkeypatch.delattr(os, "sysconf")
    assert memory.available() == 2**63 - 1


def test_what_does_not_fit_is_refused_with_both_sizes_and_the_remedy(machine):
    memory.require(8 * GIB, "it")
    with pytest.raises(mss.TooLarge) as refused:
        memory.require(8 * GIB + GIB // 2, "smoothing 30000000 vertices")
    assert str(refused.value) == (
        "smoothing 30000000 vertices needs 8.5 GiB of memory, and 8.0 GiB are available; close other programs, take a "
        "machine (or a container's limit) with more, or decimate or split the mesh first"
    )


def test_the_real_machine_has_some():
    assert 2**20 < memory.available() < 2**63


linux = pytest.mark.skipif(sys.platform != "linux", reason="Linux sees to it")


@linux
def test_what_takes_more_than_its_share_fails_and_the_next_has_all_again():
    with memory.limited(2**28):
        assert len(bytes(2**26)) == 2**26
        with pytest.raises(MemoryError):
            np.ones(2**29, dtype=np.uint8)
        with memory.limited(2**40), pytest.raises(MemoryError):  # a lower limit stays
            np.ones(2**29, dtype=np.uint8)
    assert np.ones(2**29, dtype=np.uint8).all()


@linux
def test_a_thread_sets_no_limit_for_the_others():
    import resource

    def look():
        with memory.limited(2**20):
            seen.append(resource.getrlimit(resource.RLIMIT_DATA))

    seen = []
    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert seen == [resource.getrlimit(resource.RLIMIT_DATA)]


def test_where_the_system_cannot_see_to_it_there_is_no_limit(machine):
    with memory.limited(2**20):  # this machine has no /proc/self/statm
        assert len(bytes(2**26)) == 2**26


def test_an_array_of_a_workspace_is_borrowed_once_and_none_of_another_shape():
    X, work = np.zeros((4, 3)), Workspace(max_arrays=3)
    arrays = [np.ones((4, 3)) for _ in range(5)]
    work.give_back(*arrays)
    assert len(work) == 3
    work.give_back(np.ones((5, 3)))
    borrowed = [work.borrow(X) for _ in range(4)]
    assert {array.shape for array in borrowed} == {(4, 3)}
    assert len({id(array) for array in borrowed}) == 4
    assert sum(any(array is each for each in arrays) for array in borrowed) == 2
