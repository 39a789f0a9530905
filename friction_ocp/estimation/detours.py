"""Ways out of an end that exact friction or a loss with kinks makes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.around_kinks import smoothed
from friction_ocp.estimation.composite import solve_composite
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.growth import joined_at_no_cost
from friction_ocp.estimation.horizon import longest_recording
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rounds import COARSE, FINE, Fitted, final_solver, is_same_end, limits, windowed
from friction_ocp.estimation.stages import ROUNDINGS, is_noise, keeps_the_loss, mean_error
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute, Squares

DETOURS = (0.05, 0.01, 0.0025)
"""Smoothing of the sign over the typical speed on the way around a kink of exact friction."""
RESTARTS = 4
"""Most detours, one from each of the start states that were found."""
WINDOWS = 8
"""Windows of each free run on the way around an end that only a run over all of it has."""
HOPS = (0.005, 0.02, 0.05)
"""Restarts around the best end of a loss with kinks, in turn: by what share the quadratic model calls them worse."""
BETTER = 1e-6
"""Decrease, relative, that counts as something better."""


@dataclass(frozen=True)
class Persistence:
    """How long restarts are tried."""

    patience: int
    """Restarts in a row that find nothing better, after which an end stands."""
    most: int
    tolerances: Tolerances
    """How far an end is followed that may be no better."""


REWEIGHTED = Persistence(6, 6, FINE)
KEPT = Persistence(3, 24, Tolerances(decrease=1e-6, progress=1e-5))
"""Where the solver keeps the loss: restarts cost less, and fall into more of the shallow ends."""


def detour(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave an end that exact friction makes: through the same program with a smoothed sign, and back.

    And again from other start states where these, as they are measured, fit better: a bristle or a spring that begins
    on its other side bends a run for long, and leads the parameters astray.
    """
    for _ in range(RESTARTS):
        fitted = _around(model, fitted, phases)
        point = _restarted(fitted)
        if point is None:
            break
        watch = phases.begin("from the measured start")
        end = final_solver(model)(fitted.program, point, limits(model), watch)
        fitted = replace(fitted, solution=replace(end, iterations=end.iterations + fitted.solution.iterations))
    return rejoined(model, fitted, phases)


def _restarted(fitted: Fitted) -> Point | None:
    """Return the parameters with the measured start states solved for again; None where that is no better."""
    program, best = fitted.program, fitted.solution
    if program.without_nodes or not isinstance(program.loss, Squares):
        return None
    point = solve_nodes(program, suggested_point(program, best.point.theta))
    return point if program.objective(point) < (1.0 - BETTER) * best.objective else None


def _around(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Go around a kink.

    Between two kinks there may be an end that is smooth by itself, and near the best one: one detour is always made.
    """
    program, best = fitted.program, fitted.solution
    for number, width in enumerate(DETOURS):
        if (number > 0 and best.smooth) or not isinstance(program.loss, Squares):
            break
        watch = phases.begin(f"detour, smoothing {width:g}")
        rounded = smoothed(model, program, width)
        between = solve_gauss_newton(rounded, best.point, COARSE, watch)
        end = final_solver(model)(program, between.point, limits(model), watch)
        iterations = best.iterations + between.iterations + end.iterations
        best = replace(min(best, end, key=lambda solution: solution.objective), iterations=iterations)
    return replace(fitted, solution=best)


def rejoined(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave an end near the noise that costs more than starts of windows explain: through these windows, and back.

    Each stick and slip of a long run makes ends of its own, and shorter runs have fewer. For a right model the windows
    gain no more than their free starts do, and it stays where it is; so does one whose windows are as short already.
    """
    program, best = fitted.program, fitted.solution
    if not is_noise(program, best):
        return fitted
    span = longest_recording(model) / WINDOWS
    cut = windowed(span)(model, 0.0, program.loss)
    if all(new.count <= old.count for new, old in zip(cut.segments, program.segments, strict=True)):
        return fitted
    watch = phases.begin(f"free runs over {span:.3g} s")
    between = solve_gauss_newton(cut, suggested_point(cut, best.point.theta), FINE, watch)
    if joined_at_no_cost(Fitted(between, cut), fitted):
        return fitted
    end = final_solver(model)(program, suggested_point(program, between.point.theta), limits(model), watch)
    iterations = best.iterations + between.iterations + end.iterations
    return replace(fitted, solution=replace(min(best, end, key=lambda item: item.objective), iterations=iterations))


def hop(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave local minima of a loss with kinks: restart from points that the quadratic model calls slightly worse.

    A restart goes by way of softer losses, or at once to the sharp one where those lead to where another has been.
    """
    program, best, iterations = fitted.program, fitted.solution, fitted.solution.iterations
    if not isinstance(program.loss, Absolute):
        return fitted
    sharp = keeps_the_loss(model, program)
    tries, solve = (KEPT, solve_composite) if sharp else (REWEIGHTED, solve_gauss_newton)
    rng, size = np.random.default_rng(model.problem.estimation.seed), mean_error(program, best.point)
    softer = [
        replace(program, loss=Absolute(rounding * size), width=width * model.speed_scale)
        for rounding, width in zip(ROUNDINGS[2:-1], DETOURS, strict=True)
    ]
    failed, known = 0, [list[Solution]() for _ in softer]
    for k in range(tries.most):
        watch = phases.begin(f"hop {k + 1}")
        hopped = _hopped(model, program, best, HOPS[k % len(HOPS)], rng)
        point: Point | None = hopped
        for stage, ends in zip(softer, known, strict=True):
            point = _elsewhere(solve(stage, point, COARSE, watch), ends)
            if point is None:
                break
        end = solve(program, point or hopped, tries.tolerances, watch)
        iterations += end.iterations
        failed = 0 if end.objective < (1.0 - BETTER) * best.objective else failed + 1
        best = min(best, end, key=lambda solution: solution.objective)
        if failed == tries.patience:
            break
    end = solve(program, best.point, limits(model), phases.begin("best end"))
    best = min(best, end, key=lambda solution: solution.objective)
    return Fitted(replace(best, iterations=iterations + end.iterations), program)


def _elsewhere(end: Solution, known: list[Solution]) -> Point | None:
    """Note where a stage of a restart ends; None where another restart has gone on from there."""
    if any(is_same_end(end, other) for other in known):
        return None
    known.append(end)
    return end.point


def _hopped(model: Model, program: Program, best: Solution, share: float, rng: np.random.Generator) -> Point:
    """Return a random point that the quadratic model calls worse than the best by a share of it."""
    reduced = reduce_system(program.linearise(best.point), 1e-6)
    step = _on_ellipsoid(reduced.hessian, 2.0 * share * best.objective, rng)
    theta = model.space.clip(best.point.theta + step)
    nodes = tuple(old + move for old, move in zip(best.point.nodes, reduced.node_steps(step), strict=True))
    return Point(theta, nodes)


def _on_ellipsoid(hessian: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """Return a random d with d'Hd = size."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    values, vectors = np.linalg.eigh(hessian * np.outer(scale, scale))
    direction = rng.standard_normal(scale.size)
    direction *= np.sqrt(size) / np.linalg.norm(direction)
    return scale * (vectors @ (direction / np.sqrt(np.maximum(values, 1e-8))))
