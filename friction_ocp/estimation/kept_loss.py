"""Fits by an absolute loss that is kept while residuals are linearised.

With exact friction such a loss has many ends, and the last digit of a start decides which of them it leads to. All fits
therefore begin at one point, wherever their guesses are: where least squares with a smooth sign end, put on a grid. A
rounded loss leads from there to where the sharp one begins. Friction with a simpler one nested in it is released where
that one has come to: its starts race, the better half of them lap by lap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.estimation.composite import solve_composite
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, Watch, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.release import released
from friction_ocp.estimation.rounds import COARSE, RELEASED_WIDTHS, Builder, Fitted, prediction, race
from friction_ocp.estimation.stages import ROUNDINGS, WIDTHS, mean_error
from friction_ocp.estimation.uncertainty import inverse_information
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute, Squares

SOFT, SHARP = ROUNDINGS[1], ROUNDINGS[-1]
"""Rounding of the loss over the mean error: on the way, and at the end."""
FAR = Tolerances(decrease=1e-6, progress=1e-5)
"""How far an end is followed that may not be the best."""
THOROUGH = Tolerances(decrease=1e-13, negligible=1e-11, progress=1e-13)
"""For ends that have to agree wherever they started, far better than the grid is wide."""
GRID = 0.03
"""Distance of the points of the grid over the standard deviation."""
LAP = 3
"""Iterations after which the worse half of the released starts drops out."""
FINALISTS = 2


def fit_kept(model: Model, builder: Builder, phases: Phases) -> Fitted:
    """Return the best end of programs without variable start states: exact friction and the sharp loss."""
    simple = nested_space(model.problem, model.space)
    inner = replace(model, space=simple)
    softly = _softly(inner, builder, phases)
    size = mean_error(builder(inner, 0.0, Squares()), softly.point)
    ends, spent = [softly], 0
    if simple is not model.space:
        program = builder(model, RELEASED_WIDTHS[0], Absolute(SOFT * size))
        starts, spent = released(model, simple, softly.point.theta), softly.iterations
        ends = _raced(program, [_started(program, theta) for theta in starts], phases.begin("released friction"))
    sharp, watch = builder(model, 0.0, Absolute(SHARP * size)), phases.begin("sharp loss")
    finals = race(sharp, [end.point for end in ends], FAR, watch, solve_composite)
    spent += sum(end.iterations for end in (*ends, *finals))
    return Fitted(replace(finals[0], iterations=spent), sharp)


def _softly(model: Model, builder: Builder, phases: Phases) -> Solution:
    """Return where a rounded loss leads from least squares with a smooth sign."""
    watch = phases.begin("least squares")
    smooth = builder(model, WIDTHS[0], Squares())
    start = _started(smooth, _on_grid(smooth, _least_squares(smooth, prediction(model, phases).solution, watch)))
    program = builder(model, WIDTHS[1], Squares())
    program = replace(program, loss=Absolute(SOFT * mean_error(program, start)))
    return solve_composite(program, start, COARSE, phases.begin("rounded loss"))


def _least_squares(program: Program, predicted: Solution, watch: Watch) -> Solution:
    """Return the end from a prediction; the better one of it and that from the guess, where the guess is better."""
    guess = _started(program, program.space.guess)
    end = solve_gauss_newton(program, _started(program, predicted.point.theta), THOROUGH, watch)
    if end.objective <= program.objective(guess):
        return end
    return min(end, solve_gauss_newton(program, guess, THOROUGH, watch), key=lambda one: one.objective)


def _started(program: Program, theta: FloatArray) -> Point:
    return suggested_point(program, theta)


def _on_grid(program: Program, end: Solution) -> FloatArray:
    """Return the nearest point of a grid of about GRID of the standard deviations."""
    theta, space = end.point.theta, program.space
    if not np.isfinite(end.objective):
        return theta
    told, _ = inverse_information(program.linearise(end.point).theta_theta)
    variance = np.diag(told) * 2.0 * end.objective / max(program.samples, 1)
    cell = np.exp2(np.round(np.log2(np.maximum(GRID * np.sqrt(variance), 1e-300))))
    return space.clip(cell * np.round(theta / cell))


def _raced(program: Program, points: Sequence[Point], watch: Watch) -> list[Solution]:
    """Return the finalists of a race: after every lap the worse half drops out."""
    lap, iterations = replace(COARSE, max_iterations=LAP), 0
    ends = race(program, points, lap, watch, solve_composite)
    while len(ends) > FINALISTS:
        kept = ends[: max(FINALISTS, (len(ends) + 1) // 2)]
        iterations += sum(end.iterations for end in ends)
        ends = race(program, [end.point for end in kept], lap, watch, solve_composite)
    return [replace(ends[0], iterations=ends[0].iterations + iterations), *ends[1:]]
