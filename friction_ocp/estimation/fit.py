"""A fit from start to end: predictions, nested model, candidates, free run or relaxed segments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.losses import AbstractLoss, Squares
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import ParameterSpace, nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.horizon import fits_free_run, horizon
from friction_ocp.estimation.progress import Phases, Progress, silent
from friction_ocp.estimation.stages import WIDTHS, free_run, losses, predictions, relaxed
from friction_ocp.simulation.grid import FloatArray

COARSE = Tolerances(decrease=1e-4, progress=1e-3, max_iterations=25)
FINE = Tolerances()
EXPECTED_PHASES = 10
RELEASES = (0.02, 0.1, 0.5)
"""Stribeck speeds, over the typical speed of the drive, from which the released parameters start."""


@dataclass(frozen=True)
class Fitted:
    """The solution and the program that it solves: exact friction, the loss asked for."""

    solution: Solution
    program: Program


def fit(model: Model, progress: Progress = silent) -> Fitted:
    """Fit the parameters of a problem from its guesses."""
    builder, phases = program_builder(model), Phases(progress, EXPECTED_PHASES)
    candidates = _candidates(model, builder, phases)
    best = _tournament(model, builder, candidates, "candidate", phases)
    return _finish(model, builder, best, phases)


Builder = Callable[[Model, float, AbstractLoss], Program]


def program_builder(model: Model) -> Builder:
    """Return what makes the program of the fit for a smoothing width and a loss."""
    if fits_free_run(model):
        span = horizon(model)
        return lambda model, width, loss: free_run(model, model.train, width, loss, span)
    return lambda model, width, loss: relaxed(model, model.train, width, loss)


def _solve(program: Program, point: Point, tolerances: Tolerances, phase: str, phases: Phases) -> Solution:
    return solve_gauss_newton(program, point, tolerances, phases.begin(phase))


def _predicted(model: Model, phases: Phases) -> FloatArray:
    """Return the parameters that best predict the smoothed motion over short times."""
    program = predictions(model, model.train, WIDTHS[0])
    start = Point(model.space.guess, program.suggested_nodes(model.space.guess))
    return _solve(program, start, COARSE, "short predictions", phases).point.theta


def _tournament(
    model: Model, builder: Builder, starts: Sequence[FloatArray], phase: str, phases: Phases
) -> Point:
    """Solve the first stage from every start and return the best end."""
    program = builder(model, WIDTHS[0], Squares())
    points = [Point(theta, program.suggested_nodes(theta)) for theta in starts]
    loss = min((next(losses(model, program, point)) for point in points), key=lambda item: getattr(item, "rounding", 0))
    program = replace(program, loss=loss)
    ends = [
        _solve(program, point, COARSE, f"{phase} {k + 1} of {len(points)}", phases) for k, point in enumerate(points)
    ]
    return min(ends, key=lambda end: end.objective).point


def _candidates(model: Model, builder: Builder, phases: Phases) -> list[FloatArray]:
    """Return starts for the full model: the guess, the predictions, and what the nested model leads to."""
    simple = nested_space(model.problem, model.space)
    if simple is model.space:
        return [model.space.guess, _predicted(model, phases)]
    inner = replace(model, space=simple)
    starts = [simple.guess, _predicted(inner, phases)]
    best = _tournament(inner, builder, starts, "simpler friction", phases)
    return released(model, simple, best.theta)


def released(model: Model, simple: ParameterSpace, theta: FloatArray) -> list[FloatArray]:
    """Return starts of the full model around the answer of the nested one."""
    known = dict(zip(simple.names, theta, strict=True))
    speed = float(np.max(model.speed_scale[:-1]))
    starts: list[FloatArray] = []
    for share in RELEASES:
        start = model.space.guess.copy()
        for k, name in enumerate(model.space.names):
            if name in known:
                start[k] = known[name]
            elif ".omega_s" in name:
                start[k] = share * speed
            elif ".tau_s" in name:
                start[k] = 1.2 * known.get(name.replace(".tau_s", ".tau_c"), model.space.guess[k])
        starts.append(model.space.clip(start))
    return starts


def _finish(model: Model, builder: Builder, point: Point, phases: Phases) -> Fitted:
    """Sharpen width and loss down to the exact problem."""
    program = builder(model, WIDTHS[0], Squares())
    stages = list(losses(model, program, point))
    iterations, solution = 0, None
    for k, loss in enumerate(stages):
        last = k == len(stages) - 1
        program = builder(model, WIDTHS[min(k, len(WIDTHS) - 1)], loss)
        solution = _solve(program, point, FINE if last else COARSE, f"stage {k + 1} of {len(stages)}", phases)
        point, iterations = solution.point, iterations + solution.iterations
    assert solution is not None
    return Fitted(replace(solution, iterations=iterations), program)
