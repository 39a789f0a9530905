"""A diagnosis in one process and in two: the same numbers, and how much sooner.

python problems/benchmarks/jobs.py [--case N]

The case is one of the blind suite's for development: three recordings for training, two for validation, the whole
catalogue. Every process computes with one thread; beside it stands one process with the threads that it takes by
itself. The machine must have two processors to spare. The exit status is 1 where two processes are less than
1.6 times as fast, or where any number differs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind.draw import make
from checks import Check, tell_status

LEAST = 1.6
SEED, CASE = 1, 12
ALONE = {"FRICTION_OCP_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


@dataclass(frozen=True)
class Times:
    """What a diagnosis takes, s, start and report included."""

    one: float
    """In one process with one thread."""
    threaded: float
    """In one process with as many threads as it takes."""
    two: float
    """In two processes with one thread each."""
    equal: bool
    """Whether all results are the same."""


def measure(index: int) -> Times:
    """Diagnose a case in all ways; compiled models are left by a first run, so that no other has to make them."""
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        problem = folder / "cases" / make(SEED, index, folder).name / "problem.yaml"
        diagnosed(problem, folder / "first", 2, {})
        runs = {"one": (1, ALONE), "threaded": (1, {}), "two": (2, ALONE)}
        found = {name: diagnosed(problem, folder / name, *how) for name, how in runs.items()}
    results = [result for _, result in found.values()]
    seconds = {name: elapsed for name, (elapsed, _) in found.items()}
    return Times(**seconds, equal=all(result == results[0] for result in results))


def diagnosed(problem: Path, out: Path, jobs: int, environment: Mapping[str, str]) -> tuple[float, dict[str, Any]]:
    """Run `friction-ocp diagnose`; return its time and its numbers."""
    command = [sys.executable, "-m", "friction_ocp", "diagnose", str(problem), "--out", str(out), "--jobs", str(jobs)]
    began, around = time.perf_counter(), {**os.environ, **environment}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=around)
    elapsed = time.perf_counter() - began
    return elapsed, numbers(json.loads((out / "result.json").read_text(encoding="utf-8")))


def numbers(result: dict[str, Any]) -> dict[str, Any]:
    """Return a result without what differs between equal runs."""
    return {key: value for key, value in result.items() if key not in ("seconds", "provenance")}


def check(line: str, index: int = CASE) -> Check:
    """Measure how much faster two processes are."""
    found = measure(index)
    gained = found.one / found.two
    text = f"{found.one:.1f} s in one process with one thread ({found.threaded:.1f} s with more), {found.two:.1f} s in "
    text += f"two: {gained:.2f} times as fast; {'the same numbers' if found.equal else 'NUMBERS DIFFER'}"
    return Check(line, text, found.equal and gained >= LEAST)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the times; 1 where two processes gain too little."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=int, default=CASE, help="number of the case")
    options = parser.parse_args(arguments)
    return tell_status([check(f"two processes at least {LEAST} times as fast as one", options.case)])


if __name__ == "__main__":
    raise SystemExit(main())
