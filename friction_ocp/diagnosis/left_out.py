"""Free runs of recordings that take no part in a fit: the fits without them, worked out beside one another."""

from __future__ import annotations

from dataclasses import dataclass

from friction_ocp.diagnosis.bench import Bench, value_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors, left_out_errors
from friction_ocp.diagnosis.held_out import fitted_without, folds
from friction_ocp.diagnosis.stand_ins import fall_short, helps
from friction_ocp.diagnosis.straying import strays_as_far
from friction_ocp.execution.plain import plain, restored
from friction_ocp.execution.run import run_tasks
from friction_ocp.execution.task import Json, Task
from friction_ocp.statistics.execution import Execution


@dataclass
class LeftOut:
    """What free runs of training recordings that take no part say of the current model of a bench.

    What was looked at for the model that was last asked about is kept.
    """

    run: Execution
    _runs: tuple[FittedModel, FreeErrors, FreeErrors] | None = None
    _stray: tuple[FittedModel, bool] | None = None

    def errors(self, bench: Bench) -> tuple[FreeErrors, FreeErrors]:
        """Return those of the base model and of the current one."""
        if self._runs is None or self._runs[0] is not bench.current:
            self._runs = (bench.current, *_before_and_after(bench, self.run))
        return self._runs[1:]

    def stray(self, bench: Bench, level: float) -> bool:
        """Whether noise alone sets free runs of the current model as far apart."""
        if self._stray is None or self._stray[0] is not bench.current:
            _, after = self.errors(bench)
            far = strays_as_far(bench.current, after, bench.problem.estimation.seed, level, held_out=False)
            self._stray = (bench.current, far)
        return self._stray[1]

    def fall_short(self, bench: Bench, level: float) -> bool:
        """Whether a notable part of their gap is left, and noise does not make it."""
        return fall_short(*self.errors(bench)) and not self.stray(bench, level)

    def helps(self, bench: Bench, level: float) -> bool:
        """Whether what the current model has and the base model lacks takes a part of the gap, and of theirs."""
        return helps(bench.base, bench.current, level, lambda: self.errors(bench), lambda: self.stray(bench, level))


def _before_and_after(bench: Bench, run: Execution) -> tuple[FreeErrors, FreeErrors]:
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
