"""Normal equations of one recording, summed over batches of segments."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray


@dataclass
class NormalEquations:
    """Normal equations of one recording while they are summed."""

    cost: float
    node_node: FloatArray
    node_next: FloatArray
    node_theta: FloatArray
    node_gradient: FloatArray
    theta_theta: FloatArray
    theta_gradient: FloatArray

    @classmethod
    def empty(cls, segments: int, states: int, count: int) -> NormalEquations:
        return cls(
            0.0,
            np.zeros((segments, states, states)),
            np.zeros((max(segments - 1, 0), states, states)),
            np.zeros((segments, states, count)),
            np.zeros((segments, states)),
            np.zeros((count, count)),
            np.zeros(count),
        )

    def add(self, batch: slice, jacobian: FloatArray, error: FloatArray, weight: FloatArray, slope: FloatArray) -> None:
        """Add rows of a batch of segments, each depending on its node and on the parameters.

        `jacobian` (segments, rows, states + k) by node and by k numbers that move with the parameters by `slope`
        (k, parameters); `error` and `weight` (segments, rows).
        """
        states = self.node_node.shape[1]
        weighted = (jacobian * weight[:, :, None]).transpose(0, 2, 1)
        square = weighted @ jacobian
        gradient = np.einsum("kij,kj->ki", weighted, error)
        self.node_node[batch] += square[:, :states, :states]
        self.node_theta[batch] += square[:, :states, states:] @ slope
        self.node_gradient[batch] += gradient[:, :states]
        self.theta_theta += slope.T @ square[:, states:, states:].sum(axis=0) @ slope
        self.theta_gradient += slope.T @ gradient[:, states:].sum(axis=0)

    def fold_node(self, j: int, slope: FloatArray) -> None:
        """Make node j a function of the parameters with derivative `slope` (states, parameters)."""
        cross = slope.T @ self.node_theta[j]
        self.theta_theta += cross + cross.T + slope.T @ self.node_node[j] @ slope
        self.theta_gradient += slope.T @ self.node_gradient[j]
        if j < len(self.node_next):
            self.node_theta[j + 1] += self.node_next[j].T @ slope
            self.node_next[j] = 0.0
        self.node_node[j], self.node_theta[j], self.node_gradient[j] = np.eye(slope.shape[0]), 0.0, 0.0


@dataclass(frozen=True)
class Batch:
    """Some segments of one recording and the nodes that belong to them, the same number for each."""

    segments: slice
    rows: slice | IntArray
    """A run of nodes, or (segments, nodes) where lengths differ."""
    inside: BoolArray | None = None
    """(segments, nodes) which of them belong to the segment; None for all."""

    def take(self, values: FloatArray) -> FloatArray:
        """Return (segments, rows, ...) of values (n, outputs, ...), nodes and outputs in one; no copy of a run."""
        count = self.segments.stop - self.segments.start
        taken = values[self.rows]
        return taken.reshape(count, -1, *values.shape[2:])

    def weights(self, weight: FloatArray) -> FloatArray:
        """Return (segments, rows) of weights (n, outputs), zero for what does not belong."""
        taken = weight[self.rows]
        if self.inside is not None:
            taken = taken * self.inside[:, :, None]
        return taken.reshape(self.segments.stop - self.segments.start, -1)


MOST_RUNS = 4
"""Runs of segments of equal length up to which each run is a batch of its own."""


def batches(first: IntArray) -> list[Batch]:
    """Return batches that hold every segment; the node that closes the recording belongs to the last one."""
    lengths = np.diff(first)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(lengths)) + 1, [lengths.size]]).astype(int).tolist()
    last = lengths.size
    closing = Batch(slice(last - 1, last), slice(int(first[-1]), int(first[-1]) + 1))
    if len(edges) <= MOST_RUNS + 1:
        runs = [Batch(slice(a, b), slice(int(first[a]), int(first[b]))) for a, b in pairwise(edges)]
        return [*runs, closing]
    return [*_padded(first, 0, last), closing]


def _padded(first: IntArray, begin: int, stop: int) -> list[Batch]:
    """Return batches of segments padded to the longest, which at most doubles their rows."""
    longest = int(np.max(np.diff(first[begin : stop + 1])))
    if stop - begin > 1 and longest * (stop - begin) > 2 * int(first[stop] - first[begin]):
        middle = (begin + stop) // 2
        return _padded(first, begin, middle) + _padded(first, middle, stop)
    rows = first[begin:stop, None] + np.arange(longest)
    ends = first[begin + 1 : stop + 1, None]
    return [Batch(slice(begin, stop), np.minimum(rows, ends - 1), rows < ends)]
