"""A diagnosis in one process and in two: the same numbers, and how much sooner.

python problems/benchmarks/jobs.py [--seconds S]

The machine must have two processors to spare. The exit status is 1 where two processes are less than 1.6 times as fast,
or where any number differs.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "diagnosis"))

import diagnosis_cases
from checks import Check, tell_status

LEAST = 1.6
SECONDS = 20.0
"""Of each of the three recordings."""


def measure(seconds: float) -> tuple[float, float, bool]:
    """Return the time that a diagnosis takes in one process and in two, s, and whether the results are equal.

    Compiled models are left by a first run, so that no other has to make them.
    """
    diagnosis_cases.SECONDS = seconds
    with tempfile.TemporaryDirectory() as kept:
        problem = write_problem(Path(kept))
        diagnosed(problem, Path(kept) / "first", 2)
        one, alone = diagnosed(problem, Path(kept) / "one", 1)
        two, together = diagnosed(problem, Path(kept) / "two", 2)
    return one, two, alone == together


def write_problem(folder: Path) -> Path:
    """Write a drive that lacks Stribeck friction, all effects of the catalogue being candidates."""
    path = diagnosis_cases.write_case(folder, diagnosis_cases.axis(law="stribeck", tau_s=0.15, omega_s=6.0))
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    del document["diagnosis"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def diagnosed(problem: Path, out: Path, jobs: int) -> tuple[float, dict[str, Any]]:
    """Run `friction-ocp diagnose`; return its time, start and report included, and its numbers."""
    command = [sys.executable, "-m", "friction_ocp", "diagnose", str(problem), "--out", str(out), "--jobs", str(jobs)]
    began = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    elapsed = time.perf_counter() - began
    return elapsed, numbers(json.loads((out / "result.json").read_text(encoding="utf-8")))


def numbers(result: dict[str, Any]) -> dict[str, Any]:
    """Return a result without what differs between equal runs."""
    return {key: value for key, value in result.items() if key not in ("seconds", "provenance")}


def check(line: str, seconds: float = SECONDS) -> Check:
    """Measure how much faster two processes are."""
    one, two, equal = measure(seconds)
    text = f"{one:.1f} s in one process, {two:.1f} s in two: {one / two:.2f} times as fast; "
    text += "the same numbers" if equal else "NUMBERS DIFFER"
    return Check(line, text, equal and one >= LEAST * two)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print both times; 1 where two processes gain too little."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="length of each recording")
    options = parser.parse_args(arguments)
    return tell_status([check(f"two processes at least {LEAST} times as fast as one", options.seconds)])


if __name__ == "__main__":
    raise SystemExit(main())
