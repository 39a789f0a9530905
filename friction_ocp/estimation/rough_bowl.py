"""Ways out of the ends that exact friction makes of segments of few samples, each of which may stick or slide."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_ends import (
    MOST_TURNS,
    NEGLIGIBLE,
    STEPS_OF_NODES,
    UNIMPORTANT,
    WARM,
    begun,
    joined,
    worthwhile,
)
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.splicing import spliced
from friction_ocp.simulation.grid import FloatArray

HARDLY = (0.0005, 0.0002)
"""Smoothing of the sign over the typical speed, for the nodes alone: an accelerometer sees every change of the sign,
and wide smoothing leads astray."""
NODE_STEPS = 8
STRIDE = 2.0
"""Standard errors to step out: what that costs beside an end in a bowl, two units, is what its roughness hides."""
TOLD = 1e-12
"""Share of a parameter's information below which a direction has none."""


def stepped_out(model: Model, program: Program, point: Point) -> Point:
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
