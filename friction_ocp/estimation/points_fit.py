"""A fit of static points alone: cheap, so that it is started from many places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.gauss_newton import Solution, Tolerances, Watch, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.release import released
from friction_ocp.estimation.stages import program_of
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

RANDOM_STARTS = 20
REACH = 1.0
"""Decades either way over which random starts spread."""


def fit_points(model: Model, watch: Watch) -> tuple[Solution, Program]:
    """Return the best end over the guess, releases of the nested model, and random starts around these (seeded)."""
    program = program_of(model, (), (), 0.0, Squares())
    limits = Tolerances(max_iterations=model.problem.estimation.max_iterations)
    ends = [solve_gauss_newton(program, Point(theta, ()), limits, watch) for theta in _starts(model, program, limits)]
    best = min(ends, key=lambda end: end.objective)
    return replace(best, iterations=sum(end.iterations for end in ends)), program


def _starts(model: Model, program: Program, limits: Tolerances) -> list[FloatArray]:
    simple = nested_space(model.problem, model.space)
    starts = [model.space.guess]
    if simple is not model.space:
        nested = solve_gauss_newton(replace(program, space=simple), Point(simple.guess, ()), limits)
        starts += released(model, simple, nested.point.theta)
    rng = np.random.default_rng(model.problem.estimation.seed)
    for k in range(RANDOM_STARTS):
        around = starts[k % len(starts)]
        factor = 10.0 ** rng.uniform(-REACH, REACH, around.size)
        shift = rng.uniform(-1.0, 1.0, around.size) * model.space.scale
        starts.append(model.space.clip(np.where(around != 0, around * factor, shift)))
    return starts
