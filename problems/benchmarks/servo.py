"""The lines of the servo job, measured; `acceptance.py servo` prints them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import emps
import random_starts
import xl330_cmaes
from checks import Check

ROOT = Path(__file__).parents[2]
BENCHMARKS = Path(__file__).parent
FENCE = re.compile(r"^```(?:sh|bash|shell|console)\s*\n(.*?)^```", re.MULTILINE | re.DOTALL)
TEST_RESULT = re.compile(r"^(\S+::.+?) (PASSED|FAILED|ERROR|SKIPPED)", re.MULTILINE)

BAD_INPUTS: Mapping[str, str] = {
    "unknown keys": "[unknown key]",
    "unknown laws": "[unknown law]",
    "wrong unit": "[wrong unit]",
    "bounds the wrong way round": "[bounds the wrong way round]",
    "guess outside its bounds": "[guess outside]",
    "tau_s below tau_c": "[tau_s below tau_c]",
    "missing file": "[missing file]",
    "not HDF5": "test_file_that_is_not_hdf5_is_refused",
    "channel that is not there": "[missing channel]",
    "time backwards": "[time backwards]",
    "all NaN": "[all NaN]",
    "clipped": "[clipped ",
    "opposite sign": "[opposite sign]",
    "inputs that never move": "[still input]",
    "all findings at once": "test_all_findings_come_at_once",
    "nothing half-written": "writes_nothing",
}
"""Kind of bad input, and what the names of its tests contain."""


def all_of(line: str, checks: Sequence[Check]) -> Check:
    """Return one check that holds where all of its parts do, but for those that only a person can judge."""
    measured = "\n".join(f"{check.verdict}: {check.line}: {check.measured}" for check in checks)
    return Check(line, measured, all(check.by_eye or bool(check.passed) for check in checks))


def script_check(line: str, script: str, *arguments: str) -> Check:
    """Run a benchmark script; it passes where its exit status is 0. Not measured where there is none."""
    path = BENCHMARKS / script
    if not path.is_file():
        return Check(line, f"{path.relative_to(ROOT)} does not exist", None)
    run = subprocess.run([sys.executable, path, *arguments], cwd=ROOT, capture_output=True, text=True)
    return Check(line, run.stdout.strip() or _last_line(run.stderr), run.returncode == 0)


def compare_with_cmaes(line: str, quick: bool) -> Check:
    """Training, validation and time of `identify` against CMA-ES on every model."""
    models, evaluations = (xl330_cmaes.MODELS[:1], 500) if quick else (xl330_cmaes.MODELS, 10_000)
    return all_of(line, xl330_cmaes.compare(models, evaluations))


def start_at_random(line: str, quick: bool) -> Check:
    """How many of 20 random starts reach the same optimum, for every model."""
    problems, starts = (random_starts.DEFAULT[:1], 4) if quick else (random_starts.DEFAULT, 20)
    return all_of(line, random_starts.compare(problems, starts, seed=1))


def fit_emps(line: str, quick: bool) -> Check:
    """Parameters, force error and closed-loop error of EMPS."""
    source = emps.source_folder()
    if source is None:
        return Check(line, f"skipped: {emps.VARIABLE} names no folder with the data", None)
    del quick
    return all_of(line, emps.run_benchmark(source, ["force_driven", "closed_loop"]))


def calibrate(line: str, quick: bool) -> Check:
    """Chi-square and coverage of the standard errors."""
    draws, coverage = ("2", "10") if quick else ("20", "500")
    return script_check(line, "calibration.py", "--draws", draws, "--coverage", coverage)


def leave_sensors_out(line: str, quick: bool) -> Check:
    """Standard errors of the two-mass axis with each kind of trace left out."""
    del quick
    return script_check(line, "sensor_ablation.py")


def bad_inputs_have_tests(line: str, quick: bool) -> Check:
    """Which kinds of bad input have tests that pass."""
    del quick
    tests = ["tests/problem_file/test_bad_input.py", "tests/test_cli.py"]
    command = [sys.executable, "-m", "pytest", "-v", "-o", "addopts=", "-p", "no:cacheprovider", *tests]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    results = TEST_RESULT.findall(run.stdout)
    checks = [bad_input_check(kind, part, results) for kind, part in BAD_INPUTS.items()]
    total = sum(result == "PASSED" for _, result in results)
    checks.append(Check("all tests of bad input", f"{total} of {len(results)} pass", 0 < total == len(results)))
    return all_of(line, checks)


def bad_input_check(kind: str, part: str, results: Sequence[tuple[str, str]]) -> Check:
    """Return whether at least one test of a kind exists and all of them pass."""
    own = [result for name, result in results if part in name]
    passed = sum(result == "PASSED" for result in own)
    return Check(kind, f"{passed} of {len(own)} tests pass", 0 < passed == len(own))


def look(line: str, quick: bool) -> Check:
    """Return a line that only a person can judge."""
    del quick
    return Check(line, "friction-ocp identify writes report.html and figures/", None, by_eye=True)


def readme_commands(text: str) -> list[str]:
    """Return the lines of the shell blocks of a README, without prompts and comments."""
    rows = [row.strip().removeprefix("$ ") for block in FENCE.findall(text) for row in block.splitlines()]
    return [row for row in rows if row and not row.startswith("#")]


def follow_readme(line: str, quick: bool) -> Check:
    """Clone, make an environment, and run the first two commands of the README as they stand."""
    if quick:
        return Check(line, "left out by --quick", None)
    with tempfile.TemporaryDirectory() as scratch:
        clone, venv = Path(scratch) / "clone", Path(scratch) / "venv"
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
        subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
        commands = readme_commands((clone / "README.md").read_text(encoding="utf-8"))[:2]
        if len(commands) < 2:
            return Check(line, f"the README has {len(commands)} commands in its shell blocks", False)
        return all_of(line, [run_command(command, clone, venv) for command in commands] + [report_check(clone)])


def run_command(command: str, folder: Path, venv: Path) -> Check:
    """Run a command in an activated environment."""
    outside = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME")}
    activated = {"PATH": f"{venv / 'bin'}{os.pathsep}{os.environ['PATH']}", "VIRTUAL_ENV": str(venv)}
    began = time.perf_counter()
    run = subprocess.run(["bash", "-c", command], cwd=folder, env=outside | activated, capture_output=True, text=True)
    said = _last_line(run.stdout) or _last_line(run.stderr)
    text = f"exit status {run.returncode} after {time.perf_counter() - began:.0f} s; {said}"
    return Check(command, text, run.returncode == 0)


def report_check(clone: Path) -> Check:
    """Return whether the first command left a report of the servo."""
    reports = [str(path.relative_to(clone)) for path in clone.glob("**/report.html")]
    return Check("the report", ", ".join(reports) or "there is none", bool(reports))


def _last_line(text: str) -> str:
    return next((row for row in reversed(text.splitlines()) if row.strip()), "")


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {
    "fresh_clone": follow_readme,
    "xl330_cmaes": compare_with_cmaes,
    "random_starts": start_at_random,
    "emps": fit_emps,
    "calibration": calibrate,
    "sensor_ablation": leave_sensors_out,
    "bad_input": bad_inputs_have_tests,
    "looked_at": look,
}
"""By ID of the line: (line, quick) -> check."""
