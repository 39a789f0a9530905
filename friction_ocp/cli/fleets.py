"""`batch`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from friction_ocp.cli.options import DONE, NOT_CONVERGED, add_workers, executor, output_folder, show


def add_commands(commands: Any) -> None:
    """Add `batch` to the parser."""
    fitting = commands.add_parser("batch", help="one problem fitted to many recordings; what drifts, what stands out")
    fitting.add_argument("problem", type=Path)
    fitting.add_argument("recordings", type=Path, nargs="*", metavar="recording", help="files, or folders of them")
    fitting.add_argument("--out", type=Path, help="output folder with the store; default results/<problem stem>-batch")
    fitting.add_argument("--json", action="store_true", help="result.json on standard output")
    text = "attribute that names the machine of a recording; default machine, else the folder"
    fitting.add_argument("--machine", default="", metavar="ATTRIBUTE", help=text)
    text = "attribute with the time of a recording; default started, else the order of names"
    fitting.add_argument("--started", default="", metavar="ATTRIBUTE", help=text)
    text = "probability of any flag in a fleet in which nothing changes; default 0.05"
    fitting.add_argument("--false-alarms", type=float, default=0.05, metavar="RATE", help=text)
    add_workers(fitting)
    fitting.set_defaults(run=_batch)


def _batch(options: argparse.Namespace) -> int:
    from friction_ocp.fleet.batch import batch
    from friction_ocp.fleet_folder import save_fleet
    from friction_ocp.problem_file.load import load_problem
    from friction_ocp.progress_bar import task_bar
    from friction_ocp.report.fleet_words import fleet_summary

    folder = output_folder(options)
    problem = load_problem(options.problem)
    try:
        with task_bar() as watch:
            fleet = batch(
                problem,
                options.recordings,
                folder,
                machine=options.machine,
                started=options.started,
                false_alarms=options.false_alarms,
                executor=executor(options),
                watch=watch,
            )
    except KeyboardInterrupt:
        print(f"batch: fits that have ended are in {folder}; the same command goes on", file=sys.stderr)
        raise
    save_fleet(fleet, folder)
    show(options, folder, fleet_summary)
    return NOT_CONVERGED if any(fit.status == "not_converged" for fit in fleet.fits) else DONE
