"""Rounds of a fit: programs one after another, from several starts, each sharper than the one before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from friction_ocp.estimation.curriculum import enter_in_turn, introduced
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, Watch, solve_gauss_newton
from friction_ocp.estimation.horizon import fits_free_run, horizon
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_ends import NEGLIGIBLE
from friction_ocp.estimation.parameter_space import nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.release import released
from friction_ocp.estimation.rough_bowl import stepped_out, unstuck
from friction_ocp.estimation.stages import (
    WIDTHS,
    free_run,
    is_noise,
    loss_of_round,
    mean_error,
    predictions,
    relaxed,
    roundings_of,
)
from friction_ocp.estimation.unknown_noise import telling_program
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import AbstractLoss, Squares

COARSE = Tolerances(decrease=1e-4, progress=1e-3, max_iterations=25)
FINE = Tolerances(inner=4)
SMOOTH = replace(FINE, max_iterations=30)
"""Where the sign is smoothed and the exact one is to begin: to the end, unless that is far."""
LEAST = 1e-3
"""Decrease of the objective by three steps that is next to nothing, were the residuals noise."""
RELEASED_WIDTHS = (0.0025, 0.001, 0.0)
"""Smoothing of the sign for the released model: far below any Stribeck speed that matters."""
DESCENT = (0.1, 0.03, 0.01, 0.003, 0.001)
"""The same for segments that noise joins, which are short and stick or slide one by one: in steps through which the
parameters follow, down to where smoothing hardly moves them."""
ROUGH = 2.0
"""Objective over that of noise up to which an end may stand on the rough bottom of the bowl: beyond it a model misses
something, and no step of a standard error tells."""
FINALISTS = 5
"""Starts that are followed to the end."""
SAME = 0.01
"""Relative difference of parameters up to which ends of equal objective are one."""

Builder = Callable[[Model, float, AbstractLoss], Program]
Solve = Callable[[Program, Point, Tolerances, Watch], Solution]


@dataclass(frozen=True)
class Fitted:
    """The solution and the program that it solves: exact friction, the loss asked for."""

    solution: Solution
    program: Program


@dataclass(frozen=True)
class Plan:
    """Which program is solved with which smoothing widths, one after another."""

    builder: Builder
    widths: tuple[float, ...]
    conclusive: bool
    """Whether small residuals prove the parameters right: gaps of an assumed size between segments hide errors."""


def joined(model: Model, width: float, loss: AbstractLoss) -> Program:
    """Return the program of relaxed segments."""
    return relaxed(model, model.train, width, loss)


def windowed(span: float | None) -> Builder:
    """Return what makes the program of free runs over windows of `span` s; None is the whole recording."""
    return lambda model, width, loss: free_run(model, model.train, width, loss, span)


def program_builder(model: Model) -> Builder:
    """Return what makes the program that a fit ends with."""
    if model.tells_noise:
        return telling_program
    return windowed(horizon(model)) if fits_free_run(model) else joined


def final_solver(model: Model) -> Solve:
    """Return what solves the programs of a fit: the structured solver, or Ipopt where the problem asks for it."""
    if model.problem.estimation.solver == "gauss_newton":
        return solve_gauss_newton
    from friction_ocp.estimation.ipopt import solve_ipopt

    return solve_ipopt


def limits(model: Model) -> Tolerances:
    """Return when the last fit of a model stops.

    A fit that ends at the noise has an objective of half a unit a sample, and a standard error is half a unit of it:
    over many samples a small share of the objective still is a long way. Segments so short that noise joins them stick
    and slide one by one: less than their roughness is no way.
    """
    least = NEGLIGIBLE if model.noisy_inputs else LEAST
    samples = max(sum(int(np.isfinite(item.measured).sum()) for item in model.train), 1)
    return replace(FINE, idle=least / (0.5 * samples), max_iterations=model.problem.estimation.max_iterations)


def staged(model: Model, plan: Plan, phases: Phases) -> list[Fitted]:
    """Fit from the starts at hand; where none ends at the noise floor and there is a simpler model, fit that first.

    Return the ends, best first. The full model then starts from several releases of what the simpler one leaves out.
    """
    conclusive = plan.conclusive and model.problem.estimation.loss == "squares"
    ends: list[Fitted] = []
    if conclusive and plan.builder is joined and enter_in_turn(model):
        ends.append(Fitted(*introduced(model, phases)))
        if is_sound(model, ends[0]):
            return ends
    if conclusive:
        ends += _rounds(model, replace(plan, widths=plan.widths[-1:]), [model.space.guess], "direct fit", phases)
        if is_sound(model, ends[-1]):
            return ends
    simple = nested_space(model.problem, model.space)
    if simple is model.space and conclusive and model.joins_noise:
        return _best_first([*ends, _descended(model, phases)])
    if simple is model.space:
        return _best_first([*ends, *_rounds(model, plan, _plain_starts(model, phases), "fit", phases)])
    exact = replace(plan, widths=RELEASED_WIDTHS)
    if conclusive:
        ends += _rounds(model, exact, [_predicted(model, phases)], "direct fit", phases)
        if is_sound(model, ends[-1]):
            return ends[-1:]
    inner = replace(model, space=simple)
    nested = _rounds(inner, plan, _plain_starts(inner, phases), "simpler friction", phases)
    starts = released(model, simple, nested[0].solution.point.theta)
    return _best_first([*ends, *_rounds(model, exact, starts, "fit", phases)])


def _descended(model: Model, phases: Phases) -> Fitted:
    """Fit segments that noise joins, from plain starts with the sign sharpened little by little.

    The exact sign takes the parameters over of the smoothing that fits best, with fresh nodes, and with those that the
    last has led to. Noise keeps a slow shaft from knowing its sign, and on average its friction is a smoothed one; what
    is sharper makes every sample stick or slide, and parameters stay wherever that has left them.
    """
    points: list[Point] = []
    led: list[Solution] = []
    iterations, rounds = 0, len(DESCENT) + 1
    for number, width in enumerate(DESCENT):
        program = joined(model, width, Squares())
        points = points or [suggested_point(program, theta) for theta in _plain_starts(model, phases)]
        watch = phases.begin(f"descent, round {number + 1} of {rounds}")
        ends = race(program, points, SMOOTH, watch, solve_gauss_newton)
        points = [ends[0].point]
        led.append(ends[0])
        iterations += sum(end.iterations for end in ends)
    program = joined(model, 0.0, Squares())
    watch = phases.begin(f"descent, round {rounds} of {rounds}")
    best = min(led, key=lambda end: end.objective)
    points.append(suggested_point(program, best.point.theta))
    exact = [unstuck(model, program, point, watch) for point in points]
    end = race(program, exact, limits(model), watch, final_solver(model))[0]
    if end.objective < ROUGH * 0.5 * program.samples:
        watch = phases.begin("descent, steps of standard errors")
        point, iterations = stepped_out(model, program, end.point, watch), iterations + end.iterations
        end = final_solver(model)(program, point, limits(model), watch)
    return Fitted(replace(end, iterations=end.iterations + iterations), program)


def _best_first(ends: Sequence[Fitted]) -> list[Fitted]:
    """Return the ends of one program in the order of their objectives."""
    return sorted(ends, key=lambda fitted: fitted.solution.objective)


def _plain_starts(model: Model, phases: Phases) -> list[FloatArray]:
    return [model.space.guess, _predicted(model, phases)]


def _predicted(model: Model, phases: Phases) -> FloatArray:
    return prediction(model, phases).solution.point.theta


def prediction(model: Model, phases: Phases) -> Fitted:
    """Fit what best predicts the smoothed motion over short times."""
    program = predictions(model, model.train, WIDTHS[0])
    start = suggested_point(program, model.space.guess)
    return Fitted(solve_gauss_newton(program, start, COARSE, phases.begin("short predictions")), program)


def _rounds(model: Model, plan: Plan, starts: Sequence[FloatArray], name: str, phases: Phases) -> list[Fitted]:
    """Sharpen width and loss round by round; after each the worse half of the starts drops out, down to a few.

    Return the ends, best first; the iterations of all are booked on each.
    """
    program = plan.builder(model, plan.widths[0], Squares())
    points = [suggested_point(program, theta) for theta in starts]
    points.sort(key=lambda point: mean_error(program, point))
    rounds = max(len(plan.widths), len(roundings_of(model)))
    iterations, ends = 0, list[Solution]()
    for k in range(rounds):
        program = plan.builder(model, plan.widths[min(k, len(plan.widths) - 1)], Squares())
        program = replace(program, loss=loss_of_round(model, program, points[0], k))
        watch = phases.begin(f"{name}, round {k + 1} of {rounds}")
        last = k == rounds - 1
        enough = partial(is_sound_end, model, program) if plan.conclusive else _never
        ends = race(program, points, limits(model) if last else COARSE, watch, final_solver(model), enough)
        if plan.conclusive and is_noise(program, ends[0]):
            ends = ends[:1]
        if not last:
            ends = _distinct(ends)
        points = [end.point for end in ends[: max(FINALISTS, (len(ends) + 1) // 2)]]
        iterations += sum(end.iterations for end in ends)
    return [Fitted(replace(end, iterations=iterations), program) for end in ends]


def _distinct(ends: Sequence[Solution]) -> list[Solution]:
    """Return the ends, best first, without those that are a better one as far as a coarse solution tells."""
    kept: list[Solution] = []
    for end in ends:
        if not any(is_same_end(end, other) for other in kept):
            kept.append(end)
    return kept


def is_same_end(end: Solution, other: Solution) -> bool:
    """Whether two ends of one program are the same as far as a coarse solution tells."""
    near = abs(end.objective - other.objective) <= COARSE.decrease * min(end.objective, other.objective)
    return near and bool(np.allclose(end.point.theta, other.point.theta, rtol=SAME, atol=0.0))


def _never(end: Solution) -> bool:
    return False


def race(
    program: Program,
    points: Sequence[Point],
    limits: Tolerances,
    watch: Watch,
    solve: Solve,
    enough: Callable[[Solution], bool] = _never,
) -> list[Solution]:
    """Solve from every point, up to the first whose end is `enough`, and return the ends, best first."""
    ends: list[Solution] = []
    for point in points:
        ends.append(solve(program, point, limits, watch))
        if enough(ends[-1]):
            break
    return sorted(ends, key=lambda end: end.objective)


def is_sound(model: Model, fitted: Fitted) -> bool:
    """Whether residuals are noise and no parameter ran into a bound."""
    return is_sound_end(model, fitted.program, fitted.solution)


def is_sound_end(model: Model, program: Program, end: Solution) -> bool:
    """Whether the residuals of an end are noise and no parameter ran into a bound."""
    return not np.any(model.space.at_bounds(end.point.theta)) and is_noise(program, end)
