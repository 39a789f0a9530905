"""Ways out of an end that exact friction or a loss with kinks makes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.optimize as _optimize  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gauss_newton import Solution, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rounds import COARSE, Fitted, final_solver, limits
from friction_ocp.estimation.stages import ROUNDINGS, mean_error
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute, Squares

optimize: Any = _optimize  # its own types are incomplete

DETOURS = (0.05, 0.01, 0.0025)
"""Smoothing of the sign over the typical speed on the way around a kink of exact friction."""
HOPS = (0.005, 0.02, 0.05, 0.005, 0.02, 0.05)
"""Restarts around the best end of a loss with kinks: by what share the quadratic model calls them worse."""
VALLEY, SEARCH, SHARPER = 0.01, 80, 0.01
"""Width of the last search without derivatives, by the same measure; its evaluations for each parameter; its rounding
of the loss over that of the fit."""


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
    if not isinstance(program.loss, Absolute):
        return fitted
    rng = np.random.default_rng(model.problem.estimation.seed)
    size = mean_error(program, best.point)
    softer = [
        replace(program, loss=Absolute(rounding * size), width=width * model.speed_scale)
        for rounding, width in zip(ROUNDINGS[2:-1], DETOURS, strict=True)
    ]
    for k, hop in enumerate(HOPS):
        watch = phases.begin(f"hop {k + 1} of {len(HOPS)}")
        reduced = reduce_system(program.linearise(best.point), 1e-6)
        step = _on_ellipsoid(reduced.hessian, 2.0 * hop * best.objective, rng)
        theta = model.space.clip(best.point.theta + step)
        nodes = tuple(old + move for old, move in zip(best.point.nodes, reduced.node_steps(step), strict=True))
        point = Point(theta, nodes)
        for stage in softer:
            point = solve_gauss_newton(stage, point, COARSE, watch).point
        end = solve_gauss_newton(program, point, limits(model), watch)
        iterations += end.iterations
        best = min(best, end, key=lambda solution: solution.objective)
    phases.begin("direct search")
    return Fitted(replace(_searched(program, best), iterations=iterations), program)


def _searched(program: Program, best: Solution) -> Solution:
    """Search without derivatives in the valley around an end: kinks of loss and friction stop every smooth step there.

    A simplex (Nelder & Mead 1965) on the loss all but unrounded, which begins as wide as the quadratic model calls
    `VALLEY` worse, along its axes.
    """
    assert isinstance(program.loss, Absolute)
    sharp = replace(program, loss=Absolute(SHARPER * program.loss.rounding))
    size = best.point.theta.size
    axes = _axes(reduce_system(program.linearise(best.point), 1e-6).hessian) * np.sqrt(2.0 * VALLEY * best.objective)

    def point(z: FloatArray) -> Point:
        return Point(program.space.clip(best.point.theta + axes @ z), best.point.nodes)

    def cost(z: FloatArray) -> float:
        return _allowed_cost(sharp, point(z))

    simplex = np.vstack([np.zeros(size), np.eye(size)])
    options = {"initial_simplex": simplex, "maxfev": SEARCH * size, "fatol": 1e-8 * best.objective, "xatol": 1e-3}
    found = point(np.asarray(optimize.minimize(cost, np.zeros(size), method="Nelder-Mead", options=options).x))
    return replace(best, point=found, objective=program.objective(found))


def _allowed_cost(program: Program, point: Point) -> float:
    constraints = program.space.constraints
    if constraints is not None and np.any(np.asarray(constraints(point.theta)[0]) < 0.0):
        return np.inf
    return program.objective(point)


def _on_ellipsoid(hessian: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """Return a random d with d'Hd = size."""
    direction = rng.standard_normal(len(hessian))
    return _axes(hessian) @ (direction * np.sqrt(size) / np.linalg.norm(direction))


def _axes(hessian: FloatArray) -> FloatArray:
    """Return columns d with d'Hd = 1 that are orthogonal in the scale of the diagonal, flat directions cut short."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    values, vectors = np.linalg.eigh(hessian * np.outer(scale, scale))
    return scale[:, None] * (vectors / np.sqrt(np.maximum(values, 1e-8)))
