"""Node states with the parameters held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.program import Point, Program

NOTHING, RELATIVE = 1e-3, 1e-9
"""Decrease of the objective below which a step gained nothing: in units of log-likelihood, and of the objective."""


# derivatives outgrow all numbers where a simulation breaks down; the objective there is infinite
@np.errstate(over="ignore", invalid="ignore")
def solve_nodes(
    program: Program, point: Point, iterations: int = 15, negligible: float = NOTHING, relative: float = RELATIVE
) -> Point:
    """Solve for the node states with the parameters held, until a step gains next to nothing of log-likelihood.

    That is `negligible`, or as little `relative` to what the objective still is.
    """
    if program.without_nodes:
        return point
    still, system = np.zeros_like(point.theta), program.linearise(point, by_theta=False)
    objective, damping = system.objective, 1e-6
    for _ in range(iterations):
        steps = reduce_system(system, damping).node_steps(still)
        trial = replace(point, nodes=tuple(old + step for old, step in zip(point.nodes, steps, strict=True)))
        after = program.objective(trial)
        nothing = max(negligible, relative * objective)
        if not after < objective:
            if after - objective < nothing:
                break  # at a kink, or at the end
            damping *= 100.0
            continue
        gained, point, objective = objective - after, trial, after
        if gained < nothing:
            break
        system, damping = program.linearise(point, by_theta=False), 0.1 * damping
    return point
