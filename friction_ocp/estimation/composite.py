"""Gauss-Newton for the absolute loss: residuals are linearised, the loss around them is kept.

A parabola stands for |r| only as far as r keeps its sign, which makes the steps of reweighted least squares short and
many. Here a step minimises the loss of the linearised residuals. Source: Burke & Ferris 1995, A Gauss-Newton method for
convex composite optimization.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.gauss_newton import (
    FIRST_DAMPING,
    LARGEST_DAMPING,
    SMALLEST_DAMPING,
    USUAL,
    Solution,
    Tolerances,
    Watch,
)
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.quadratic import bounded_step, linear_constraints
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.kernel import SweepResult
from friction_ocp.simulation.losses import Absolute

SOFTENINGS = (0.1, 0.01, 0.001)
"""Roundings over the mean error through which the loss of linearised residuals is minimised, down to the one asked."""
NEWTON_STEPS = 12
"""Most Newton steps at each of them."""
EXACT = 1e-4
"""Decrease of the mean loss that Newton steps may leave, over the rounding."""
RIDGE = 1e-8
"""Added to the diagonal of a Hessian, relative: hardly any sample lies where a sharp loss is curved."""
STRAIGHT = 1e-5
"""Curvature of the loss of a sample over the largest one that is left out of a Newton step."""
ACCEPTED = 1e-2
"""Share of the predicted decrease that a step has to gain."""
LONG = 1e-2
"""Damping up to which a small predicted decrease is taken for the end rather than for a short step."""


@dataclass(frozen=True)
class Rows:
    """Residuals of all samples, linearised, and what else hangs on the parameters."""

    errors: FloatArray
    """(samples,) over the noise floor."""
    slope: FloatArray
    """(samples, parameters)."""
    constant: float
    hessian: FloatArray
    """(parameters, parameters) of priors and static points."""
    gradient: FloatArray

    @property
    def size(self) -> float:
        """The mean absolute error."""
        return float(np.mean(np.abs(self.errors)))

    def curvature(self) -> FloatArray:
        """Return (parameters,) the curvature of a loss as round as the errors are large."""
        return np.sum(self.slope**2, axis=0) / max(self.size, 1e-300) + np.diag(self.hessian)

    def after(self, step: FloatArray) -> float:
        """Return the cost of what hangs on the parameters alone after a step."""
        return self.constant + float(self.gradient @ step + 0.5 * step @ self.hessian @ step)


@dataclass(frozen=True)
class Trial:
    """A point, its residuals and its objective; the simulation is kept for what differentiates it."""

    point: Point
    errors: FloatArray
    """(samples,) over the noise floor."""
    objective: float
    """Infinite where the simulation breaks down."""
    results: tuple[SweepResult, ...]


def tried(program: Program, point: Point) -> Trial:
    """Simulate a program without variable start states at a point."""
    results = tuple(program.simulate_trial(point))
    errors = np.concatenate([program.seen_errors(index, result.y) for index, result in enumerate(results)])
    total = float(np.sum(program.loss.cost(errors))) + program.parameter_terms(point.theta)[0]
    return Trial(point, errors, total if np.isfinite(total) else np.inf, results)


def linearised(program: Program, trial: Trial) -> Rows:
    """Return the residuals of a trial and their derivatives."""
    slopes = [
        slope[np.isfinite(item.measured)]
        for item, (_, slope) in zip(program.experiments, program.differentiate(trial.point, trial.results), strict=True)
    ]
    return Rows(trial.errors, np.concatenate(slopes), *program.parameter_terms(trial.point.theta))


def solve_composite(
    program: Program, start: Point, tolerances: Tolerances = USUAL, watch: Watch | None = None
) -> Solution:
    """Minimise a program of the absolute loss without variable start states; the start is moved into the bounds."""
    loss, space, iteration = program.loss, program.space, 0
    assert isinstance(loss, Absolute)
    now = tried(program, Point(space.clip(start.theta), start.nodes))
    if not np.isfinite(now.objective):
        return Solution(now.point, np.inf, 0, False, "the simulation breaks down at the start values")
    rows = linearised(program, now)
    scale, damping, slow = rows.curvature(), FIRST_DAMPING, 0
    while iteration < tolerances.max_iterations:
        step, expected = best_step(space, now.point.theta, rows, loss, damping * scale)
        trial = tried(program, Point(space.clip(now.point.theta + step), now.point.nodes))
        predicted, gained = now.objective - expected, now.objective - trial.objective
        if predicted <= max(tolerances.decrease * now.objective, tolerances.negligible) and damping <= LONG:
            end = trial if gained > 0 else now
            return Solution(end.point, end.objective, iteration, True, "the predicted decrease is below the tolerance")
        if gained <= ACCEPTED * max(predicted, 0.0) or gained <= 0:
            damping *= 6.0
            if damping > LARGEST_DAMPING:
                message = "no step decreases the objective further"
                return Solution(now.point, now.objective, iteration, True, message, smooth=False)
            continue
        iteration, now, rows = iteration + 1, trial, linearised(program, trial)
        scale = np.maximum(scale, rows.curvature())
        damping = max(damping * _trust(gained / max(predicted, 1e-300)), SMALLEST_DAMPING)
        slow = slow + 1 if gained <= tolerances.progress * now.objective else 0
        if watch is not None:
            watch(iteration, now.objective, now.point)
        if slow >= 3:
            message = "three steps in a row gained next to nothing"
            return Solution(now.point, now.objective, iteration, True, message, smooth=False)
    return Solution(now.point, now.objective, iteration, False, "iteration limit reached")


def _trust(ratio: float) -> float:
    """Return what damping is multiplied by after a step that gained `ratio` times what was predicted."""
    return 0.2 if ratio > 0.7 else 3.0 if ratio < 0.3 else 1.0


def best_step(
    space: ParameterSpace, theta: FloatArray, rows: Rows, loss: Absolute, damping: FloatArray
) -> tuple[FloatArray, float]:
    """Return the step (parameters,) that minimises the loss of the linearised residuals, and that loss.

    `damping` (parameters,) weighs the squares of the step. Newton's method on a loss that is sharpened down to the one
    asked for.
    """
    step, errors = np.zeros(theta.size), rows.errors
    box = _Box(space.lower - theta, space.upper - theta, *linear_constraints(space.constraints, theta))
    for sharper in [*(Absolute(k * rows.size) for k in SOFTENINGS if k * rows.size > 1.5 * loss.rounding), loss]:
        sheet = _Sheet(rows, sharper, damping)
        for _ in range(NEWTON_STEPS):
            move, predicted = sheet.newton(step, errors, box)
            along = rows.slope @ move
            share = sheet.share_of(step, move, errors, along, predicted)
            step, errors = step + share * move, errors + share * along
            if share == 0.0 or predicted <= EXACT * sharper.rounding * errors.size:
                break
    return step, _Sheet(rows, loss, np.zeros(theta.size)).cost(step, errors)


@dataclass(frozen=True)
class _Box:
    """Where a step may go: lower <= d <= upper, margins + normals d >= 0."""

    lower: FloatArray
    upper: FloatArray
    normals: FloatArray
    margins: FloatArray


@dataclass(frozen=True)
class _Sheet:
    """The loss of linearised residuals as a function of the step: convex."""

    rows: Rows
    loss: Absolute
    damping: FloatArray
    """(parameters,)."""

    def cost(self, step: FloatArray, errors: FloatArray) -> float:
        damped = 0.5 * float(self.damping @ step**2)
        return float(np.sum(self.loss.cost(errors))) + self.rows.after(step) + damped

    def newton(self, step: FloatArray, errors: FloatArray, box: _Box) -> tuple[FloatArray, float]:
        """Return Newton's move from a step, within the box, and the decrease that it predicts."""
        rows, constant = self.rows, self.rows.hessian + np.diag(self.damping)
        gradient = rows.slope.T @ (self.loss.weight(errors) * errors) + rows.gradient + constant @ step
        curved = self.loss.curvature(errors)
        near = np.flatnonzero(curved > STRAIGHT * np.max(curved))
        slope = rows.slope[near]
        hessian = (slope * curved[near, None]).T @ slope + constant
        hessian[np.diag_indices_from(hessian)] *= 1.0 + RIDGE
        margins = box.margins + box.normals @ step
        move = bounded_step(hessian, gradient, box.lower - step, box.upper - step, box.normals, margins)
        return move, -float(gradient @ move + 0.5 * move @ hessian @ move)

    def share_of(
        self, step: FloatArray, move: FloatArray, errors: FloatArray, along: FloatArray, predicted: float
    ) -> float:
        """Return the share of a move that decreases the cost enough: Armijo's rule; 0 where none does."""
        before, share = self.cost(step, errors), 1.0
        while share > 1e-4:
            if self.cost(step + share * move, errors + share * along) <= before - 1e-4 * share * predicted:
                return share
            share *= 0.4
        return 0.0
