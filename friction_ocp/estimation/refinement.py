"""Integrator steps as short as the data demand: halved until the estimate no longer moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.estimation.curriculum import may_be_cut
from friction_ocp.estimation.division import divided_afresh
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gap import following
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model, step_at_guesses, with_step
from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rough_bowl import unstuck
from friction_ocp.estimation.rounds import Fitted, limits
from friction_ocp.estimation.uncertainty import inverse_information
from friction_ocp.simulation.grid import FloatArray, Grid
from friction_ocp.simulation.losses import Absolute

SHIFT = 0.1
"""How far, in standard errors, half the step may move any parameter."""
HALVINGS = 4
HALVED = (3.0 / 4.0) ** 2
"""Mean square of what half the step of a method of order 2 changes over that of the error of the whole step."""


def refined(model: Model, fitted: Fitted, phases: Phases) -> tuple[Model, Fitted]:
    """Return a fit whose integrator steps are short enough, and the model with them.

    The first step follows from the fastest mode of the drive; that it suffices for the noise of these recordings shows
    only now: one Gauss-Newton step on half the integrator step may not move a parameter by more than SHIFT, and what it
    changes in the residuals may not show among them. How short they have to be is found at the fit with the first ones,
    and fitted once. Segments that noise joins stick or slide elsewhere with them.
    """
    program, point = fitted.program, fitted.solution.point
    finer, program = stepped_finely(model, program, point)
    if finer is model:
        return model, fitted
    model = finer
    if may_be_cut(model, program):
        program, point = divided_afresh(model, program, point)
        program = following(model, program)
    watch = phases.begin(f"integrator step {model.max_step:.2g} s")
    if model.joins_noise:
        point = unstuck(model, program, point, watch)
    end = solve_gauss_newton(program, point, limits(model), watch)
    return model, Fitted(replace(end, iterations=end.iterations + fitted.solution.iterations), program)


def stepped_finely(model: Model, program: Program, point: Point, shift: float = SHIFT) -> tuple[Model, Program]:
    """Return model and program with integrator steps that are short enough where a fit has ended; the same if they are.

    Half of them may move no parameter by more than a `shift` in standard errors. None is shorter than the first one,
    that of the guesses, halved HALVINGS times: a mode that is faster may be absurd. Not where the problem states the
    step, or errors count by their size: those have no standard errors.
    """
    stated = model.problem.estimation.max_step is not None or not model.train
    if stated or isinstance(program.loss, Absolute):
        return model, program
    system, first = program.linearise(point), step_at_guesses(model)
    least = _halved(first, [item.grid.with_step(first) for item in program.experiments]) / 2.0 ** (HALVINGS - 1)
    while (step := _halved(model.max_step, [item.grid for item in program.experiments])) > (1.0 - 1e-6) * least:
        finer = with_step(model, step)
        stepped = (replace(item, grid=item.grid.with_step(finer.max_step)) for item in program.experiments)
        fine = replace(program, experiments=tuple(stepped))
        after = fine.linearise(point)
        if not _moves(program, system, after, point, shift) and not _shows(program, fine, system, point):
            break
        model, program, system = finer, fine, after
    return model, program


def _halved(longest: float, grids: Sequence[Grid]) -> float:
    """Return half the median of the integrator steps that are taken, s: none is longer than the samples are apart."""
    steps = [np.repeat(grid.dt / grid.substeps, grid.substeps) for grid in grids]
    return 0.5 * min(longest, float(np.median(np.concatenate([item[item > 0.0] for item in steps]))))


def _misfit(program: Program, system: Linearisation) -> float:
    """Return the mean square of what is left over that of the noise, 1 at least: all that is uncertain grows by it."""
    return max(1.0, 2.0 * system.objective / max(program.samples, 1))


def _moves(program: Program, before: Linearisation, after: Linearisation, point: Point, shift: float) -> bool:
    """Return whether Gauss-Newton steps on both are further apart than a `shift` in any parameter that is free."""
    free = ~program.space.at_bounds(point.theta)
    if not np.any(free):
        return False
    reduced = [reduce_system(system, 1e-9) for system in (before, after)]
    told, _ = inverse_information(reduced[0].hessian[np.ix_(free, free)])
    move = told @ (reduced[1].gradient - reduced[0].gradient)[free]
    variance = np.maximum(np.diag(told), 1e-300) * _misfit(program, before)
    return bool(np.max(np.abs(move) / np.sqrt(variance), initial=0.0) > shift)


def _shows(coarse: Program, fine: Program, before: Linearisation, point: Point) -> bool:
    """Return whether the error of the coarse steps shows among the residuals, where a drive may have nothing to move.

    What shows is as large as the standard deviation of the mean square of white residuals.
    """
    samples = max(coarse.samples, 1)
    residuals = (_residuals(program, point) for program in (coarse, fine))
    changed = sum(float(np.sum((one - other) ** 2)) for one, other in zip(*residuals, strict=True))
    return changed / samples > HALVED * np.sqrt(2.0 / samples) * _misfit(coarse, before)


def _residuals(program: Program, point: Point) -> list[FloatArray]:
    return [program.seen_errors(index, result.y) for index, result in enumerate(program.simulate_all(point))]
