"""A fleet on one page: recordings -> fits, those that are new -> series by machine -> what changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.executor import AbstractExecutor
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.execution.processes import Processes
from friction_ocp.execution.run import Watch, run_tasks, unwatched
from friction_ocp.fleet.fits import FleetLedger, fit_key, problem_fingerprint, task_of, template_of
from friction_ocp.fleet.judgement import Judgement, Series, judge
from friction_ocp.fleet.nights import days, find_recordings, nights_of
from friction_ocp.fleet.store import Store, StoredFit

STORE = "fits.sqlite"
FALSE_ALARMS = 0.05
"""Probability that a fleet in which nothing changes gets any flag."""


@dataclass(frozen=True)
class Fleet:
    """All fits of a problem that the store has, and what is to be told of them."""

    problem: Problem
    fits: tuple[StoredFit, ...]
    series: tuple[Series, ...]
    judgement: Judgement
    dated: bool
    """Whether every recording says when it was made."""
    added: int
    """Fits that this run made."""
    others: int
    """Fits in the store that belong to another problem or version and are left out."""
    machine: str
    """Attribute that names machines, as stated."""
    started: str
    """Attribute with times, as stated."""


@with_one_thread
def batch(
    problem: Problem,
    recordings: Sequence[Path],
    folder: Path,
    machine: str = "",
    started: str = "",
    false_alarms: float = FALSE_ALARMS,
    executor: AbstractExecutor = Processes(2),
    watch: Watch = unwatched,
) -> Fleet:
    """Fit a problem to each recording that the store in `folder` does not have, and judge all that it has.

    `machine` and `started` are attributes of the recordings. A fit that fails is kept with its reason and stops no
    other; one whose worker died is made by the next run. Raises FrictionOcpError with everything that is wrong with
    the recordings before any is fitted.
    """
    _refuse_rate(false_alarms)
    paths = find_recordings(recordings)
    nights = nights_of(problem, paths, machine, started)
    name, store = problem_fingerprint(problem), Store(folder / STORE)
    by_key = {fit_key(name, night): night for night in nights}
    known = {fit.key: fit for fit in store.fits(name)}
    store.place([(key, night.machine, night.path.as_posix(), night.started) for key, night in by_key.items()])
    ledger = FleetLedger(store, name, by_key, known)
    tasks = [task_of(night, key) for key, night in by_key.items()]
    outcomes = run_tasks("fits", tasks, template_of(problem), name, executor, ledger, watch)
    if lost := [outcome for outcome in outcomes.values() if outcome.lost]:
        what = f"{len(lost)} of {len(tasks)} fits were lost, the first because {lost[0].error}"
        raise FrictionOcpError(Finding("batch", what, remedy="run the same command again: it goes on from there"))
    fits = store.fits(name)
    dated = all(fit.started.strip() for fit in fits)
    if not dated:
        fits.sort(key=lambda fit: (fit.machine, fit.recording))
    series = series_of(fits, dated)
    return Fleet(
        problem=problem,
        fits=tuple(fits),
        series=series,
        judgement=judge(series, false_alarms, problem.estimation.seed),
        dated=dated,
        added=len(by_key.keys() - known.keys()),
        others=store.others(name),
        machine=machine,
        started=started,
    )


def _refuse_rate(rate: float) -> None:
    if not 0.0 < rate < 0.5:
        raise FrictionOcpError(Finding("--false-alarms", f"this is {rate:g}", "a probability between 0 and 0.5"))


def series_of(fits: Sequence[StoredFit], dated: bool) -> tuple[Series, ...]:
    """Return the series of every parameter of every machine.

    Fits that did not converge and estimates without a standard error are left out: nothing can be told by them.
    """
    found: dict[tuple[str, str], list[tuple[float, int, float, float, str]]] = {}
    nights: dict[str, int] = {}
    for number, fit in enumerate(fits):
        at = days(fit.started) if dated else float(nights.setdefault(fit.machine, 0))
        nights[fit.machine] = nights.get(fit.machine, 0) + 1
        for item in fit.parameters if fit.status == "converged" else ():
            if item.std_error is not None and item.std_error > 0:
                row = (at, number, item.value, item.std_error, item.unit)
                found.setdefault((fit.machine, item.name), []).append(row)
    return tuple(_series(key, sorted(rows)) for key, rows in found.items())


def _series(key: tuple[str, str], rows: Sequence[tuple[float, int, float, float, str]]) -> Series:
    time, numbers, value, std_error, units = zip(*rows, strict=True)
    return Series(*key, units[0], numbers, np.array(time), np.array(value), np.array(std_error))
