"""Progress of a fit on standard error: a live bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Generator
from contextlib import contextmanager

from friction_ocp.estimation.progress import Progress, Report
from friction_ocp.execution.run import Tally, Watch

SECONDS_BETWEEN_LINES = 2.0


@contextmanager
def progress_bar() -> Generator[Progress]:
    """Yield what `identify` calls after every step."""
    if sys.stderr.isatty():
        with _live_bar() as progress:
            yield progress
    else:
        yield _plain_lines()


@contextmanager
def _live_bar() -> Generator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description:<26}"),
        BarColumn(),
        TextColumn("iteration {task.fields[iteration]:>3}  objective {task.fields[objective]:.6g}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("preparing", total=1.0, iteration=0, objective=float("nan"))

        def update(report: Report) -> None:
            bar.update(
                task,
                completed=report.share,
                description=report.phase,
                iteration=report.iteration,
                objective=report.objective,
            )

        yield update


def _plain_lines() -> Progress:
    began, shown = time.monotonic(), [-SECONDS_BETWEEN_LINES]

    def update(report: Report) -> None:
        elapsed = time.monotonic() - began
        if elapsed - shown[0] < SECONDS_BETWEEN_LINES:
            return
        shown[0] = elapsed
        left = elapsed * (1.0 - report.share) / max(report.share, 1e-3)
        print(
            f"{report.phase}: iteration {report.iteration}, objective {report.objective:.6g}, "
            f"{elapsed:.0f} s gone, about {left:.0f} s left",
            file=sys.stderr,
        )

    return update


@contextmanager
def task_bar() -> Generator[Watch]:
    """Yield what hears of every task that ends: a bar on a terminal, lines at most every few seconds elsewhere."""
    if not sys.stderr.isatty():
        yield _task_lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("tasks", total=None, failed="")

        def update(tally: Tally) -> None:
            failed = f"{tally.failed} failed" if tally.failed else ""
            bar.update(task, completed=tally.done, total=tally.total, description=tally.what, failed=failed)

        yield update


def _task_lines() -> Watch:
    began, shown = time.monotonic(), [-SECONDS_BETWEEN_LINES]

    def update(tally: Tally) -> None:
        elapsed = time.monotonic() - began
        if elapsed - shown[0] < SECONDS_BETWEEN_LINES and tally.done < tally.total:
            return
        shown[0] = elapsed
        fresh = tally.done - tally.found
        left = f", about {elapsed * (tally.total - tally.done) / fresh:.0f} s left" if fresh else ""
        found = f", {tally.found} of them from an earlier run" if tally.found else ""
        failed = f", {tally.failed} failed" if tally.failed else ""
        print(
            f"{tally.what}: {tally.done} of {tally.total} done{found}{failed}, {elapsed:.0f} s gone{left}",
            file=sys.stderr,
        )

    return update
