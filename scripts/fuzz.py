#!/usr/bin/env python3
"""Call random public functions with random meshes and parameters: each call must end finite, or with a typed error.

Meshes are valid, degenerate, non-manifold or open, with invalid values and in unusual containers; parameters are valid,
at the ends of their range, or of a wrong type. Some of the calls are on MeshSets, which must be unchanged after an
error. Calls run in another process: one that crashes or does not end is counted, and the next call gets a new process.
Every call is determined by the seed and its number.

python3 scripts/fuzz.py                          100 000 calls
python3 scripts/fuzz.py --calls 2000 --seed 7
python3 scripts/fuzz.py --seconds 60             for a minute
python3 scripts/fuzz.py --only 4711              repeat one call, with its traceback
"""

import argparse
import collections
import dataclasses
import itertools
import sys
import time
import traceback
import warnings
from collections.abc import Iterator

import bootstrap

if __name__ == "__main__":
    bootstrap.enter("test")

import numpy as np
from fuzz_calls import TYPED, Call, ChangedError, make_call

import meshlab_specsmooth as mss
from meshlab_specsmooth.isolation.worker import Worker, WorkerFailed, serve

TIMEOUT = 60.0  # seconds per call
# Fields that may be NaN: for open surfaces, single probes, given settings
MAY_BE_NAN = {"modes_error", "volume_change", "error", "standard_error", "risks", "considered"}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", metavar="N", type=int, default=100_000, help="number of calls (default: 100000)")
    parser.add_argument("--seconds", metavar="S", type=float, default=float("inf"), help="maximum time")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="(default: 0)")
    parser.add_argument("--only", metavar="N", type=int, help="number of a single call, which runs in this process")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.only is not None:
        call = make_call(given.seed, given.only)
        print(call.text)
        outcome = run_call(call, show=True)
        print(outcome)
        return int(is_failure(outcome))
    if given.worker:
        serve(lambda number: run_call(make_call(given.seed, number)))
        return 0
    start = time.perf_counter()
    counts: collections.Counter[str] = collections.Counter()
    for number, outcome in outcomes(given.seed, given.calls, start + given.seconds):
        counts[outcome] += 1
        if is_failure(outcome):
            print(
                f"{outcome}\n  {make_call(given.seed, number).text}\n  --seed {given.seed} --only {number}", flush=True
            )
    print(f"{counts.total()} calls in {time.perf_counter() - start:.0f} s, seed {given.seed}")
    for outcome, count in counts.most_common():
        print(f"{count:8}  {outcome}")
    failed = sum(count for outcome, count in counts.items() if is_failure(outcome))
    print(f"{failed} failures")
    return int(failed > 0)


def is_failure(outcome: str) -> bool:
    """Whether an outcome violates the rules."""
    return outcome.startswith("FAILURE")


def outcomes(seed: int, calls: int, until: float) -> Iterator[tuple[int, str]]:
    """Yield the number and the outcome of each call; the calls run in worker processes, which may crash."""
    with Worker([sys.executable, __file__, "--worker", "--seed", str(seed)]) as worker:
        for number in itertools.takewhile(lambda _: time.perf_counter() < until, range(calls)):
            try:
                outcome = worker.ask(number, TIMEOUT)
            except WorkerFailed as error:
                outcome = f"FAILURE: the process {error}"
            yield number, outcome


def run_call(call: Call, show: bool = False) -> str:
    """Run a call and describe its outcome, without line breaks and tabs."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", mss.SmoothingWarning)
        try:
            result = call.run()
        except ChangedError as error:
            return f"FAILURE: {error}"
        except TYPED as error:
            if show:
                print(error)
            return type(error).__name__ if str(error) and "\n" not in str(error) else "FAILURE: no one-line message"
        except Exception as error:
            if show:
                traceback.print_exc()
            return f"FAILURE: {type(error).__name__}: {' '.join(str(error).split())[:120]}"
    bad = not_finite(result)
    return f"FAILURE: not finite: {bad}" if bad else "finite"


def not_finite(result: object, name: str = "result") -> str:
    """Return the name of a field that is not finite, or an empty string."""
    short = name.rpartition(".")[2]
    if dataclasses.is_dataclass(result) and not isinstance(result, mss.Operators):
        parts = {f"{name}.{field.name}": getattr(result, field.name) for field in dataclasses.fields(result)}
        if isinstance(result, mss.Surface) or "that no face uses are not finite" in str(getattr(result, "warning", "")):
            parts.pop(f"{name}.vertices")  # unreferenced vertices stay as they are
    elif isinstance(result, dict):
        parts = {f"{name}.{key}": value for key, value in result.items()}
    elif isinstance(result, tuple | list):
        parts = {f"{name}[{i}]": value for i, value in enumerate(result)}
    else:
        if short.partition("[")[0] in MAY_BE_NAN:
            return ""
        if isinstance(result, float | np.ndarray) and np.asarray(result).dtype.kind == "f":
            # infinite for the constant mode
            wrong = np.isnan(result) if short == "wavelength" else ~np.isfinite(result)
            return name if np.any(wrong) else ""
        return ""
    if short.partition("[")[0] in MAY_BE_NAN:
        return ""
    return next(filter(None, (not_finite(value, key) for key, value in parts.items())), "")


if __name__ == "__main__":
    sys.exit(main())
