"""`simulate` and `identify`."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from friction_ocp.cli.options import DONE, INTERRUPTED, NOT_CONVERGED, add_job, checked, output_folder, show
from friction_ocp.cli.patience import Patience


def add_commands(commands: Any) -> None:
    """Add `simulate` and `identify` to the parser."""
    add_job(commands, "simulate", "free-running simulation with the guesses of a problem file", _simulate)
    add_job(commands, "identify", "fit every parameter that has a guess", _identify)


def _simulate(options: argparse.Namespace) -> int:
    from friction_ocp.estimation.estimate import simulate
    from friction_ocp.report.text import summary
    from friction_ocp.result_folder import save

    folder = output_folder(options)
    save(simulate(checked(options)), folder)
    show(options, folder, summary)
    return DONE


def _identify(options: argparse.Namespace) -> int:
    from friction_ocp.estimation.estimate import Interrupted, identify
    from friction_ocp.progress_bar import progress_bar
    from friction_ocp.report.text import summary
    from friction_ocp.result_folder import save

    folder, problem, patience = output_folder(options), checked(options), Patience()
    try:
        with progress_bar() as progress:
            estimate = identify(problem, patience.watching(progress))
    except Interrupted as stopped:
        estimate = stopped.estimate
    save(estimate, folder)
    show(options, folder, summary)
    if patience.asked:
        return INTERRUPTED
    if not estimate.converged:
        print(f"identify: {estimate.message}", file=sys.stderr)
        return NOT_CONVERGED
    return DONE
