"""The fit that a statistic starts from: made once, then read from the output folder."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.estimate import Estimate, conclude
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.horizon import judged_alike
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.progress import Progress, silent
from friction_ocp.execution.task import Json, Outcome, Task
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.optimum import Optimum
from friction_ocp.statistics.resolve import resolve
from friction_ocp.statistics.workshop import Workshop


@dataclass(frozen=True)
class Answer:
    """An identification, and the workshop that goes on from its optimum."""

    workshop: Workshop
    estimate: Estimate


def answer(problem: Problem, execution: Execution) -> Answer:
    """Fit a problem in this process, or read its fit from the output folder."""
    blank, task = Workshop(problem), Task("fit", fit_guess)
    outcome = execution.ledger.find(task, blank.fingerprint)
    if outcome is None or outcome.value is None:
        began = time.perf_counter()
        value = fit_guess(blank, execution.progress)
        outcome = Outcome(task.key, value, seconds=time.perf_counter() - began)
        execution.ledger.keep(task, blank.fingerprint, outcome)
    return concluded(blank, outcome)


def concluded(blank: Workshop, outcome: Outcome) -> Answer:
    """Return the estimate that belongs to the optimum in an outcome."""
    workshop = blank.at(Optimum.read(outcome.value))
    return Answer(workshop, conclude(workshop.model, workshop.fitted, 0.0, outcome.seconds))


def fit_guess(workshop: Workshop, progress: Progress = silent) -> Json:
    """Fit a problem from its guesses and return the optimum as a document."""
    return _optimum(workshop.model, progress).document()


def fit_start(workshop: Workshop, start: Sequence[float]) -> Json:
    """Fit a problem from other values than its guesses; priors and bounds stay."""
    model = judged_alike(workshop.model)
    return _optimum(replace(model, space=model.space.moved(np.array(start, dtype=np.float64)))).document()


def align(workshop: Workshop, content: Json) -> Json:
    """Solve again from the end of another fit, with the integrator steps and torque noise of the optimum at hand."""
    other, model = Optimum.read(content), workshop.model
    program = workshop.fitted.program
    start = program.point_along(other.fitted(model).program, other.solution.point)
    end = resolve(model, program, start)
    iterations = end.iterations + other.solution.iterations
    return replace(Optimum.of(model, workshop.fitted), solution=replace(end, iterations=iterations)).document()


def _optimum(model: Model, progress: Progress = silent) -> Optimum:
    """Fit, then solve once more from the end: profiles and refits measure their gains from there."""
    model, fitted = settled(model, progress)
    found = Optimum.of(model, fitted)
    again = resolve(model, fitted.program, found.solution.point)
    if not again.objective < found.solution.objective:
        return found
    return replace(found, solution=replace(again, iterations=again.iterations + found.solution.iterations))
