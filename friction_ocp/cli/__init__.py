"""The command line: the only package that prints, one module a group of commands."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from importlib.metadata import version

from friction_ocp.cli import (
    checking,
    diagnosing,
    drafting,
    exporting,
    fitting,
    fleets,
    importing,
    repeating,
    statistics,
)
from friction_ocp.cli.options import DONE, INTERRUPTED, NOT_CONVERGED, WRONG_INPUT, Parser
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.execution.linear_algebra import LINEAR_ALGEBRA, with_one_thread
from friction_ocp.execution.processes import environment

__all__ = ["DONE", "INTERRUPTED", "NOT_CONVERGED", "WRONG_INPUT", "main"]


@with_one_thread
def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        with environment(LINEAR_ALGEBRA):
            return options.run(options)
    except FrictionOcpError as error:
        for finding in error.findings:
            print(finding, file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left to flush goes nowhere
        return DONE
    except OSError as error:
        print(Finding(str(error.filename or options.command), str(error.strerror or error)), file=sys.stderr)
        return WRONG_INPUT
    except (KeyboardInterrupt, EOFError):
        print(f"{options.command}: interrupted", file=sys.stderr)
        return INTERRUPTED


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _parser() -> Parser:
    parser = Parser(
        prog="friction-ocp",
        description="Finds the friction in a drive from its own logs.",
        epilog="Exit status: 0 done, 1 the input is wrong, 2 the solver did not converge, 3 interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"friction-ocp {version('friction-ocp')}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for group in (checking, fitting, diagnosing, statistics, fleets, repeating, importing, exporting, drafting):
        group.add_commands(commands)
    return parser
