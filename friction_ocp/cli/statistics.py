"""`multistart`, `profile`, `bootstrap` and `compare`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from friction_ocp.cli.options import (
    DONE,
    NOT_CONVERGED,
    add_job,
    add_workers,
    checked,
    executor,
    output_folder,
    positive,
    show,
)
from friction_ocp.errors import Finding, FrictionOcpError

if TYPE_CHECKING:
    from friction_ocp.statistics.execution import Execution
    from friction_ocp.statistics_document import Statistic

Make = Callable[["Execution"], "Statistic"]


def add_commands(commands: Any) -> None:
    """Add the statistics of an identification to the parser."""
    add_job(commands, "multistart", "fit from many starts; say whether they agree", _multistart)
    add_job(commands, "profile", "profile likelihood of every fitted parameter", _profile)
    add_job(commands, "bootstrap", "scatter of the estimate over resampled residuals", _bootstrap)
    comparing = commands.add_parser("compare", help="models of the same recordings, or results, side by side")
    text = "problem files to fit, or results (result.json or its folder)"
    comparing.add_argument("problems", type=Path, nargs="+", metavar="problem", help=text)
    comparing.add_argument("--out", type=Path, help="output folder; default results/<first problem stem>-compare")
    comparing.add_argument("--json", action="store_true", help="result.json on standard output")
    comparing.set_defaults(run=_compare)
    parsers = commands.choices
    parsers["multistart"].add_argument("--starts", type=positive, help="starts, the guess among them; default 20")
    parsers["profile"].add_argument(
        "--parameter", action="append", default=[], help="profile this one only; repeatable"
    )
    parsers["bootstrap"].add_argument("--draws", type=positive, default=200, help="draws; default 200")
    comparing.add_argument(
        "--nested", action="append", default=[], metavar="SPECIAL:GENERAL", help="state that a model is a special case"
    )
    for name in ("multistart", "profile", "bootstrap", "compare"):
        add_workers(parsers[name])


def _multistart(options: argparse.Namespace) -> int:
    from friction_ocp.statistics.multistart import multistart

    problem = checked(options)
    return _work(options, lambda execution: multistart(problem, options.starts, execution))


def _profile(options: argparse.Namespace) -> int:
    from friction_ocp.statistics.profile import profile

    problem = checked(options)
    return _work(options, lambda execution: profile(problem, options.parameter, execution))


def _bootstrap(options: argparse.Namespace) -> int:
    from friction_ocp.statistics.bootstrap import bootstrap

    problem = checked(options)
    return _work(options, lambda execution: bootstrap(problem, options.draws, execution))


def _compare(options: argparse.Namespace) -> int:
    from friction_ocp.side_by_side import result_file
    from friction_ocp.statistics.compare import compare

    if any(result_file(path) for path in options.problems):
        return _compare_results(options)
    options.problem = options.problems[0]
    problems = [checked(argparse.Namespace(problem=path)) for path in options.problems]
    pairs = _pairs(options.nested)
    return _work(options, lambda execution: compare(problems, pairs, execution))


def _compare_results(options: argparse.Namespace) -> int:
    from friction_ocp.report.side_by_side_page import side_by_side_text
    from friction_ocp.side_by_side import read_results, save_side_by_side, side_by_side

    if len(options.problems) < 2:
        raise FrictionOcpError(Finding("compare", "1 result given", "two or more"))
    named: Path = options.problems[0]
    folder = output_folder(options, (named if named.is_dir() else named.parent).resolve().name)
    document = side_by_side(read_results(options.problems))
    save_side_by_side(document, folder)
    print((folder / "result.json").read_text(encoding="utf-8") if options.json else side_by_side_text(document))
    if not options.json:
        print(f"Report: {folder / 'report.html'}")
    return DONE


def _pairs(texts: Sequence[str]) -> list[tuple[str, str]]:
    pairs = [text.partition(":") for text in texts]
    wrong = [text for text, (_, colon, _) in zip(texts, pairs, strict=True) if not colon]
    if wrong:
        raise FrictionOcpError([Finding("--nested", f"'{text}' names one model", "SPECIAL:GENERAL") for text in wrong])
    return [(special, general) for special, _, general in pairs]


def _work(options: argparse.Namespace, make: Make) -> int:
    """Make a statistic, save and show it; an interrupt leaves what was finished in the output folder."""
    from friction_ocp.report.text import summary
    from friction_ocp.result_folder import save

    folder = output_folder(options)
    try:
        with _execution(folder, options) as execution:
            statistic = make(execution)
    except KeyboardInterrupt:
        if (folder / "tasks").exists():
            print(
                f"{options.command}: what has ended is in {folder / 'tasks'}; the same command goes on", file=sys.stderr
            )
        raise
    save(statistic, folder)
    show(options, folder, summary)
    return _status(options, statistic)


@contextmanager
def _execution(folder: Path, options: argparse.Namespace) -> Generator[Execution]:
    from friction_ocp.progress_bar import progress_bar, task_bar
    from friction_ocp.statistics.execution import Execution

    with progress_bar() as progress, task_bar() as watch:
        yield Execution(executor(options), folder, progress, watch)


def _status(options: argparse.Namespace, statistic: Statistic) -> int:
    from friction_ocp.statistics.compare import Comparison

    estimates = (
        [item.estimate for item in statistic.candidates] if isinstance(statistic, Comparison) else [statistic.estimate]
    )
    stuck = [estimate for estimate in estimates if not estimate.converged]
    for estimate in stuck:
        print(f"{options.command}: {estimate.message}", file=sys.stderr)
    return NOT_CONVERGED if stuck else DONE
