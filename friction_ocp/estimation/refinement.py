"""Integrator steps as short as the data demand: halved until the estimate no longer moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.curriculum import may_be_cut
from friction_ocp.estimation.division import divided_afresh
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gap import following
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model, with_step
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rough_bowl import unstuck
from friction_ocp.estimation.rounds import Fitted, limits
from friction_ocp.estimation.uncertainty import inverse_information
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute

SHIFT = 0.1
"""How far, in standard errors, half the step may move any parameter."""
HALVINGS = 4


def refined(model: Model, fitted: Fitted, phases: Phases) -> tuple[Model, Fitted]:
    """Return a fit whose integrator steps are short enough, and the model with them.

    The first step follows from the fastest mode of the drive; that it suffices for the noise of these recordings shows
    only now: one Gauss-Newton step on half the integrator step may not move a parameter by more than SHIFT. How short
    they have to be is found at the fit with the first ones, and fitted once. Segments that noise joins stick or slide
    elsewhere with them.
    """
    if model.problem.estimation.max_step is not None or isinstance(fitted.program.loss, Absolute):
        return model, fitted
    program, point, first = fitted.program, fitted.solution.point, model.max_step
    for _ in range(HALVINGS):
        finer = with_step(model, 0.5 * model.max_step)
        stepped = (replace(item, grid=item.grid.with_step(finer.max_step)) for item in program.experiments)
        fine = replace(program, experiments=tuple(stepped))
        if np.max(_shift(program, fine, point), initial=0.0) <= SHIFT:
            break
        model, program = finer, fine
    if model.max_step == first:
        return model, fitted
    if may_be_cut(model, program):
        program, point = divided_afresh(model, program, point)
        program = following(model, program)
    watch = phases.begin(f"integrator step {model.max_step:.2g} s")
    if model.joins_noise:
        point = unstuck(model, program, point, watch)
    end = solve_gauss_newton(program, point, limits(model), watch)
    return model, Fitted(replace(end, iterations=end.iterations + fitted.solution.iterations), program)


def _shift(coarse: Program, fine: Program, point: Point) -> FloatArray:
    """Return by how many standard errors a Gauss-Newton step moves each free parameter more on one than on the other.

    Under misfit the standard errors grow with the residuals.
    """
    free = ~coarse.space.at_bounds(point.theta)
    systems = [program.linearise(point) for program in (coarse, fine)]
    reduced = [reduce_system(system, 1e-9) for system in systems]
    told, _ = inverse_information(reduced[0].hessian[np.ix_(free, free)])
    move = told @ (reduced[1].gradient - reduced[0].gradient)[free]
    samples = coarse.samples
    misfit = max(1.0, 2.0 * systems[0].objective / max(samples, 1))
    return np.abs(move) / np.sqrt(np.maximum(np.diag(told), 1e-300) * misfit)
