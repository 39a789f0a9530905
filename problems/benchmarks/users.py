"""The lines of formats, fleets and clusters, measured; `acceptance.py users` prints them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping

import fleet
import jobs
import kills
from checks import Check
from servo import ROOT


def batches(line: str, quick: bool) -> Check:
    """Simulate and fit 200 nights, or fewer."""
    return fleet.check(line, 4, 8) if quick else fleet.check(line)


def clusters(line: str, quick: bool) -> Check:
    """Run the tests with a real scheduler, and time a diagnosis in one process and in two."""
    sooner = jobs.check(line, 4.0 if quick else jobs.SECONDS)
    test = "tests/execution/test_cluster.py"
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", test]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    last = (run.stdout.strip().splitlines() or ["no output"])[-1]
    return Check(line, f"{last}\n{sooner.measured}", bool(run.returncode == 0 and sooner.passed))


def kills_and_resumes(line: str, quick: bool) -> Check:
    """Kill and resume, fewer times where it has to be quick."""
    return kills.check(line, 4) if quick else kills.check(line)


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "cluster": clusters,
    "kills": kills_and_resumes,
    "batch": batches,
}
"""By ID in done_when.yaml."""
