"""Ways out of the ends that the kinks of exact friction make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from friction_ocp.diagnosis.fitted_model import STEPS_OF_NODES, FittedModel
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.polishing import (
    COARSE,
    MOST_TURNS,
    NEGLIGIBLE,
    UNIMPORTANT,
    WARM,
    begun,
    joined,
    worthwhile,
)
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.splicing import spliced
from friction_ocp.simulation.grid import FloatArray

DETOURS = (0.02, 0.004, 0.0008, 0.00016)
"""Smoothing of the sign over the typical speed on the way around kinks, and back step by step: in one step, nodes that
wide smoothing has moved are caught at kinks that are not theirs."""
HARDLY = (0.0005, 0.0002)
"""The same for the nodes alone: an accelerometer sees every change of the sign, and wide smoothing leads astray."""
NODE_STEPS = 8
STRIDE = 2.0
"""Standard errors to step out: what that costs beside an end in a bowl, two units, is what its roughness hides."""
TOLD = 1e-12
"""Share of a parameter's information below which a direction has none."""


def freed(fitted: FittedModel) -> FittedModel:
    """Go on through friction with a smoothed sign, and back; keep what came in where that leads to nothing better.

    A shaft that sticks in the model and slides in truth, or the reverse, is an end whose derivatives show nothing: it
    stays there whatever the parameters are, and looks like a torque that the model lacks.
    """
    if not fitted.theta.size:
        return fitted
    program, point = fitted.linear.program, fitted.linear.point
    if fitted.footing.noisy_inputs:
        best = _stepped_out(fitted.model, program, unstuck(fitted.model, program, point))
    else:
        beyond = around_kinks(fitted.model, program, point, WARM)
        best = beyond.point if beyond.objective < fitted.objective else point
        best = unstuck(fitted.model, program, best)
    return _moved(fitted, best)


def _moved(fitted: FittedModel, point: Point) -> FittedModel:
    program = fitted.linear.program
    return fitted if point is fitted.linear.point else replace(fitted, linear=linear_program(program, point))


def _stepped_out(model: Model, program: Program, point: Point) -> Point:
    """Return where steps of several standard errors along the axes of the uncertainty lead on to.

    Where every sample may stick or slide by itself, the objective is a bowl with a rough bottom, and its slope over a
    tenth of a standard error says nothing of the bowl. A smoothed sign does not help: what it moves is far above noise.
    """
    for _ in range(MOST_TURNS):
        cost = program.objective(point)
        moved = _beyond_roughness(model, program, point, cost)
        if moved is point:
            break
        point = unstuck(model, program, solve_gauss_newton(program, moved, WARM).point)
        if cost - program.objective(point) < worthwhile(program, cost):
            break
    return point


def _beyond_roughness(model: Model, program: Program, point: Point, cost: float) -> Point:
    """Return the first point a step away that costs less; the same where none does."""
    for step in _axes(program, point):
        for side in (-STRIDE, STRIDE):
            theta = model.space.clip(point.theta + side * step)
            trial = solve_nodes(program, Point(theta, point.nodes), NODE_STEPS, NEGLIGIBLE)
            if program.objective(trial) < cost - UNIMPORTANT:
                return trial
    return point


def _axes(program: Program, point: Point) -> FloatArray:
    """Return (axes, parameters) a standard error along each axis of the uncertainty, the least certain first."""
    hessian = reduce_system(program.linearise(point), 0.0).hessian
    size = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    powers, axes = np.linalg.eigh(hessian / np.outer(size, size))
    told = powers > TOLD
    return (axes[:, told] / size[:, None] / np.sqrt(powers[told])).T


def loosened(fitted: FittedModel) -> FittedModel:
    """Go on from fresh nodes, or from those that friction with a hardly smoothed sign leads to, if that leads on."""
    return _moved(fitted, unstuck(fitted.model, fitted.linear.program, fitted.linear.point))


def unstuck(model: Model, program: Program, point: Point) -> Point:
    """Return where fresh nodes, or those that friction with a hardly smoothed sign leads to, lead on to in turn."""
    ways: list[Callable[[Program, Point], Point]] = [_fresh, *(partial(_rounded, model, width) for width in HARDLY)]
    idle, cost = 0, program.objective(point)
    for turn in range(MOST_TURNS * len(ways)):
        moved = _with_better(program, point, ways[turn % len(ways)](program, point))
        enough, before = worthwhile(program, cost), cost
        if moved is not point:
            end = solve_gauss_newton(program, moved, WARM)
            point, cost = end.point, end.objective
        idle = idle + 1 if before - cost < enough else 1
        if idle == len(ways):
            break
    return point


def _fresh(program: Program, point: Point) -> Point:
    return begun(program, point.theta)


def _rounded(model: Model, width: float, program: Program, point: Point) -> Point:
    """Return the point with nodes that friction with a hardly smoothed sign leads to."""
    rounded = replace(program, width=width * model.speed_scale)
    return solve_nodes(program, solve_nodes(rounded, point, NODE_STEPS, NEGLIGIBLE), NODE_STEPS, NEGLIGIBLE)


def _with_better(program: Program, point: Point, other: Point) -> Point:
    """Return the point with the better stretches of nodes of another, where that is worth a step."""
    trial = joined(program, solve_nodes(program, spliced(program, point, other), STEPS_OF_NODES, NEGLIGIBLE))
    return trial if program.objective(trial) < program.objective(point) - UNIMPORTANT else point


def around_kinks(model: Model, program: Program, point: Point, limits: Tolerances) -> Solution:
    """Solve again from where friction with a smoothed sign leads to, less and less of it."""
    for width in DETOURS:
        rounded = replace(program, width=width * model.speed_scale)
        point = solve_gauss_newton(rounded, point, COARSE).point
    return solve_gauss_newton(program, point, limits)
