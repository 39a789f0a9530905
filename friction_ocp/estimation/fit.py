"""A fit from start to end: predictions, nested model, candidates, free run or relaxed segments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, Watch, solve_gauss_newton
from friction_ocp.estimation.horizon import fits_free_run, horizon, is_held
from friction_ocp.estimation.losses import Absolute, AbstractLoss, Squares
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases, Progress, silent
from friction_ocp.estimation.release import released
from friction_ocp.estimation.stages import (
    ROUNDINGS,
    WIDTHS,
    free_run,
    loss_of_round,
    mean_error,
    predictions,
    relaxed,
    rounds_of,
)
from friction_ocp.simulation.grid import FloatArray

COARSE = Tolerances(decrease=1e-4, progress=1e-3, max_iterations=25)
FINE = Tolerances()
EXPECTED_PHASES = 16
GROWTH = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)
"""Windows of a free run over its horizon, one after another, for a drive that drifts."""
RELEASED_WIDTHS = (0.0025, 0.001, 0.0)
"""Smoothing of the sign for the released model: far below any Stribeck speed that matters."""
FOLLOWED = 3
"""Distinct ends of the relaxed fit that are continued on free runs."""
SAME = 1e-6
AT_NOISE = 1.5
"""Mean square error over the noise floor up to which a fit needs no rivals."""
HOPS = (0.005, 0.02, 0.05, 0.005, 0.02, 0.05)
"""Restarts around the best end of a loss with kinks: by what share the quadratic model calls them worse."""
FINALISTS = 5
"""Starts that are followed to the end."""


@dataclass(frozen=True)
class Fitted:
    """The solution and the program that it solves: exact friction, the loss asked for."""

    solution: Solution
    program: Program


def fit(model: Model, progress: Progress = silent) -> Fitted:
    """Fit the parameters of a problem from its guesses.

    A drive that something holds is fitted on its free run at once. One that drifts is fitted on free runs over growing
    windows, where free runs are asked for: from short predictions and, unless that ends at the noise and the friction
    has no part that is hard to start, from the best ends of a fit on relaxed segments.
    """
    phases = Phases(progress, EXPECTED_PHASES * model.problem.estimation.starts)
    models = [replace(model, space=model.space.moved(start)) for start in start_points(model)]
    return min((_fit_once(item, phases) for item in models), key=lambda fitted: fitted.solution.objective)


def start_points(model: Model) -> list[FloatArray]:
    """Return the guess and, for more than one start, random points within a factor sqrt(10) of it (seeded)."""
    options, space = model.problem.estimation, model.space
    rng = np.random.default_rng(options.seed)
    points = [space.guess]
    for _ in range(options.starts - 1):
        factor = 10.0 ** rng.uniform(-0.5, 0.5, space.guess.size)
        shift = rng.uniform(-1.0, 1.0, space.guess.size) * space.scale
        points.append(space.clip(np.where(space.guess != 0, space.guess * factor, shift)))
    return points


def _fit_once(model: Model, phases: Phases) -> Fitted:
    span = horizon(model)
    held = is_held(model.problem.drive)
    stated = bool(model.problem.estimation.process_noise)
    first = Plan(windowed(span), WIDTHS, True) if held and fits_free_run(model) else Plan(joined, WIDTHS[1:], stated)
    if held or not fits_free_run(model):
        return _hop(model, _staged(model, first, phases)[0], phases)
    direct = _grow(model, _prediction(model, phases), _longest(model, span), phases)
    if _is_noise(direct) and nested_space(model.problem, model.space) is model.space:
        return direct
    ends = _distinct(_staged(model, first, phases))[:FOLLOWED]
    grown = [direct, *(_grow(model, fitted, _longest(model, span), phases) for fitted in ends)]
    return min(grown, key=lambda fitted: fitted.solution.objective)


def _grow(model: Model, fitted: Fitted, horizon_s: float, phases: Phases) -> Fitted:
    """Continue a relaxed fit on free runs over growing windows."""
    for share in GROWTH:
        program = windowed(horizon_s * share)(model, 0.0, fitted.program.loss)
        watch = phases.begin(f"free run over {share:.0%} of the horizon")
        start = program.point_along(fitted.program, fitted.solution.point)
        solution = final_solver(model)(program, start, _limits(model), watch)
        fitted = Fitted(replace(solution, iterations=solution.iterations + fitted.solution.iterations), program)
    return fitted


def _distinct(ends: Sequence[Fitted]) -> list[Fitted]:
    """Drop ends that coincide with a better one: their objectives agree to SAME, relative."""
    kept: list[Fitted] = []
    for end in ends:
        if all(end.solution.objective > (1.0 + SAME) * other.solution.objective for other in kept):
            kept.append(end)
    return kept


@dataclass(frozen=True)
class Plan:
    """Which program is solved with which smoothing widths, one after another."""

    builder: Builder
    widths: tuple[float, ...]
    conclusive: bool
    """Whether small residuals prove the parameters right: gaps of an assumed size between segments hide errors."""


Builder = Callable[[Model, float, AbstractLoss], Program]
Solve = Callable[[Program, Point, Tolerances, Watch], Solution]


def joined(model: Model, width: float, loss: AbstractLoss) -> Program:
    """Return the program of relaxed segments."""
    return relaxed(model, model.train, width, loss)


def windowed(span: float | None) -> Builder:
    """Return what makes the program of free runs over windows of `span` s; None is the whole recording."""
    return lambda model, width, loss: free_run(model, model.train, width, loss, span)


def program_builder(model: Model) -> Builder:
    """Return what makes the program that a fit ends with."""
    return windowed(horizon(model)) if fits_free_run(model) else joined


def _longest(model: Model, span: float | None) -> float:
    if span is not None:
        return span
    return max(float(item.grid.time[-1] - item.grid.time[0]) for item in model.train)


def _staged(model: Model, plan: Plan, phases: Phases) -> list[Fitted]:
    """Fit from the starts at hand; where none ends at the noise floor and there is a simpler model, fit that first.

    Return the ends, best first. The full model then starts from several releases of what the simpler one leaves out.
    """
    simple = nested_space(model.problem, model.space)
    plain = _plain_starts(model, phases)
    if simple is model.space:
        return _rounds(model, plan, plain, "fit", phases)
    exact = replace(plan, widths=RELEASED_WIDTHS)
    if plan.conclusive and model.problem.estimation.loss == "squares":
        direct = _rounds(model, exact, plain[1:], "direct fit", phases)
        if _at_noise(direct[0].program, direct[0].solution):
            return direct
    inner = replace(model, space=simple)
    nested = _rounds(inner, plan, _plain_starts(inner, phases), "simpler friction", phases)
    return _rounds(model, exact, released(model, simple, nested[0].solution.point.theta), "fit", phases)


def _plain_starts(model: Model, phases: Phases) -> list[FloatArray]:
    return [model.space.guess, _predicted(model, phases)]


def final_solver(model: Model) -> Solve:
    """Return what solves the programs of a fit: the structured solver, or Ipopt where the problem asks for it."""
    if model.problem.estimation.solver == "gauss_newton":
        return solve_gauss_newton
    from friction_ocp.estimation.ipopt import solve_ipopt

    return solve_ipopt


def _predicted(model: Model, phases: Phases) -> FloatArray:
    return _prediction(model, phases).solution.point.theta


def _prediction(model: Model, phases: Phases) -> Fitted:
    """Fit what best predicts the smoothed motion over short times."""
    program = predictions(model, model.train, WIDTHS[0])
    start = Point(model.space.guess, program.suggested_nodes(model.space.guess))
    return Fitted(solve_gauss_newton(program, start, COARSE, phases.begin("short predictions")), program)


def _rounds(model: Model, plan: Plan, starts: Sequence[FloatArray], name: str, phases: Phases) -> list[Fitted]:
    """Sharpen width and loss round by round; after each the worse half of the starts drops out, down to a few.

    Return the ends, best first; the iterations of all are booked on each.
    """
    program = plan.builder(model, plan.widths[0], Squares())
    points = [Point(theta, program.suggested_nodes(theta)) for theta in starts]
    points.sort(key=lambda point: mean_error(program, point))
    rounds = rounds_of(model, len(plan.widths))
    iterations, ends = 0, list[Solution]()
    for k in range(rounds):
        program = plan.builder(model, plan.widths[min(k, len(plan.widths) - 1)], Squares())
        program = replace(program, loss=loss_of_round(model, program, points[0], k))
        watch = phases.begin(f"{name}, round {k + 1} of {rounds}")
        last = k == rounds - 1
        ends = _race(program, points, _limits(model) if last else COARSE, watch, final_solver(model))
        if plan.conclusive and _at_noise(program, ends[0]):
            ends = ends[:1]
        points = [end.point for end in ends[: max(FINALISTS, (len(ends) + 1) // 2)]]
        iterations += sum(end.iterations for end in ends)
    return [Fitted(replace(end, iterations=iterations), program) for end in ends]


def _hop(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave local minima of a loss with kinks: restart from points that the quadratic model calls slightly worse."""
    program, best, iterations = fitted.program, fitted.solution, fitted.solution.iterations
    if not isinstance(program.loss, Absolute):
        return fitted
    rng = np.random.default_rng(model.problem.estimation.seed)
    size = mean_error(program, best.point)
    softer = [replace(program, loss=Absolute(rounding * size)) for rounding in ROUNDINGS[2:-1]]
    for k, hop in enumerate(HOPS):
        watch = phases.begin(f"hop {k + 1} of {len(HOPS)}")
        reduced = reduce_system(program.linearise(best.point), 1e-6)
        step = _on_ellipsoid(reduced.hessian, 2.0 * hop * best.objective, rng)
        theta = model.space.clip(best.point.theta + step)
        nodes = tuple(old + move for old, move in zip(best.point.nodes, reduced.node_steps(step), strict=True))
        point = Point(theta, nodes)
        for stage in softer:
            point = solve_gauss_newton(stage, point, COARSE, watch).point
        end = solve_gauss_newton(program, point, _limits(model), watch)
        iterations += end.iterations
        best = min(best, end, key=lambda solution: solution.objective)
    return Fitted(replace(best, iterations=iterations), program)


def _on_ellipsoid(hessian: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """Return a random d with d'Hd = size."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    values, vectors = np.linalg.eigh(hessian * np.outer(scale, scale))
    direction = rng.standard_normal(scale.size)
    direction *= np.sqrt(size) / np.linalg.norm(direction)
    return scale * (vectors @ (direction / np.sqrt(np.maximum(values, 1e-8))))


def _limits(model: Model) -> Tolerances:
    return replace(FINE, max_iterations=model.problem.estimation.max_iterations)


def _race(program: Program, points: Sequence[Point], limits: Tolerances, watch: Watch, solve: Solve) -> list[Solution]:
    """Solve from every point and return the ends, best first."""
    return sorted((solve(program, point, limits, watch) for point in points), key=lambda end: end.objective)


def _at_noise(program: Program, end: Solution) -> bool:
    """Whether a fit by squares ends so close to the noise that no rival could be much better."""
    if not isinstance(program.loss, Squares):
        return False
    samples = sum(int(np.isfinite(item.measured).sum()) for item in program.experiments)
    return end.objective <= 0.5 * samples * AT_NOISE


def _is_noise(fitted: Fitted) -> bool:
    """Whether a fit by squares leaves no more than noise of the stated size would, within five deviations."""
    if not isinstance(fitted.program.loss, Squares):
        return False
    samples = sum(int(np.isfinite(item.measured).sum()) for item in fitted.program.experiments)
    return fitted.solution.objective <= 0.5 * samples * (1.0 + 5.0 * float(np.sqrt(2.0 / samples)))
