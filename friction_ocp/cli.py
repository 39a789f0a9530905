"""The command line: the only module that prints."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from friction_ocp.errors import Finding, FrictionOcpError

if TYPE_CHECKING:
    from friction_ocp.estimation.problem import Problem

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
        print(f"{options.command}: interrupted before there was a result", file=sys.stderr)
        return INTERRUPTED


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
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
    return options.out or Path("results") / f"{options.problem.stem}-{options.command}"


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
    from friction_ocp.result_document import simulation_document
    from friction_ocp.save import save

    result = simulate(_checked(options))
    folder = save(result, _folder(options))
    _show(options, simulation_document(result), folder)
    return DONE


def _identify(options: argparse.Namespace) -> int:
    from friction_ocp.estimation.estimate import Interrupted, identify
    from friction_ocp.progress_bar import progress_bar
    from friction_ocp.result_document import estimate_document
    from friction_ocp.save import save

    problem = _checked(options)
    status = DONE
    try:
        with progress_bar() as progress:
            estimate = identify(problem, progress)
    except Interrupted as stopped:
        estimate, status = stopped.estimate, INTERRUPTED
    folder = save(estimate, _folder(options))
    _show(options, estimate_document(estimate), folder)
    if status == DONE and not estimate.converged:
        print(f"identify: {estimate.message}", file=sys.stderr)
        return NOT_CONVERGED
    return status


def _show(options: argparse.Namespace, document: dict[str, Any], folder: Path) -> None:
    if options.json:
        print(json.dumps(document, indent=1))
        return
    from friction_ocp.report.text import summary

    print(summary(document))
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
