"""A whole call gives the same bits in every process, however many threads and processors it has."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CALLS = """
import hashlib, os, sys
import numpy as np
processors, extra = int(sys.argv[1]), sys.argv[2]
if extra == "without":
    sys.modules["numba"] = sys.modules["threadpoolctl"] = None
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:processors])
import meshlab_specsmooth as mss
from meshlab_specsmooth.runtime import blocks
from tests.meshes import rough, torus

blocks._WORTH_A_THREAD = 1  # so that threads share the work on a mesh of this size, as they do on large ones
assert blocks.threads() == processors
V, F = rough(torus(96, 90))
assert blocks.count(len(V)) == 2
results = {"smooth": mss.smooth(V, F), "spectrum": mss.spectrum(V, F)}
if extra == "with":  # without it BLAS's own threads show in these, and the search takes long
    results["denoise"] = mss.denoise(V, F)
    small = rough(torus(24, 20))
    for modes in (9, 30, 90):
        results[f"{modes} modes"] = mss.smooth(V, F, modes=modes, method="exact", barycenter_weight=1.0)
    results["all modes"] = mss.low_pass(*small, wavelength=5.0, response="heat", method="exact")
    results["modes estimated"] = mss.smooth(V, F, modes=90, barycenter_weight=1.0)
    results["modes counted"] = mss.smooth(V, F, modes=90, mode_count="exact", barycenter_weight=1.0)
    results["spectrum of a small mesh"] = mss.spectrum(*small)
else:
    results["edge-aware"] = mss.smooth_edge_aware(V, F, strength=1.0, range_sigma=0.3, iterations=2)
for name, result in results.items():
    # the evidence as well, but for the time that it took
    parts = [np.asarray(part).tobytes() if isinstance(part, np.ndarray | int | float) else repr(part).encode()
             for field, part in sorted(vars(result).items()) if field not in ("seconds", "source", "given")]
    print(name, hashlib.sha256(b"".join(parts)).hexdigest())
"""


@pytest.mark.skipif(
    not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < 2, reason="there must be two processors"
)
@pytest.mark.no_cover
@pytest.mark.parametrize("extra", ["with", "without"])
def test_the_number_of_threads_does_not_show_in_a_whole_call(extra):
    """With and without the extra `fast`."""

    def digests(number):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        done = subprocess.run(
            [sys.executable, "-c", CALLS, str(number), extra],
            cwd=ROOT,
            env={**os.environ, **dict.fromkeys(names, str(number))},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    one, two = digests(1), digests(2)
    assert len(one) == (10 if extra == "with" else 3)
    assert one == two
