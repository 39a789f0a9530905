"""`rerun`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from friction_ocp.cli.options import DONE, WRONG_INPUT, add_workers, executor, output_folder

_SHOWN = 20


def add_commands(commands: Any) -> None:
    """Add `rerun` to the parser."""
    repeating = commands.add_parser("rerun", help="make a result again; say whether the numbers agree")
    repeating.add_argument("result", type=Path, help="result.json, or the folder that holds it")
    repeating.add_argument("--problem", type=Path, help="where the problem file lies now, if it was moved")
    repeating.add_argument("--out", type=Path, help="output folder; default results/<folder of the result>-rerun")
    text = "relative; default 1e-3; a parameter may differ by 1 %% of its standard error all the same"
    repeating.add_argument("--tolerance", type=float, default=1e-3, metavar="SHARE", help=text)
    repeating.add_argument("--json", action="store_true", help="rerun.json on standard output")
    add_workers(repeating)
    repeating.set_defaults(run=_rerun)


def _rerun(options: argparse.Namespace) -> int:
    from friction_ocp.progress_bar import progress_bar, task_bar
    from friction_ocp.repetition import rerun
    from friction_ocp.statistics.execution import Execution

    result: Path = options.result
    named = (result if result.is_dir() else result.parent).resolve().name
    folder = output_folder(options, named)
    with progress_bar() as progress, task_bar() as watch:
        execution = Execution(executor(options), folder, progress, watch)
        found = rerun(result, folder, execution, options.tolerance, options.problem)
    if options.json:
        print((folder / "rerun.json").read_text(encoding="utf-8"))
        return DONE if found.agrees else WRONG_INPUT
    for text in found.changed:
        print(f"changed: {text}")
    for item in found.differences[:_SHOWN]:
        print(f"{item.where}: was {item.before}, is {item.after}", file=sys.stderr)
    if len(found.differences) > _SHOWN:
        print(f"and {len(found.differences) - _SHOWN} more, in {folder / 'rerun.json'}", file=sys.stderr)
    told = "all agree" if found.agrees else f"{len(found.differences)} differ"
    print(f"{found.compared} numbers and words compared: {told}")
    return DONE if found.agrees else WRONG_INPUT
