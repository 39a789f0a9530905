"""A way to the end of long segments through short ones, which kinks of the friction do not trap."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.preparation import joined_by_input_noise, may_be_joined_by_inputs
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rounds import COARSE, Fitted, final_solver, joined, limits, race
from friction_ocp.estimation.stages import is_noise
from friction_ocp.simulation.losses import Squares


def through_short_segments(model: Model, fitted: Fitted, phases: Phases) -> Fitted:
    """Leave an end above the noise by way of segments that noise of measured inputs joins.

    To an encoder that tells a millionth of its travel a smoothed sign is wrong by much more than noise, and the exact
    one leads on only next to the answer: every sample in which a shaft stops makes a kink. Over a few samples nodes
    make up for that. The same fit where that way leads to nothing better.
    """
    program, best = fitted.program, fitted.solution
    if not may_be_joined_by_inputs(model) or is_noise(program, best):
        return fitted
    blunt = joined_by_input_noise(model)
    short = joined(blunt, 0.0, Squares())
    points = [suggested_point(short, theta) for theta in (model.space.guess, best.point.theta)]
    watch = phases.begin("short segments")
    between = race(short, points, COARSE, watch, solve_gauss_newton, lambda end: is_noise(short, end))[0]
    watch = phases.begin("long segments again")
    end = final_solver(model)(program, program.point_along(short, between.point), limits(model), watch)
    iterations = best.iterations + between.iterations + end.iterations
    better = min(best, end, key=lambda solution: solution.objective)
    return replace(fitted, solution=replace(better, iterations=iterations))
