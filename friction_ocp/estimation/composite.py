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
from friction_ocp.simulation.losses import Absolute

SOFTENINGS = (0.1, 0.01, 0.001)
"""Roundings over the mean error through which the loss of linearised residuals is minimised, down to the one asked."""
NEWTON_STEPS = 12
"""Most Newton steps at each of them."""
EXACT = 1e-4
"""Decrease of the mean loss that Newton steps may leave, over the rounding."""
RIDGE = 1e-8
"""Added to the diagonal of a Hessian, relative: hardly any sample lies where a sharp loss is curved."""
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

    def cost(self, loss: Absolute) -> float:
        return float(np.sum(loss.cost(self.errors))) + self.constant

    def curvature(self) -> FloatArray:
        """Return (parameters,) the curvature of a loss as round as the errors are large."""
        return np.sum(self.slope**2, axis=0) / max(self.size, 1e-300) + np.diag(self.hessian)

    def after(self, step: FloatArray) -> float:
        """Return the cost of what hangs on the parameters alone after a step."""
        return self.constant + float(self.gradient @ step + 0.5 * step @ self.hessian @ step)


def linearised(program: Program, point: Point) -> Rows:
    """Return the residuals of a program without variable start states, and their derivatives."""
    errors: list[FloatArray] = []
    slopes: list[FloatArray] = []
    starts = program.measured_starts(point.theta)
    for index, result in enumerate(program.simulate_all(point, derivatives=True)):
        item = program.experiments[index]
        _, by_theta = program.space.numbers_and_slope(point.theta, item.name)
        slope = program.output_slopes(index, result, by_theta, starts[index][1])
        seen = np.isfinite(item.measured)
        errors.append(program.residuals(index, result.y)[seen])
        slopes.append(slope[seen])
    return Rows(np.concatenate(errors), np.concatenate(slopes), *program.parameter_terms(point.theta))


def solve_composite(
    program: Program, start: Point, tolerances: Tolerances = USUAL, watch: Watch | None = None
) -> Solution:
    """Minimise a program of the absolute loss without variable start states; the start is moved into the bounds."""
    loss, space, iteration = program.loss, program.space, 0
    assert isinstance(loss, Absolute)
    point = Point(space.clip(start.theta), start.nodes)
    rows = linearised(program, point)
    now, scale, damping, slow = rows.cost(loss), rows.curvature(), FIRST_DAMPING, 0
    if not np.isfinite(now):
        return Solution(point, np.inf, 0, False, "the simulation breaks down at the start values")
    while iteration < tolerances.max_iterations:
        step, expected = best_step(space, point.theta, rows, loss, damping * scale)
        trial, predicted = Point(space.clip(point.theta + step), point.nodes), now - expected
        gained = now - program.objective(trial)
        if predicted <= max(tolerances.decrease * now, tolerances.negligible) and damping <= LONG:
            message = "the predicted decrease is below the tolerance"
            return Solution(trial if gained > 0 else point, now - max(gained, 0.0), iteration, True, message)
        if gained <= ACCEPTED * max(predicted, 0.0) or gained <= 0:
            damping *= 6.0
            if damping > LARGEST_DAMPING:
                return Solution(point, now, iteration, True, "no step decreases the objective further", smooth=False)
            continue
        iteration, point, rows = iteration + 1, trial, linearised(program, trial)
        now, scale = now - gained, np.maximum(scale, rows.curvature())
        damping = max(damping * _trust(gained / max(predicted, 1e-300)), SMALLEST_DAMPING)
        slow = slow + 1 if gained <= tolerances.progress * now else 0
        if slow >= 3:
            return Solution(point, now, iteration, True, "three steps in a row gained next to nothing", smooth=False)
        if watch is not None:
            watch(iteration, now, point)
    return Solution(point, now, iteration, False, "iteration limit reached")


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
        hessian = (rows.slope * self.loss.curvature(errors)[:, None]).T @ rows.slope + constant
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
