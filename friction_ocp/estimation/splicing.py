"""The better parts of two points with the same parameters: stretches of nodes in which they differ, one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from friction_ocp.estimation.program import Point, Program, Segments
from friction_ocp.simulation.grid import BoolArray, FloatArray

APART = 0.3
"""Difference of two nodes over the deviation of the gap before them from which they are not the same."""
WORTH = 0.01
"""Decrease of the objective for which nodes are exchanged."""


def spliced(program: Program, point: Point, other: Point) -> Point:
    """Return the point with the nodes of the other wherever a stretch of them costs less.

    Two ends of one fit differ where a shaft sticks in one and slides in the other, and each is better somewhere.
    """
    nodes: list[FloatArray] = []
    for index, cut in enumerate(program.segments):
        mine, own = point.nodes[index].copy(), _costs(program, index, point)
        theirs, rival = other.nodes[index], _costs(program, index, other)
        for begin, stop in _stretches(_differ(cut, mine, theirs)):
            at, gaps = slice(begin, stop), slice(begin, stop + 1)
            before = float(np.sum(own[0][at]) + np.sum(own[1][gaps]))
            after = float(np.sum(rival[0][at]) + np.sum(rival[1][gaps]))
            if after < before - WORTH:
                mine[at] = theirs[at]
        nodes.append(mine)
    return Point(point.theta, tuple(nodes))


def _costs(program: Program, index: int, point: Point) -> tuple[FloatArray, FloatArray]:
    """Return (segments,) costs of the samples in each segment, and (segments + 1,) of the gap before each."""
    item, cut, nodes = program.experiments[index], program.segments[index], point.nodes[index]
    result = program.simulate(index, point)
    errors = np.where(np.isfinite(item.measured), program.residuals(index, result.y), 0.0)
    samples = np.add.reduceat(np.sum(program.loss.cost(errors), axis=1), cut.first[:-1])
    gaps = np.zeros(cut.count + 1)
    if cut.gap_weight is not None and cut.count > 1:
        jumps = np.einsum("kij,kj->ki", cut.gap_weight, result.end[:-1] - nodes[1:])
        gaps[1:-1] = 0.5 * np.sum(jumps**2, axis=1)
    if cut.start_weight is not None:
        tied = cut.tied
        suggested, _ = program.measured_states(item, point.theta, cut.first[tied])
        gaps[tied] += 0.5 * np.sum((cut.start_weight[tied] * (nodes[tied] - suggested)) ** 2, axis=1)
    return samples, gaps


def _differ(cut: Segments, nodes: FloatArray, others: FloatArray) -> BoolArray:
    """Return (segments,) whether two sets of nodes differ by more than a gap between segments may."""
    if cut.gap_weight is None or cut.count < 2:
        return np.any(nodes != others, axis=1)
    apart = np.einsum("kij,kj->ki", cut.gap_weight, nodes[1:] - others[1:])
    beyond = np.linalg.norm(apart, axis=1) > APART
    return np.concatenate([beyond[:1], beyond])


def _stretches(marks: BoolArray) -> list[tuple[int, int]]:
    """Return begin and end of every run of marks."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marks, [False]]).astype(int)))
    return [(int(begin), int(stop)) for begin, stop in list(pairwise(edges))[::2]]
