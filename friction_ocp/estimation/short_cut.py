"""A way to the end of long segments through short ones, which kinks of the friction do not trap."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from friction_ocp.estimation.drive_noise import made_by_inputs, within
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.horizon import is_relaxed
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.preparation import joined_by_input_noise, may_be_joined_by_inputs
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rounds import COARSE, Fitted, final_solver, joined, limits, race
from friction_ocp.estimation.stages import is_noise
from friction_ocp.simulation.losses import Squares

SHORTEST, LONGER = 2, 2
"""Samples of the first segments that process noise joins, and how much longer the next ones are, up to the usual."""


def through_short_segments(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave an end above the noise by way of segments that noise of measured inputs joins, or of few samples.

    To an encoder that tells a millionth of its travel a smoothed sign is wrong by much more than noise, and the exact
    one leads on only next to the answer: every sample in which a shaft stops makes a kink. Over a few samples nodes
    make up for that. The same fit where that way leads to nothing better.
    """
    if may_be_joined_by_inputs(model) and not is_noise(fitted.program, fitted.solution):
        fitted = _by_way_of(model, [joined(joined_by_input_noise(model), 0.0, Squares())], fitted, phases)
    stated = model.process_noise or model.problem.estimation.estimated_noise
    if stated and is_relaxed(model) and not is_noise(fitted.program, fitted.solution):
        return _by_way_of(model, _growing(model, fitted.program), fitted, phases)
    return fitted


def _growing(model: Model, program: Program) -> list[Program]:
    """Return programs of ever longer segments, all shorter than those of one; none where its loss is not of squares."""
    if not isinstance(program.loss, Squares):
        return []
    options, lengths = model.problem.estimation, [SHORTEST]
    while lengths[-1] < options.samples:
        lengths.append(LONGER * lengths[-1])
    noise = {**options.process_noise, **{shaft: _hardly_seen(model, shaft) for shaft in options.estimated_noise}}
    joining = replace(options, process_noise=noise, estimated_noise=())
    problems = [replace(model.problem, estimation=replace(joining, segment=samples)) for samples in lengths[:-1]]
    return [joined(replace(model, problem=problem, noise_levels=()), 0.0, Squares()) for problem in problems]


def _hardly_seen(model: Model, shaft: str) -> float:
    """Return the torque noise of a shaft, N m/sqrt(Hz), that moves a channel in the shortest segments by its noise; 0
    if it moves none."""
    first = model.train[0]
    one = replace(made_by_inputs(model), density={shaft: 1.0})
    moved = float(np.max(within(model, one, first, SHORTEST * float(np.median(first.grid.dt))) / model.noise**2))
    return 1.0 / float(np.sqrt(moved)) if moved > 0.0 else 0.0


def _by_way_of(model: Model, ways: list[Program], fitted: Fitted, phases: Phases) -> Fitted:
    """Fit again by way of other programs, one after the other; the better of both ends counts.

    The first of them is begun at the guesses, and at the end that is known unless that leads to noise.
    """
    if not ways:
        return fitted
    program, best = fitted.program, fitted.solution
    points, iterations = [suggested_point(ways[0], theta) for theta in (model.space.guess, best.point.theta)], 0
    for short, longer in pairwise([*ways, program]):
        watch, enough = phases.begin("short segments"), partial(is_noise, short)
        end = race(short, points, COARSE, watch, solve_gauss_newton, enough)[0]
        points, iterations = [longer.point_along(short, end.point)], iterations + end.iterations
    watch = phases.begin("long segments again")
    end = final_solver(model)(program, points[0], limits(model), watch)
    iterations += best.iterations + end.iterations
    better = min(best, end, key=lambda solution: solution.objective)
    return replace(fitted, solution=replace(better, iterations=iterations))
