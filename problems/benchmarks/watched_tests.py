"""Run tests and tell how each ended and which problem files it identified or simulated.

python problems/benchmarks/watched_tests.py REPORT [--quick] TEST ...

A TEST is a file, a folder, or a node ID with or without its parameters; one that is not there is no error, it is
missing from what is told. A problem file counts as run by a test where what `identify` or `simulate` got is what
`load_problem` made of it, unchanged: a problem whose recordings or numbers a test replaces does not count. `--quick`
leaves tests marked slow out.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import pytest

import friction_ocp.estimation.estimate as estimate_module
import friction_ocp.problem_file.load as load_module
from friction_ocp.estimation.problem import Problem

ROOT = Path(__file__).resolve().parents[2]
PROBLEMS = ROOT / "problems"
FOLDERS = ("lto", "aries", "two_mass", "xl330", "emps")
EXPECTED, LEFT_OUT = "failed as expected", "left out"
"""Outcome of a test that is known to fail, and of a slow one where it has to be quick."""


@dataclass
class Ran:
    """How a test ended, and what it ran."""

    outcome: str = "passed"
    seconds: float = 0.0
    files: list[str] = field(default_factory=list[str])
    """Problem files that it identified or simulated, below `problems`."""


def problem_files() -> list[str]:
    """Return all problem files of the folders, below `problems`."""
    found = (path for folder in FOLDERS for path in sorted((PROBLEMS / folder).glob("*.yaml")))
    return [path.relative_to(PROBLEMS).as_posix() for path in found]


def covers(test: str, node: str) -> bool:
    """Whether a node ID is that test, or one of its parameters, or lies in that file or folder."""
    return node == test or node.startswith((f"{test}[", f"{test}::", f"{test.rstrip('/')}/"))


class Watch:
    """Plugin that chooses tests and notes what becomes of them."""

    def __init__(self, wanted: Sequence[str], quick: bool) -> None:
        self.wanted, self.quick = wanted, quick
        self.ran: dict[str, Ran] = {}
        self.current = Ran()
        self._names = {(PROBLEMS / name).read_text(encoding="utf-8"): name for name in problem_files()}
        self._loaded: dict[int, Problem] = {}

    def watch(self) -> None:
        """Note what is loaded and run; to be called before any test is imported."""
        load = load_module.load_problem

        def load_problem(path: str | Path, text: str | None = None) -> Problem:
            problem = load(path, text)
            self._loaded[id(problem)] = problem
            return problem

        load_module.load_problem = load_problem
        for name in ("identify", "simulate"):
            setattr(estimate_module, name, self._noting(getattr(estimate_module, name)))

    def _noting(self, run: Callable[..., Any]) -> Callable[..., Any]:
        def noting(problem: Problem, *arguments: Any, **options: Any) -> Any:
            name = self._names.get(problem.text)
            if name is not None and id(problem) in self._loaded and name not in self.current.files:
                self.current.files.append(name)
            return run(problem, *arguments, **options)

        return noting

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Keep what was asked for, and note what is left out."""
        asked = [item for item in items if any(covers(test, item.nodeid) for test in self.wanted)]
        slow = [item for item in asked if self.quick and item.get_closest_marker("slow")]
        self.ran |= {item.nodeid: Ran(LEFT_OUT) for item in slow}
        kept = [item for item in asked if item.nodeid not in self.ran]
        config.hook.pytest_deselected(items=[item for item in items if item not in kept])
        items[:] = kept

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> None:
        """Attribute what follows to this test."""
        self.current = self.ran[item.nodeid] = Ran()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note how set-up, test and tear-down ended; one that does not pass decides."""
        ran = self.ran[report.nodeid]
        ran.seconds += report.duration
        if report.outcome != "passed":
            ran.outcome = EXPECTED if hasattr(report, "wasxfail") else report.outcome


def results_of(tests: Iterable[str], quick: bool) -> Mapping[str, Ran]:
    """Run tests in one process of their own; return what became of each by its node ID."""
    with tempfile.TemporaryDirectory() as scratch:
        report = Path(scratch) / "tests.json"
        command = [sys.executable, __file__, str(report), *(("--quick",) if quick else ()), *tests]
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if not report.is_file():
            raise RuntimeError(f"pytest ended before it ran a test:\n{run.stdout[-2000:]}{run.stderr[-2000:]}")
        return {node: Ran(**ran) for node, ran in json.loads(report.read_text(encoding="utf-8")).items()}


def main() -> int:
    """Run the tests asked for and write what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path)
    parser.add_argument("tests", nargs="+", metavar="TEST")
    parser.add_argument("--quick", action="store_true", help="leave slow tests out")
    asked = parser.parse_args()
    watch = Watch(asked.tests, asked.quick)
    watch.watch()
    paths = dict.fromkeys(test.partition("::")[0] for test in asked.tests)
    there = [path for path in paths if (ROOT / path).exists()]
    options = ["-q", "-o", "addopts=", "--strict-markers", "-p", "no:cacheprovider"]
    status = pytest.main([*options, *there], plugins=[watch]) if there else pytest.ExitCode.NO_TESTS_COLLECTED
    if status in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.NO_TESTS_COLLECTED):
        asked.report.write_text(json.dumps({node: asdict(ran) for node, ran in watch.ran.items()}), encoding="utf-8")
    return int(status)


if __name__ == "__main__":
    raise SystemExit(main())
