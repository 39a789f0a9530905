"""The lines of formats, fleets and clusters, measured; `acceptance.py users` prints them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping

import fleet
import jobs
import kills
from checks import Check
from servo import ROOT, script_check


def batches(line: str, quick: bool) -> Check:
    """Simulate and fit 200 nights, or fewer."""
    return fleet.check(line, 4, 8) if quick else fleet.check(line)


def clusters(line: str, _quick: bool) -> Check:
    """Run the tests with a real scheduler, and time a diagnosis in one process and in two."""
    sooner = jobs.check(line)
    test = "tests/execution/test_cluster.py"
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", test]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    last = (run.stdout.strip().splitlines() or ["no output"])[-1]
    return Check(line, f"{last}\n{sooner.measured}", bool(run.returncode == 0 and sooner.passed))


def kills_and_resumes(line: str, quick: bool) -> Check:
    """Kill and resume, fewer times where it has to be quick."""
    return kills.check(line, 4) if quick else kills.check(line)


def fuzzing(line: str, quick: bool) -> Check:
    """Spoil files of every format; hostile ones are tests."""
    spoilt = script_check(line, "fuzz.py", *(("--inputs", "50") if quick else ()))
    hostile = tests_check(line, "tests/hostile")
    return Check(line, f"{spoilt.measured}\n{hostile.measured}", bool(spoilt.passed and hostile.passed))


def formats(line: str, quick: bool) -> Check:
    """Run the tests of all formats, and the servo's fit in MuJoCo."""
    priced = script_check(line, "formats.py", *(("--quick",) if quick else ()))
    tested = tests_check(line, "tests/recording/test_foreign.py", "tests/recording/test_csv.py", "tests/targets")
    return Check(line, f"{priced.measured}\n{tested.measured}", bool(priced.passed and tested.passed))


def looked_at(line: str, quick: bool) -> Check:
    """Open every page kind in a browser at both widths, and a long one; run the tutorials with their pictures.

    Whether a person looked is not measured; what can be is: nothing overflows, is nameless, complains or stays empty.
    """
    pages = tests_check(line, "tests/browser")
    long = script_check(line, "pages.py")
    chosen = ("-m", "not slow") if quick else ()
    tutorials = tests_check(line, "tests/problems/test_tutorials.py", *chosen)
    told = (pages, long, tutorials)
    return Check(line, "\n".join(check.measured for check in told), all(check.passed for check in told))


def tests_check(line: str, *paths: str) -> Check:
    """Run tests of the repository; what is measured is pytest's last line."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-o", "addopts=", "-q", *paths]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    return Check(line, f"{' '.join(paths)}: {run.stdout.strip().splitlines()[-1]}", run.returncode == 0)


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "formats": formats,
    "cluster": clusters,
    "kills": kills_and_resumes,
    "fuzzing": fuzzing,
    "batch": batches,
    "looked_at": looked_at,
}
"""By ID in done_when.yaml."""
