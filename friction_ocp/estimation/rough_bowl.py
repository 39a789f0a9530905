"""Ways out of the ends that exact friction makes of segments of few samples, each of which may stick or slide."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from friction_ocp.estimation.around_kinks import smoothed
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.gauss_newton import Watch, solve_gauss_newton
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
from friction_ocp.estimation.splicing import segment_costs, spliced
from friction_ocp.execution.effort import spent
from friction_ocp.simulation.grid import FloatArray

HARDLY = (0.0005, 0.0002)
"""Smoothing of the sign over the typical speed, for the nodes alone: an accelerometer sees every change of the sign,
and wide smoothing leads astray."""
NODE_STEPS = 8
"""Of the nodes alone, at most."""
FEW = 2
"""The same where nodes are to follow parameters, and not to find better ones."""
STRIDE = 3.0
"""Standard errors to look about a point on either side: far enough for a bowl to show through its roughness."""
KINK = 1.0
"""Change of the cost of one sample from which it has met a kink: the shape of a bowl is the sum of many small ones."""
SHARES = (1.0, 0.5)
"""Of the way to the bottom that are tried in turn."""
TOLD = 1e-12
"""Share of a parameter's information below which a direction has none."""


def stepped_out(model: Model, program: Program, point: Point, watch: Watch | None = None) -> Point:
    """Return where the shape of the objective over several standard errors leads to, as often as that leads on.

    Where every sample may stick or slide by itself, the objective is a bowl with a rough bottom, and its slope over a
    tenth of a standard error says nothing of the bowl. A smoothed sign does not help: what it moves is far above noise.
    """
    for _ in range(MOST_TURNS):
        if spent():
            break
        cost = program.objective(point)
        moved = _toward_bottom(model, program, point, cost)
        if moved is point:
            break
        point = solve_gauss_newton(program, moved, WARM, watch).point
        if cost - program.objective(point) < worthwhile(program, cost):
            break
    return point


def _toward_bottom(model: Model, program: Program, point: Point, cost: float) -> Point:
    """Return a point of less cost on the way to the bottom of the bowl about a point; the same where there is none.

    Its nodes are fresh ones and those that its own lead to, whichever are better: they hold on to where they came from.
    """
    away = _to_bottom(model, program, point)
    if not np.any(away):
        return point
    for share in SHARES:
        beside = _beside(model, program, point, share * away, NODE_STEPS)
        trial = _with_better(program, beside, _fresh(program, beside))
        if program.objective(trial) < cost:
            return trial
    return point


def _to_bottom(model: Model, program: Program, point: Point) -> FloatArray:
    """Return (parameters,) how far off the bottom of the bowl about a point is.

    Along an axis of the uncertainty the cost of a bowl rises by s^2 / 2 over s standard errors from its bottom: what
    it differs by between the two sides of a point tells how far off that is. Samples that meet kinks have no part in
    it.
    """
    axes, before = _axes(program, point), segment_costs(program, point)
    away = np.zeros(len(axes))
    for k, step in enumerate(axes):
        sides = [segment_costs(program, _beside(model, program, point, side * step, FEW)) for side in (-STRIDE, STRIDE)]
        rises = [side - before for side in sides]
        low, high = (float(np.sum(rise, where=np.abs(rise) < KINK)) for rise in rises)
        away[k] = (low - high) / (2.0 * STRIDE)
    return np.asarray(away @ axes, dtype=np.float64)


def _beside(model: Model, program: Program, point: Point, step: FloatArray, steps: int) -> Point:
    """Return the point with other parameters, and the nodes that its own lead to there."""
    theta = model.space.clip(point.theta + step)
    return solve_nodes(program, Point(theta, point.nodes), steps, NEGLIGIBLE)


def _axes(program: Program, point: Point) -> FloatArray:
    """Return (axes, parameters) a standard error along each axis of the uncertainty, the least certain first."""
    hessian = reduce_system(program.linearise(point), 0.0).hessian
    size = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    powers, axes = np.linalg.eigh(hessian / np.outer(size, size))
    told = powers > TOLD
    return (axes[:, told] / size[:, None] / np.sqrt(powers[told])).T


def unstuck(model: Model, program: Program, point: Point, watch: Watch | None = None) -> Point:
    """Return where fresh nodes, or those that friction with a hardly smoothed sign leads to, lead on to in turn."""
    ways: list[Callable[[Program, Point], Point]] = [_fresh, *(partial(_rounded, model, width) for width in HARDLY)]
    idle, cost = 0, program.objective(point)
    for turn in range(MOST_TURNS * len(ways)):
        if spent():
            break
        moved = _with_better(program, point, ways[turn % len(ways)](program, point))
        enough, before = worthwhile(program, cost), cost
        if moved is not point:
            end = solve_gauss_newton(program, moved, WARM, watch)
            point, cost = end.point, end.objective
        idle = idle + 1 if before - cost < enough else 1
        if idle == len(ways):
            break
    return point


def _fresh(program: Program, point: Point) -> Point:
    return begun(program, point.theta)


def _rounded(model: Model, width: float, program: Program, point: Point) -> Point:
    """Return the point with nodes that friction with a hardly smoothed sign leads to."""
    rounded = smoothed(model, program, width)
    return solve_nodes(program, solve_nodes(rounded, point, NODE_STEPS, NEGLIGIBLE), NODE_STEPS, NEGLIGIBLE)


def _with_better(program: Program, point: Point, other: Point) -> Point:
    """Return the point with the better stretches of nodes of another, where that is worth a step."""
    trial = joined(program, solve_nodes(program, spliced(program, point, other), STEPS_OF_NODES, NEGLIGIBLE))
    return trial if program.objective(trial) < program.objective(point) - UNIMPORTANT else point
