"""Gauss-Newton with Levenberg-Marquardt damping over parameters and nodes together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.estimation.quadratic import bounded_step
from friction_ocp.simulation.grid import FloatArray

SMALLEST_DAMPING, LARGEST_DAMPING = 1e-9, 1e9


@dataclass(frozen=True)
class Solution:
    """Where a solver ended."""

    point: Point
    objective: float
    iterations: int
    converged: bool
    message: str
    smooth: bool = True
    """Whether it ended where the quadratic model expects nothing more, not at a kink."""


Watch = Callable[[int, float, Point], None]
"""Called after each accepted step with iteration, objective and point."""


@dataclass(frozen=True)
class Tolerances:
    """When to stop."""

    decrease: float = 1e-8
    """Predicted decrease of the objective, relative to the objective."""
    negligible: float = 1e-4
    """Predicted decrease that is too small to matter whatever the objective: residuals are in noise floors, so that
    it moves no combination of parameters by more than sqrt(2e-4) of its standard error."""
    progress: float = 1e-6
    """Actual decrease of three steps in a row, relative to the objective."""
    stalled: float = 1e-4
    """The same, where no damped step decreases the objective any more (kinks of the friction law)."""
    max_iterations: int = 100


def solve_gauss_newton(
    program: Program, start: Point, tolerances: Tolerances = Tolerances(), watch: Watch | None = None
) -> Solution:
    """Minimise a program from a start; the start is moved inside the bounds first."""
    point = Point(program.space.clip(start.theta), start.nodes)
    system = program.linearise(point)
    damping, iteration, slow = 1e-3, 0, 0
    if not np.isfinite(system.objective):
        return Solution(point, system.objective, 0, False, "the simulation breaks down at the start values")
    while iteration < tolerances.max_iterations:
        iteration += 1
        accepted = _descend(program, point, system, damping, tolerances)
        if accepted is None:
            return _stuck(program, point, system, iteration, tolerances)
        if accepted.system is None:
            return Solution(point, system.objective, iteration, True, "the predicted decrease is below the tolerance")
        gained = system.objective - accepted.system.objective
        point, system, damping = accepted.point, accepted.system, accepted.damping
        slow = slow + 1 if gained <= tolerances.progress * system.objective else 0
        if slow >= 3:
            text = "three steps in a row gained next to nothing"
            return Solution(point, system.objective, iteration, True, text, smooth=False)
        if watch is not None:
            watch(iteration, system.objective, point)
    return Solution(point, system.objective, iteration, False, "iteration limit reached")


@dataclass(frozen=True)
class _Accepted:
    point: Point
    system: Linearisation | None
    damping: float


def _descend(
    program: Program, point: Point, system: Linearisation, damping: float, tolerances: Tolerances
) -> _Accepted | None:
    """Return the first damped step that decreases the objective; None where there is none."""
    grow = 4.0
    while damping <= LARGEST_DAMPING:
        trial, predicted = trial_step(program.space, point, system, damping)
        if predicted <= max(tolerances.decrease * system.objective, tolerances.negligible) and damping <= 1e-2:
            return _Accepted(point, None, damping)
        after = program.linearise(trial)
        gained = system.objective - after.objective
        if gained > 1e-4 * max(predicted, 0.0) and gained > 0:
            ratio = gained / max(predicted, 1e-300)
            shrink = 0.1 if ratio > 0.7 else (0.5 if ratio > 0.25 else 2.0)
            return _Accepted(trial, after, max(damping * shrink, SMALLEST_DAMPING))
        damping, grow = damping * grow, grow * 2.0
    return None


def _stuck(program: Program, point: Point, system: Linearisation, iteration: int, tolerances: Tolerances) -> Solution:
    _, predicted = trial_step(program.space, point, system, 1e-6)
    relative = predicted / max(system.objective, 1e-300)
    if relative <= tolerances.stalled or predicted <= tolerances.negligible:
        text = "no step decreases the objective further"
        return Solution(point, system.objective, iteration, True, text, smooth=False)
    text = f"no step decreases the objective, yet the model predicts {relative:.1e} of it"
    return Solution(point, system.objective, iteration, False, text)


def trial_step(space: ParameterSpace, point: Point, system: Linearisation, damping: float) -> tuple[Point, float]:
    """Return the damped Gauss-Newton point and the decrease that the quadratic model predicts."""
    reduced = reduce_system(system, damping)
    rows, margins = _constraint_rows(space, point.theta)
    step = bounded_step(
        reduced.hessian, reduced.gradient, space.lower - point.theta, space.upper - point.theta, rows, margins
    )
    theta = space.clip(point.theta + step)
    step = theta - point.theta
    nodes = tuple(old + move for old, move in zip(point.nodes, reduced.node_steps(step), strict=True))
    return Point(theta, nodes), _predicted(system, step, reduced.node_steps(step))


def _constraint_rows(space: ParameterSpace, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    if space.constraints is None:
        return np.zeros((0, theta.size)), np.zeros(0)
    margins, rows = space.constraints(theta)
    return np.asarray(rows).reshape(-1, theta.size), np.asarray(margins).ravel()


def _predicted(system: Linearisation, step: FloatArray, node_steps: tuple[FloatArray, ...]) -> float:
    """Return the decrease of the undamped quadratic model."""
    decrease = -system.theta_gradient @ step - 0.5 * step @ system.theta_theta @ step
    for blocks, move in zip(system.blocks, node_steps, strict=True):
        pulled = np.einsum("kij,kj->ki", blocks.node_node, move)
        decrease -= np.sum(move * blocks.node_gradient) + 0.5 * np.sum(move * pulled)
        decrease -= np.einsum("ki,kip,p->", move, blocks.node_theta, step)
        decrease -= np.einsum("ki,kij,kj->", move[:-1], blocks.node_next, move[1:])
    return float(decrease)
