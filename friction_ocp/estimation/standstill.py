"""How a recording starts: at rest, or with bristles that carry nothing. A derivative cannot see it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.first_nodes import carrying, suggested_nodes
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.simulation.grid import FloatArray

STEPS = 6
"""Of the nodes of a recording from a start at rest."""
BEGINNING = 20
"""Samples from which a recording that does not start at rest is told."""
MOVES = 5.0
"""Travel in the beginning, or speed, over the noise of a channel from which it moves."""


def at_rest(program: Program, point: Point) -> Point:
    """Return the point with recordings started at rest, or with bristles that carry nothing, where that costs less.

    A shaft that slides at a hundredth of a radian a second in the model, and sticks in truth, stays wrong: until it
    stops, friction has the wrong sign, and no derivative shows that a stop would end it. A spring that slips in the
    model before it does in truth goes on slipping, and no derivative shows that it might be slack.
    """
    nodes = list(point.nodes)
    for k, cut in enumerate(program.segments):
        if cut.measured == 0:
            alone = _alone(program, k)
            nodes[k] = _slack_start(alone, _settled_start(alone, Point(point.theta, (nodes[k],)))).nodes[0]
    return Point(point.theta, tuple(nodes))


def _alone(program: Program, index: int) -> Program:
    at = slice(index, index + 1)
    return replace(program, experiments=program.experiments[at], segments=program.segments[at])


def _settled_start(program: Program, point: Point) -> Point:
    best, cost = point, program.objective(point)
    measured = suggested_nodes(program, point.theta)[0][0]
    for columns in _stops(program):
        if any(_moves(program, column) for column in columns):
            continue
        start = point.nodes[0].copy()
        start[0] = measured
        start[0, columns] = 0.0
        trial = solve_nodes(program, Point(point.theta, (start,)), STEPS)
        after = program.objective(trial)
        if after < cost:
            best, cost = trial, after
    return best


def _slack_start(program: Program, point: Point) -> Point:
    """Return the point with bristles that carry nothing at the start of its recording, where that costs less."""
    mech = program.drive.mechanism
    bristles = np.array(mech.columns(mech.bristle_names), dtype=np.int64)
    if not bristles.size:
        return point
    slack = point.nodes[0].copy()
    slack[0, bristles] = 0.0
    trial = solve_nodes(program, carrying(program, Point(point.theta, (slack,)), bristles), STEPS)
    return trial if program.objective(trial) < program.objective(point) else point


def _stops(program: Program) -> list[list[int]]:
    """Return the columns of speeds that may be zero together: all of them, or that of one group of shafts."""
    mech = program.drive.mechanism
    speeds = [len(mech.angle_groups) + k for k in range(len(mech.free_groups))]
    return [speeds] if len(speeds) == 1 else [speeds, *([one] for one in speeds)]


def _moves(program: Program, column: int) -> bool:
    """Whether a channel shows that the shafts behind a speed move before a recording of one begins."""
    mech, item = program.drive.mechanism, program.experiments[0]
    group = mech.free_groups[column - len(mech.angle_groups)]
    for k, channel in enumerate(mech.drive.outputs):
        rows = np.flatnonzero(np.isfinite(item.measured[:, k]))[:BEGINNING]
        if mech.topology.group_of.get(channel.part) != group or rows.size < BEGINNING:
            continue
        if item.repeated[: rows[-1], k].any():  # it stays at one count
            continue
        values = item.measured[rows, k]
        limit = MOVES * float(program.noise[k])
        if channel.signal == "theta" and _goes_on(values, limit):
            return True
        if channel.signal == "omega" and abs(_line(values, 1)[-1]) > limit:
            return True
    return False


def _goes_on(angles: FloatArray, limit: float) -> bool:
    """Whether a parabola through angles begins with a speed that makes half their travel or more."""
    bend, slope, _ = _line(angles, 2)
    return abs(slope) > limit and slope * (slope + bend) > 0.5 * (slope + bend) ** 2


def _line(values: FloatArray, degree: int) -> list[float]:
    """Return the coefficients, highest first, of the polynomial through values over [0, 1]."""
    found = np.asarray(np.polyfit(np.linspace(0.0, 1.0, values.size), values, degree), dtype=np.float64)
    return [float(item) for item in found]
