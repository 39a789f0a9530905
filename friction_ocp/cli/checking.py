"""`check`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from friction_ocp.cli.options import DONE, WRONG_INPUT
from friction_ocp.errors import FrictionOcpError


def add_commands(commands: Any) -> None:
    """Add `check` to the parser."""
    checking = commands.add_parser("check", help="all rules about file and recordings; solves nothing")
    checking.add_argument("problem", type=Path)
    checking.add_argument("--json", action="store_true", help="findings as JSON on standard output")
    checking.set_defaults(run=_check)


def _check(options: argparse.Namespace) -> int:
    from friction_ocp.problem_file.check import check
    from friction_ocp.problem_file.load import load_problem
    from friction_ocp.problem_file.summary import summary

    told = ""
    try:
        problem = load_problem(options.problem)
        findings, told = check(problem), summary(problem)
    except FrictionOcpError as error:
        findings = error.findings
    if options.json:
        keys = ("severity", "where", "what", "allowed", "remedy")
        print(json.dumps([{key: getattr(finding, key) for key in keys} for finding in findings], indent=1))
    else:
        for finding in findings:
            print(f"{finding.severity}: {finding}" if finding.severity == "warning" else finding)
        if not findings:
            print(f"{options.problem}: nothing is wrong with it; read: {told}")
    return WRONG_INPUT if any(finding.severity == "error" for finding in findings) else DONE
