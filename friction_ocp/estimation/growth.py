"""Free runs of a drive that nothing holds: over windows that grow, joined where the model allows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import ParameterSpace, nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.release import released
from friction_ocp.estimation.rounds import (
    COARSE,
    Fitted,
    Plan,
    final_solver,
    is_sound,
    limits,
    prediction,
    race,
    staged,
    windowed,
)
from friction_ocp.estimation.stages import is_noise

GROWTH = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)
"""Windows of a free run over its horizon, one after another, for a drive that drifts."""
SAMPLES_PER_STATE = 20
"""Samples of the shortest window for each state: its start then costs few of the degrees of freedom."""
JOINING = 0.999
"""Confidence at which windows may not be joined."""
RELEASED_AT = 0.25
"""Windows over the horizon, one of GROWTH, over which a nested model is fitted and the full one released."""
FOLLOWED = 3
"""Distinct ends of the relaxed fit that are continued on free runs."""
SAME = 1e-5
"""Difference of two objectives, relative, up to which two ends are one."""
HOPELESS = 10.0
"""Objective over the best one beyond which an end is not continued."""


def drifting(model: Model, plan: Plan, horizon_s: float, phases: Phases) -> Fitted:
    """Fit free runs of a drive that nothing holds: over growing windows, from the motion as it was measured.

    What a simpler friction does not have is released where that one, over windows long enough to tell, has ended. Only
    where both ways end above the noise do the best ends of relaxed segments compete.
    """
    direct = _grow(model, prediction(model, phases), horizon_s, GROWTH, phases)
    if direct.sound:
        return direct.end
    ends = [direct.end]
    simple = nested_space(model.problem, model.space)
    if simple is not model.space:
        ends += _released_windows(model, simple, horizon_s, phases)
    if not any(is_noise(end.program, end.solution) for end in ends):
        rivals = _distinct(staged(model, plan, phases))[:FOLLOWED]
        ends += [_grow(model, fitted, horizon_s, GROWTH, phases).end for fitted in rivals]
    return min(ends, key=lambda fitted: fitted.solution.objective)


def _released_windows(model: Model, simple: ParameterSpace, horizon_s: float, phases: Phases) -> list[Fitted]:
    """Return the best ends of the full model, released from its nested one over windows of RELEASED_AT."""
    inner = replace(model, space=simple)
    before = tuple(share for share in GROWTH if share <= RELEASED_AT)
    nested = _grow(inner, prediction(inner, phases), horizon_s, before, phases).end
    program = replace(nested.program, space=model.space)
    starts = released(model, simple, nested.solution.point.theta)
    watch = phases.begin("released friction")
    points = [Point(theta, nested.solution.point.nodes) for theta in starts]
    ends = [Fitted(end, program) for end in race(program, points, COARSE, watch, solve_gauss_newton)]
    after = tuple(share for share in GROWTH if share > RELEASED_AT)
    grown: list[Fitted] = []
    for end in _distinct(ends)[:FOLLOWED]:
        growth = _grow(model, end, horizon_s, after, phases)
        grown.append(growth.end)
        if growth.sound:
            break
    return grown


@dataclass(frozen=True)
class Growth:
    """A fit over growing windows."""

    end: Fitted
    sound: bool
    """Whether residuals are noise, joining the last windows cost no more than it does for a right model, and no
    parameter ran into a bound."""


def _grow(model: Model, fitted: Fitted, horizon_s: float, shares: tuple[float, ...], phases: Phases) -> Growth:
    """Continue a fit on free runs over growing windows, `shares` of the horizon.

    Windows too short to tell their own start states from the parameters are left out.
    """
    shortest = SAMPLES_PER_STATE * model.state_scale.size * _interval(model)
    before = fitted
    for share in [item for item in shares if horizon_s * item >= shortest or item == shares[-1]]:
        before = fitted
        program = windowed(horizon_s * share)(model, 0.0, fitted.program.loss)
        watch = phases.begin(f"free run over {share:.0%} of the horizon")
        start = _better_start(model, program, program.point_along(fitted.program, fitted.solution.point))
        solution = final_solver(model)(program, start, limits(model), watch)
        fitted = Fitted(replace(solution, iterations=solution.iterations + fitted.solution.iterations), program)
    return Growth(fitted, is_sound(model, fitted) and joined_at_no_cost(before, fitted))


def _better_start(model: Model, program: Program, point: Point) -> Point:
    """Return the point, or the guesses where these explain more: short predictions may end in nonsense."""
    guess = suggested_point(program, model.space.guess)
    return min(point, guess, key=program.objective)


def joined_at_no_cost(before: Fitted, after: Fitted) -> bool:
    """Likelihood ratio test of longer windows against the shorter ones, whose start states are free, at JOINING."""
    freed = sum(cut.count for cut in before.program.segments) - sum(cut.count for cut in after.program.segments)
    if freed <= 0:
        return False
    states = after.solution.point.nodes[0].shape[1]
    ratio = 2.0 * (after.solution.objective - before.solution.objective)
    allowed = float(_stats.chi2.ppf(JOINING, freed * states))  # pyright: ignore[reportUnknownMemberType]
    return ratio <= allowed


def _interval(model: Model) -> float:
    """Return the mean time between samples, s."""
    return float(np.mean([item.grid.time[-1] - item.grid.time[0] for item in model.train])) / float(
        np.mean([np.isfinite(item.measured).any(axis=1).sum() for item in model.train])
    )


def _distinct(ends: Sequence[Fitted]) -> list[Fitted]:
    """Return the ends, best first, without those that coincide with a better one and without hopeless ones."""
    kept: list[Fitted] = []
    for end in ends:
        if all(end.solution.objective > (1.0 + SAME) * other.solution.objective for other in kept):
            kept.append(end)
    return [end for end in kept if end.solution.objective <= HOPELESS * kept[0].solution.objective]
