"""`diagnose`."""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import Any

from friction_ocp.cli.options import DONE, add_job, add_workers, checked, executor, output_folder

SECONDS_BETWEEN_LINES = 2.0


def add_commands(commands: Any) -> None:
    """Add `diagnose` to the parser."""
    add_job(commands, "diagnose", "where the gap lies, what causes it, how far it shrinks", _diagnose)
    add_workers(commands.choices["diagnose"])


def _diagnose(options: argparse.Namespace) -> int:
    from friction_ocp.diagnosis.diagnose import diagnose
    from friction_ocp.diagnosis_folder import save_diagnosis
    from friction_ocp.report.diagnosis_words import diagnosis_summary
    from friction_ocp.statistics.execution import Execution

    folder, problem = output_folder(options), checked(options)
    try:
        diagnosis = diagnose(problem, _Lines(), Execution(executor(options), folder))
    except KeyboardInterrupt:
        print(f"diagnose: what has ended is in {folder / 'tasks'}; the same command goes on", file=sys.stderr)
        raise
    save_diagnosis(diagnosis, folder)
    text = (folder / "result.json").read_text(encoding="utf-8")
    if options.json:
        print(text)
    else:
        print(diagnosis_summary(json.loads(text)))
        print(f"Report: {folder / 'report.html'}")
    return DONE


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
