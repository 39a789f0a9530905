"""Fits from many starts: whether they agree, and on what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import Estimate
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.starts import start_points
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.execution.task import Outcome, Task
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.answer import align, concluded, fit_start
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.optimum import Optimum
from friction_ocp.statistics.workshop import Workshop

SAME_OBJECTIVE = 1e-3
"""Relative difference of the objective up to which two ends may be the same optimum."""
SAME_PARAMETER = 0.1
"""Difference of every parameter, in standard errors, up to which they are."""
DEFAULT_STARTS = 20


@dataclass(frozen=True)
class StartEnd:
    """One start and where its fit ended."""

    start: FloatArray
    """(parameters,)."""
    optimum: Optimum | None
    """None where the fit failed."""
    error: str
    seconds: float
    cluster: int | None
    """Index of the optimum that it reached, the best being 0; None where it reached none."""


@dataclass(frozen=True)
class MultiStart:
    """All ends, in the order of the starts, and the estimate at the best of them."""

    estimate: Estimate
    ends: tuple[StartEnd, ...]

    @property
    def clusters(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the ends that share an optimum, the best optimum first."""
        count = 1 + max(end.cluster for end in self.ends if end.cluster is not None)
        return tuple(tuple(k for k, end in enumerate(self.ends) if end.cluster == j) for j in range(count))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Starts that failed, and ends as good as the best at other parameters."""
        texts: list[str] = []
        errors = [end.error for end in self.ends if end.error]
        if errors:
            texts.append(f"{len(errors)} of {len(self.ends)} starts failed, the first with: {errors[0]}.")
        lowest = min(_objective(end.optimum) for end in self.ends)
        near = [
            end for end in self.ends if end.cluster and _objective(end.optimum) - lowest <= SAME_OBJECTIVE * abs(lowest)
        ]
        if near:
            texts.append(
                f"{len(near)} of {len(self.ends)} starts end within {100 * SAME_OBJECTIVE:g} % of the best objective "
                "at other parameters: the recordings hardly tell these apart, or the fits stopped early. See profile."
            )
        return tuple(texts)


@with_one_thread
def multistart(problem: Problem, starts: int | None = None, execution: Execution = Execution()) -> MultiStart:
    """Fit a problem from its guess and from other starts within a factor sqrt(10).

    `starts` counts the guess in; None takes `estimation.starts` where that is more than one, else 20. Raises
    FrictionOcpError where every start failed.
    """
    count = starts or (problem.estimation.starts if problem.estimation.starts > 1 else DEFAULT_STARTS)
    single = replace(problem, estimation=replace(problem.estimation, starts=1))
    workshop = Workshop(single)
    points = start_points(workshop.model.space, count, problem.estimation.seed)
    tasks = [Task(f"start-{k:03d}", fit_start, (point.tolist(),)) for k, point in enumerate(points)]
    outcomes = _aligned(list(execution.run("starts", tasks, workshop).values()), workshop, execution)
    finished = [outcome for outcome in outcomes if outcome.value is not None and outcome.value["objective"] is not None]
    if not finished:
        what = f"every start failed, the first with: {outcomes[0].error or 'the simulation breaks down'}"
        raise FrictionOcpError(Finding("multistart", what, remedy="run identify, or check, for the reason"))
    ends = [_end(point, outcome) for point, outcome in zip(points, outcomes, strict=True)]
    best = min(finished, key=lambda outcome: _objective(Optimum.read(outcome.value)))
    estimate = concluded(workshop, best).estimate
    estimate = replace(estimate, problem=problem, solver=replace(estimate.solver, starts=count))
    clusters = _clusters([end.optimum for end in ends], _tolerance(estimate))
    joined = tuple(replace(end, cluster=cluster) for end, cluster in zip(ends, clusters, strict=True))
    return MultiStart(estimate, joined)


def _aligned(outcomes: list[Outcome], workshop: Workshop, execution: Execution) -> list[Outcome]:
    """Return all ends with the integrator steps and torque noise of the best: else objectives do not compare."""
    ends = [Optimum.read(outcome.value) if outcome.value else None for outcome in outcomes]
    found = [end for end in ends if end is not None and np.isfinite(end.solution.objective)]
    if not found:
        return outcomes
    best = min(found, key=_objective)
    odd = [k for k, end in enumerate(ends) if np.isfinite(_objective(end)) and not _alike(end, best)]
    tasks = [Task(f"aligned-{k:03d}", align, (outcomes[k].value,)) for k in odd]
    if not tasks:
        return outcomes
    again = execution.run("the same steps", tasks, workshop.at(best)).values()
    for k, outcome in zip(odd, again, strict=True):
        outcomes[k] = replace(outcome, seconds=outcome.seconds + outcomes[k].seconds)
    return outcomes


def _alike(end: Optimum | None, best: Optimum) -> bool:
    return end is not None and (end.max_step, end.noise_levels, end.moves) == (
        best.max_step,
        best.noise_levels,
        best.moves,
    )


def _end(start: FloatArray, outcome: Outcome) -> StartEnd:
    optimum = None if outcome.value is None else Optimum.read(outcome.value)
    return StartEnd(start, optimum, outcome.error, outcome.seconds, None)


def _objective(optimum: Optimum | None) -> float:
    return np.inf if optimum is None else optimum.solution.objective


def _tolerance(estimate: Estimate) -> FloatArray:
    """Return (parameters,) how far ends of the same optimum may lie apart; at a bound there is no standard error."""
    values = np.array([item.value for item in estimate.parameters])
    known = np.isfinite(estimate.uncertainty.std_error)
    size = np.where(values != 0, np.abs(values), [abs(item.guess) for item in estimate.parameters])
    return np.where(known, SAME_PARAMETER * estimate.uncertainty.std_error, SAME_OBJECTIVE * size)


def _clusters(ends: Sequence[Optimum | None], tolerance: FloatArray) -> list[int | None]:
    """Return for every end its cluster: it joins the first whose best end it agrees with, else it begins one."""
    leaders: list[Optimum] = []
    clusters: list[int | None] = [None] * len(ends)
    for k in sorted(range(len(ends)), key=lambda k: _objective(ends[k])):
        end = ends[k]
        if end is None or not np.isfinite(end.solution.objective):
            continue
        same = [j for j, leader in enumerate(leaders) if _agree(end, leader, tolerance)]
        clusters[k] = same[0] if same else len(leaders)
        if not same:
            leaders.append(end)
    return clusters


def _agree(end: Optimum, leader: Optimum, tolerance: FloatArray) -> bool:
    excess = end.solution.objective - leader.solution.objective
    apart = np.abs(end.solution.point.theta - leader.solution.point.theta)
    return excess <= SAME_OBJECTIVE * abs(leader.solution.objective) and bool(np.all(apart <= tolerance))
