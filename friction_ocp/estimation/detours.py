"""Ways out of an end that exact friction or a loss with kinks makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rounds import COARSE, Fitted, final_solver, limits
from friction_ocp.estimation.stages import mean_error
from friction_ocp.estimation.structured import solve_structured
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute, Squares

DETOURS = (0.05, 0.01, 0.0025)
"""Smoothing of the sign over the typical speed on the way around a kink of exact friction."""
HOPS = (0.002, 0.005, 0.01)
"""Restarts around the best end of a loss with kinks, in turn: by what share the quadratic model calls them worse."""
PATIENCE, MOST_HOPS = 6, 24
"""Restarts in a row that find nothing better, and all in all, after which that end stands."""
TRIED = Tolerances(decrease=1e-6, progress=1e-5)
"""How far an end is followed that may be no better."""
BETTER = 1e-6
"""Decrease, relative, that counts as something better."""
SOFTER = ((0.05, 0.01), (0.01, 0.0025))
"""Rounding of the loss over the mean error and smoothing of the sign over the typical speed on the way back."""


def detour(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave an end at a kink of exact friction: through the same program with a smoothed sign, and back."""
    program, best = fitted.program, fitted.solution
    for width in DETOURS:
        if best.smooth or not isinstance(program.loss, Squares):
            break
        watch = phases.begin(f"detour, smoothing {width:g}")
        rounded = replace(program, width=width * model.speed_scale)
        between = solve_gauss_newton(rounded, best.point, COARSE, watch)
        end = final_solver(model)(program, between.point, limits(model), watch)
        iterations = best.iterations + between.iterations + end.iterations
        best = replace(min(best, end, key=lambda solution: solution.objective), iterations=iterations)
    return replace(fitted, solution=best)


def hop(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave local minima of a loss with kinks: restart from points that the quadratic model calls slightly worse."""
    program, best, iterations = fitted.program, fitted.solution, fitted.solution.iterations
    if not isinstance(program.loss, Absolute) or best.smooth:
        return fitted
    rng = np.random.default_rng(model.problem.estimation.seed)
    size = mean_error(program, best.point)
    softer = [
        replace(program, loss=Absolute(rounding * size), width=width * model.speed_scale) for rounding, width in SOFTER
    ]
    failed, hopped = 0, False
    for k in range(MOST_HOPS):
        hop, watch = HOPS[k % len(HOPS)], phases.begin(f"hop {k + 1}")
        reduced = reduce_system(program.linearise(best.point), 1e-6)
        step = _on_ellipsoid(reduced.hessian, 2.0 * hop * best.objective, rng)
        theta = model.space.clip(best.point.theta + step)
        nodes = tuple(old + move for old, move in zip(best.point.nodes, reduced.node_steps(step), strict=True))
        point = Point(theta, nodes)
        for stage in softer:
            point = solve_structured(stage, point, COARSE, watch).point
        end = solve_structured(program, point, TRIED, watch)
        iterations += end.iterations
        hopped = hopped or end.objective < best.objective
        failed = 0 if end.objective < (1.0 - BETTER) * best.objective else failed + 1
        best = min(best, end, key=lambda solution: solution.objective)
        if failed == PATIENCE:
            break
    end = solve_structured(program, best.point, limits(model), phases.begin("best hop")) if hopped else best
    best = replace(min(best, end, key=lambda solution: solution.objective), iterations=iterations)
    return Fitted(best, program)


def _on_ellipsoid(hessian: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """Return a random d with d'Hd = size."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    values, vectors = np.linalg.eigh(hessian * np.outer(scale, scale))
    direction = rng.standard_normal(scale.size)
    direction *= np.sqrt(size) / np.linalg.norm(direction)
    return scale * (vectors @ (direction / np.sqrt(np.maximum(values, 1e-8))))
