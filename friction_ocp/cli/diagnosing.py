"""`diagnose`, and `design` for what to record."""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

from friction_ocp.cli.options import DONE, add_job, add_workers, checked, executor, output_folder, show

SECONDS_BETWEEN_LINES = 2.0


def add_commands(commands: Any) -> None:
    """Add `diagnose` and `design` to the parser."""
    add_job(commands, "diagnose", "where the gap lies, what causes it, how far it shrinks", _diagnose)
    add_workers(commands.choices["diagnose"])
    add_job(commands, "design", "a motion within limits that separates candidates or sharpens parameters", _design)
    job = commands.choices["design"]
    text = "D: least volume of the confidence region; A: least mean squared relative standard error"
    job.add_argument("--criterion", choices=["D", "A"], default="D", help=text)
    text = "candidates to tell apart, such as stribeck@motor; without them parameters are sharpened"
    job.add_argument("--between", nargs="+", default=[], metavar="EFFECT@PLACE", help=text)


def _diagnose(options: argparse.Namespace) -> int:
    from friction_ocp.diagnosis.diagnose import diagnose
    from friction_ocp.diagnosis_folder import save_diagnosis
    from friction_ocp.report.diagnosis_words import diagnosis_summary
    from friction_ocp.statistics.execution import Execution

    folder, problem = output_folder(options), checked(options, search=True)
    try:
        with executor(options).kept(diagnose) as kept:
            save_diagnosis(diagnose(problem, _Lines(), Execution(kept, folder)), folder, kept)
    except KeyboardInterrupt:
        print(f"diagnose: what has ended is in {folder / 'tasks'}; the same command goes on", file=sys.stderr)
        raise
    show(options, folder, diagnosis_summary)
    return DONE


def _design(options: argparse.Namespace) -> int:
    from friction_ocp.design_folder import save_design
    from friction_ocp.excitation.design import design
    from friction_ocp.report.design_words import design_summary

    folder, between = output_folder(options), [_pair(text) for text in options.between]
    save_design(design(checked(options, search=True), options.criterion, between, _Lines()), folder)
    show(options, folder, design_summary)
    return DONE


def _pair(text: str) -> tuple[str, str]:
    effect, _, place = text.partition("@")
    return effect, place


class _Lines:
    """Tells what is being done in plain lines on standard error."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._shown = -SECONDS_BETWEEN_LINES

    def __call__(self, what: str, share: float) -> None:
        elapsed = time.monotonic() - self._began
        if elapsed - self._shown >= SECONDS_BETWEEN_LINES:
            self._shown = elapsed
            print(f"{what}, {share:.0%} of it, {elapsed:.0f} s gone", file=sys.stderr)
