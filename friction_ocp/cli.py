"""The command line: the only module that prints."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from friction_ocp.errors import Finding, FrictionOcpError

if TYPE_CHECKING:
    from friction_ocp.estimation.problem import Problem
    from friction_ocp.estimation.progress import Progress, Report

DONE, WRONG_INPUT, NOT_CONVERGED, INTERRUPTED = 0, 1, 2, 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        return options.run(options)
    except FrictionOcpError as error:
        for finding in error.findings:
            print(finding, file=sys.stderr)
        return WRONG_INPUT
    except KeyboardInterrupt:
        print(f"{options.command}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


class _Patience:
    """Lets the first interrupt wait for the end of a step; a second one stops at once.

    An exception raised while CasADi calls back into Python would be lost or come out as another one.
    """

    def __init__(self) -> None:
        self.asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, number: int, frame: object) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def watching(self, progress: Progress) -> Progress:
        """Return `progress` that stops the fit after a step if that was asked for."""

        def update(report: Report) -> None:
            progress(report)
            if self.asked:
                raise KeyboardInterrupt

        return update


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints end as wrong input does; argparse's own status 2 means something else here."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(WRONG_INPUT, f"{self.prog}: {message}\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="friction-ocp",
        description="Finds the friction in a drive from its own logs.",
        epilog="Exit status: 0 done, 1 the input is wrong, 2 the solver did not converge, 3 interrupted.",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    checking = commands.add_parser("check", help="all rules about file and recordings; solves nothing")
    checking.add_argument("problem", type=Path)
    checking.add_argument("--json", action="store_true", help="findings as JSON on standard output")
    checking.set_defaults(run=_check)
    _add_job(commands, "simulate", "free-running simulation with the guesses of a problem file", _simulate)
    _add_job(commands, "identify", "fit every parameter that has a guess", _identify)
    importing = commands.add_parser("import", help="turn a log into a recording")
    importing.add_argument("file", type=Path)
    importing.add_argument("--map", type=Path, help="YAML file that names columns and units")
    importing.add_argument("--out", type=Path, help="recording to write, .h5")
    importing.add_argument("--inspect", action="store_true", help="list what the file holds and stop")
    importing.set_defaults(run=_import)
    return parser


def _add_job(commands: Any, name: str, text: str, run: Callable[[argparse.Namespace], int]) -> None:
    job = commands.add_parser(name, help=text)
    job.add_argument("problem", type=Path)
    job.add_argument("--out", type=Path, help="output folder; default results/<problem stem>-" + name)
    job.add_argument("--json", action="store_true", help="result.json on standard output")
    job.set_defaults(run=run)


def _folder(options: argparse.Namespace) -> Path:
    """Return the output folder; refuse one that cannot be written before any work is done."""
    folder: Path = options.out or Path("results") / f"{options.problem.stem}-{options.command}"
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise FrictionOcpError(Finding(str(folder), f"{there} is a file", "a folder, made where there is none"))
    if not os.access(there, os.W_OK):
        raise FrictionOcpError(Finding(str(folder), f"{there} may not be written to", remedy="give another --out"))
    return folder


def _check(options: argparse.Namespace) -> int:
    from friction_ocp.problem_file.check import check
    from friction_ocp.problem_file.load import load_problem

    try:
        findings = check(load_problem(options.problem))
    except FrictionOcpError as error:
        findings = error.findings
    if options.json:
        keys = ("severity", "where", "what", "allowed", "remedy")
        print(json.dumps([{key: getattr(finding, key) for key in keys} for finding in findings], indent=1))
    else:
        for finding in findings:
            print(f"{finding.severity}: {finding}" if finding.severity == "warning" else finding)
        if not findings:
            print(f"{options.problem}: nothing found")
    return WRONG_INPUT if any(finding.severity == "error" for finding in findings) else DONE


def _checked(options: argparse.Namespace) -> Problem:
    """Load a problem; refuse errors, show warnings."""
    from friction_ocp.problem_file.check import check
    from friction_ocp.problem_file.load import load_problem

    problem = load_problem(options.problem)
    findings = check(problem)
    errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        raise FrictionOcpError(errors)
    for finding in findings:
        print(f"warning: {finding}", file=sys.stderr)
    return problem


def _simulate(options: argparse.Namespace) -> int:
    from friction_ocp.estimation.estimate import simulate
    from friction_ocp.result_folder import save

    folder = _folder(options)
    save(simulate(_checked(options)), folder)
    _show(options, folder)
    return DONE


def _identify(options: argparse.Namespace) -> int:
    from friction_ocp.estimation.estimate import Interrupted, identify
    from friction_ocp.progress_bar import progress_bar
    from friction_ocp.result_folder import save

    folder, problem, patience = _folder(options), _checked(options), _Patience()
    try:
        with progress_bar() as progress:
            estimate = identify(problem, patience.watching(progress))
    except Interrupted as stopped:
        estimate = stopped.estimate
    save(estimate, folder)
    _show(options, folder)
    if patience.asked:
        return INTERRUPTED
    if not estimate.converged:
        print(f"identify: {estimate.message}", file=sys.stderr)
        return NOT_CONVERGED
    return DONE


def _show(options: argparse.Namespace, folder: Path) -> None:
    text = (folder / "result.json").read_text(encoding="utf-8")
    if options.json:
        print(text)
        return
    from friction_ocp.report.text import summary

    print(summary(json.loads(text)))
    print(f"Report: {folder / 'report.html'}")


def _import(options: argparse.Namespace) -> int:
    from friction_ocp.recording.hdf5 import write_recording
    from friction_ocp.recording.import_recording import import_recording, inspect_file

    if options.inspect:
        print(inspect_file(options.file))
        return DONE
    missing = [name for name in ("map", "out") if getattr(options, name) is None]
    if missing:
        raise FrictionOcpError(
            [Finding("import", f"--{name} is missing", remedy="see friction-ocp import --help") for name in missing]
        )
    write_recording(import_recording(options.file, options.map), options.out)
    print(f"Recording: {options.out}")
    return DONE
