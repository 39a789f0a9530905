"""Free runs of recordings that take no part in a fit: the fits without them, worked out beside one another."""

from __future__ import annotations

from friction_ocp.diagnosis.bench import Bench, value_of
from friction_ocp.diagnosis.free_gap import FreeErrors, left_out_errors
from friction_ocp.diagnosis.held_out import fitted_without, folds
from friction_ocp.execution.plain import plain, restored
from friction_ocp.execution.run import run_tasks
from friction_ocp.execution.task import Json, Task
from friction_ocp.statistics.execution import Execution


def left_out_before_and_after(bench: Bench, run: Execution) -> tuple[FreeErrors, FreeErrors]:
    """Return free runs of recordings left out, of the base model of a bench and of its current one."""
    parts = range(len(folds(bench.base)))
    tasks = {
        (of_base, k): Task(f"left-out-{'base' if of_base else 'current'}-{k}", parameters_without, (of_base, k))
        for of_base in (True, False)
        for k in parts
    }
    fingerprint = bench.fingerprint
    outcomes = run_tasks("recordings left out", [*tasks.values()], bench, fingerprint, run.executor, run.ledger)
    before, after = (
        left_out_errors(fitted, [restored(value_of(outcomes[tasks[of_base, k].key])) for k in parts])
        for fitted, of_base in ((bench.base, True), (bench.current, False))
    )
    return before, after


def parameters_without(bench: Bench, of_base: bool, part: int) -> Json:
    """Return (parameters,) of the base model, or else the current one, fitted to all recordings but some."""
    fitted = bench.base if of_base else bench.current
    return plain(fitted_without(fitted, folds(fitted)[part]))
