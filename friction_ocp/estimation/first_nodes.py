"""Where nodes begin: as the measurement shows them, and what it does not show as it follows from what it does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_ocp.drive.start import unseen_states
from friction_ocp.estimation.program import Point, Program
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.kernel import SweepRequest, SweepResult

FOLLOWED = 10
"""Samples after which states are set to what is measured while those that no channel shows are simulated."""


def suggested_point(program: Program, theta: FloatArray) -> Point:
    """Return the parameters with the nodes that are suggested for them."""
    return Point(theta, suggested_nodes(program, theta))


def suggested_nodes(program: Program, theta: FloatArray) -> tuple[FloatArray, ...]:
    """Return by recording node states (segments, states) from the smoothed measurement.

    What that does not show is as steady motion has it, or as it follows from what is shown: whichever costs less. So
    are bristles, which follow the travel since the last reversal.
    """
    pairs = zip(program.experiments, program.segments, strict=True)
    steady = tuple(program.measured_states(item, theta, cut.first[:-1])[0] for item, cut in pairs)
    if program.without_nodes or all(cut.count < 2 for cut in program.segments):
        return steady
    mech = program.drive.mechanism
    unseen, bristles = unseen_states(mech), mech.columns(mech.bristle_names)
    sets = [np.array(sorted(each), dtype=np.int64) for each in {frozenset(unseen), frozenset((*unseen, *bristles))}]
    ways = [_with_followed(program, theta, steady, each) for each in sets if each.size]
    if not ways:
        return steady
    return min((*ways, steady), key=lambda each: program.objective(Point(theta, each)))


def carrying(program: Program, point: Point, states: IntArray) -> Point:
    """Return the point with some states as they go on from its first nodes, the others beginning anew at each."""
    begun, nodes = program.placed(point).nodes, tuple(own.copy() for own in point.nodes)
    first = [cut.first for cut in program.segments]
    for own, result in zip(nodes, _carried(program, point.theta, first, begun, states), strict=True):
        own[1:, states] = result.end[:-1, states]
    return Point(point.theta, nodes)


def _with_followed(
    program: Program, theta: FloatArray, steady: tuple[FloatArray, ...], states: IntArray
) -> tuple[FloatArray, ...]:
    """Return nodes with some states as they follow from what is shown, wherever that can be simulated."""
    pairs = list(zip(program.experiments, program.segments, strict=True))
    first = [_often(int(cut.first[-1]), cut.first) for _, cut in pairs]
    shown = [
        program.sweep.start_states(item.signals(at[:-1]), program.space.numbers(theta, item.name))
        for (item, _), at in zip(pairs, first, strict=True)
    ]
    nodes = tuple(own.copy() for own in steady)
    ends = _carried(program, theta, first, shown, states)
    for (_, cut), own, at, result in zip(pairs, nodes, first, ends, strict=True):
        there = result.end[np.searchsorted(at, cut.first[1:-1]) - 1][:, states]
        own[1:, states] = np.where(np.isfinite(there), there, own[1:, states])
    return nodes


def _often(last: int, nodes: IntArray) -> IntArray:
    """Return grid nodes every few samples, and those that there are."""
    return np.unique(np.concatenate([np.arange(0, last, FOLLOWED, dtype=np.int64), nodes]))


def _carried(
    program: Program,
    theta: FloatArray,
    first: Sequence[IntArray],
    starts: Sequence[FloatArray],
    states: IntArray,
) -> list[SweepResult]:
    """Simulate segments of all recordings from their starts, but for some states, which go on from segment to segment.

    Of each recording `first` (segments + 1,) are grid nodes and `starts` (segments, states).
    """
    requests = [
        SweepRequest(item.grid, at, x0, program.space.numbers(theta, item.name), program.width, carried=states)
        for item, at, x0 in zip(program.experiments, first, starts, strict=True)
    ]
    return program.sweep.run_many(requests)
