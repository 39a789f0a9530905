"""What commands share: exit statuses, options, the output folder, what is shown at the end."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from friction_ocp.errors import Finding, FrictionOcpError

if TYPE_CHECKING:
    from friction_ocp.estimation.problem import Problem
    from friction_ocp.execution.executor import AbstractExecutor

DONE, WRONG_INPUT, NOT_CONVERGED, INTERRUPTED = 0, 1, 2, 3


class Parser(argparse.ArgumentParser):
    """A parser whose complaints end as wrong input does; argparse's own status 2 means something else here."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(WRONG_INPUT, f"{self.prog}: {message}\n")


def add_job(commands: Any, name: str, text: str, run: Callable[[argparse.Namespace], int]) -> None:
    """Add a command that works on one problem and leaves an output folder."""
    job = commands.add_parser(name, help=text)
    job.add_argument("problem", type=Path)
    job.add_argument("--out", type=Path, help="output folder; default results/<problem stem>-" + name)
    job.add_argument("--json", action="store_true", help="result.json on standard output")
    job.set_defaults(run=run)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add the options that say where tasks run."""
    text = "processes on this machine; default 2; 1 is this one"
    parser.add_argument("--workers", "--jobs", type=positive, default=2, metavar="N", help=text)
    parser.add_argument("--scheduler", default="", metavar="ADDRESS", help="Dask scheduler whose workers do the work")


def executor(options: argparse.Namespace) -> AbstractExecutor:
    """Return where tasks run."""
    from friction_ocp.execution.executor import executor_of

    return executor_of(options.workers, options.scheduler)


def positive(text: str) -> int:
    """Return a count that an option states."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} is not positive")
    return number


def output_folder(options: argparse.Namespace, of: str = "") -> Path:
    """Return the output folder, named after `of` or the problem; refuse one that cannot be written before any work."""
    folder: Path = options.out or Path("results") / f"{of or options.problem.stem}-{options.command}"
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise FrictionOcpError(Finding(str(folder), f"{there} is a file", "a folder, made where there is none"))
    if not os.access(there, os.W_OK):
        raise FrictionOcpError(Finding(str(folder), f"{there} may not be written to", remedy="give another --out"))
    return folder


def refuse_overwriting(out: Path, sources: Iterable[Path]) -> None:
    """Refuse to write over a file from which a command reads, or that belongs to what it reads."""
    if out.exists() and any(source.exists() and out.samefile(source) for source in sources):
        what = "--out is a file that this command reads, or a part of the result that it reads, and would be lost"
        raise FrictionOcpError(Finding(str(out), what, remedy="give another --out"))


def checked(options: argparse.Namespace, search: bool = False) -> Problem:
    """Load a problem; refuse errors, show warnings; `search` where more than a fit is asked for."""
    from friction_ocp.problem_file.check import check_before_fit, check_before_search
    from friction_ocp.problem_file.load import load_problem

    problem = load_problem(options.problem)
    findings = (check_before_search if search else check_before_fit)(problem)
    errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        raise FrictionOcpError(errors)
    for finding in findings:
        print(f"warning: {finding}", file=sys.stderr)
    return problem


def show(options: argparse.Namespace, folder: Path, summary: Callable[[Any], str]) -> None:
    """Print the result in an output folder: as it is, or in the few lines that `summary` makes of it."""
    text = (folder / "result.json").read_text(encoding="utf-8")
    if options.json:
        print(text)
        return
    print(summary(json.loads(text)))
    print(f"Report: {folder / 'report.html'}")
