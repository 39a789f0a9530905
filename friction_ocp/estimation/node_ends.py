"""Nodes that fit given parameters best, and what is worth going on for."""

from __future__ import annotations

import numpy as np

from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.splicing import carried_on
from friction_ocp.estimation.standstill import at_rest
from friction_ocp.simulation.grid import FloatArray

WARM = Tolerances(decrease=1e-6, negligible=0.01, progress=1e-4, max_iterations=40)
MOST_TURNS = 8
STEPS_OF_NODES = 3
UNIMPORTANT = 1.0
"""Difference of the objective that is not worth a step; half a unit is a standard error."""
NEGLIGIBLE = 0.05
"""The same for one of several steps of the nodes."""
MARGINAL = 1e-3
"""Share of what noise does not explain that is not worth going on for."""


def begun(program: Program, theta: FloatArray) -> Point:
    """Return parameters with the nodes that fit them best."""
    point = solve_nodes(program, suggested_point(program, theta))
    if program.without_nodes:
        return point
    return joined(program, at_rest(program, point))


def joined(program: Program, point: Point) -> Point:
    """Return the point with nodes that go on from where the segments before them end, as long as that leads on."""
    cost = program.objective(point)
    for _ in range(MOST_TURNS):
        trial = solve_nodes(program, carried_on(program, point), STEPS_OF_NODES, NEGLIGIBLE)
        after = program.objective(trial)
        if not after < cost - worthwhile(program, cost):
            break
        point, cost = trial, after
    return point


def worthwhile(program: Program, cost: float) -> float:
    """Return the decrease of a cost that is worth going on for: more than chance, and a share of what is left."""
    return max(UNIMPORTANT, MARGINAL * (cost - 0.5 * program.samples)) if np.isfinite(cost) else UNIMPORTANT
