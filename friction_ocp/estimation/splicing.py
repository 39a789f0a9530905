"""The better parts of two points with the same parameters: stretches of nodes in which they differ, one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.simulation.grid import BoolArray, FloatArray

APART = 0.3
"""Difference of two nodes over the deviation of the gap before them from which they are not the same."""
WORTH = 0.01
"""Decrease of the objective for which nodes are exchanged."""


# derivatives outgrow all numbers where a simulation breaks down; the objective there is infinite
@np.errstate(over="ignore", invalid="ignore")
def spliced(program: Program, point: Point, other: Point) -> Point:
    """Return the point with the nodes of the other wherever a stretch of them costs less.

    Two ends of one fit differ where a shaft sticks in one and slides in the other, and each is better somewhere.
    """
    nodes: list[FloatArray] = []
    for index, cut in enumerate(program.segments):
        mine, own = point.nodes[index].copy(), _costs(program, index, point)
        theirs, rival = other.nodes[index], _costs(program, index, other)
        for begin, stop in _stretches(_differ(cut, mine, theirs, point.theta)):
            at, gaps = slice(begin, stop), slice(begin, stop + 1)
            before = float(np.sum(own[0][at]) + np.sum(own[1][gaps]))
            after = float(np.sum(rival[0][at]) + np.sum(rival[1][gaps]))
            if after < before - WORTH:
                mine[at] = theirs[at]
        nodes.append(mine)
    return Point(point.theta, tuple(nodes))


def carried_on(program: Program, point: Point) -> Point:
    """Return the point with nodes where the segments before them end, wherever that costs less: every other at a time.

    A shaft that has stopped in one segment slides on in the next where a node lies a little beside rest: no derivative
    shows the way back.
    """
    for first in (1, 2):
        nodes: list[FloatArray] = []
        for index, own in enumerate(point.nodes):
            after = own.copy()
            after[first::2] = program.simulate(index, point).end[first - 1 : -1 : 2]
            nodes.append(after)
        point = spliced(program, point, Point(point.theta, tuple(nodes)))
    return point


def segment_costs(program: Program, point: Point) -> FloatArray:
    """Return (segments of all recordings,) the costs of the samples in each segment and of the gap before it."""
    both = [_costs(program, index, point) for index in range(len(program.segments))]
    return np.concatenate([samples + gaps[:-1] for samples, gaps in both])


def _costs(program: Program, index: int, point: Point) -> tuple[FloatArray, FloatArray]:
    """Return (segments,) costs of the samples in each segment, and (segments + 1,) of the gap before each."""
    cut, result = program.segments[index], program.simulate(index, point)
    costs = program.loss.cost(program.sample_errors(index, result.y))
    jumps, starts = program.gap_errors(index, point, result.end), program.start_errors(index, point)
    gaps = np.zeros(cut.count + 1)
    gaps[1 : len(jumps) + 1] = 0.5 * np.sum(jumps**2, axis=1)
    gaps[cut.tied] += 0.5 * np.sum(starts**2, axis=1)
    return np.add.reduceat(np.sum(costs, axis=1), cut.first[:-1]), gaps


def _differ(cut: Segments, nodes: FloatArray, others: FloatArray, theta: FloatArray) -> BoolArray:
    """Return (segments,) whether two sets of nodes differ by more than a gap between segments may."""
    if cut.gap_weight is None or cut.count < 2:
        return np.any(nodes != others, axis=1)
    beyond = np.linalg.norm(cut.weighed(nodes[1:] - others[1:], theta), axis=1) > APART
    return np.concatenate([beyond[:1], beyond])


def _stretches(marks: BoolArray) -> list[tuple[int, int]]:
    """Return begin and end of every run of marks."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marks, [False]]).astype(int)))
    return [(int(begin), int(stop)) for begin, stop in list(pairwise(edges))[::2]]
