"""The variables of a program as one vector, and its Gauss-Newton Hessian as one sparse matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.simulation.grid import FloatArray, IntArray


@dataclass(frozen=True)
class NlpLayout:
    """Where every variable and every Hessian entry stands: nodes of all recordings, then the parameters.

    Nodes that the measurement gives are no variables. All variables are scaled to the size of one.
    """

    index: tuple[IntArray, ...]
    """By recording (segments, states): the variable of each node state, -1 where it is none."""
    theta: IntArray
    """(parameters,) the variable of each parameter."""
    scale: FloatArray
    """(variables,) value of one unit of each variable."""
    hessian: ca.Sparsity
    """Upper triangle."""
    entries: IntArray
    """Which of the stacked Hessian blocks stand in the upper triangle, column by column."""

    @classmethod
    def of(cls, program: Program, point: Point) -> NlpLayout:
        """Lay out the variables of a program; `point` gives the typical size of the states."""
        index: list[IntArray] = []
        count = 0
        for cut, nodes in zip(program.segments, point.nodes, strict=True):
            variables = np.full(nodes.shape, -1, dtype=np.int64)
            free = nodes[cut.measured :].size
            variables[cut.measured :] = (count + np.arange(free)).reshape(-1, nodes.shape[1])
            index.append(variables)
            count += free
        theta = count + np.arange(point.theta.size)
        scale = np.ones(count + theta.size)
        size = _state_size(point.nodes)
        for variables in index:
            scale[variables[variables >= 0]] = np.broadcast_to(size, variables.shape)[variables >= 0]
        scale[theta] = program.space.scale
        hessian, entries = _pattern(tuple(index), theta)
        return cls(tuple(index), theta, scale, hessian, entries)

    def pack(self, theta: FloatArray, nodes: Sequence[FloatArray]) -> FloatArray:
        """Return the vector of variables, not scaled, of parameters and node states (or their gradients)."""
        x = np.zeros(self.scale.size)
        for variables, values in zip(self.index, nodes, strict=True):
            x[variables[variables >= 0]] = values[variables >= 0]
        x[self.theta] = theta
        return x

    def point(self, x: FloatArray, like: Point) -> Point:
        """Return the point of scaled variables; nodes that are no variables are those of `like`."""
        values = x * self.scale
        nodes = [np.where(index >= 0, values[index], old) for index, old in zip(self.index, like.nodes, strict=True)]
        return Point(values[self.theta], tuple(nodes))

    def hessian_values(self, system: Linearisation) -> FloatArray:
        """Return the entries of the upper triangle in scaled variables, column by column."""
        blocks = [(item.node_node, item.node_next, item.node_theta) for item in system.blocks]
        stacked = np.concatenate([block.ravel() for item in (*blocks, (system.theta_theta,)) for block in item])
        row, column = (np.asarray(axis) for axis in self.hessian.get_triplet())
        return stacked[self.entries] * self.scale[row] * self.scale[column]


def _state_size(nodes: Sequence[FloatArray]) -> FloatArray:
    """Return the root mean square of each state; 1 where it is zero."""
    if not nodes:
        return np.ones(0)
    size = np.sqrt(np.mean(np.concatenate(nodes) ** 2, axis=0))
    return np.where(size > 0, size, 1.0)


def _pattern(index: tuple[IntArray, ...], theta: IntArray) -> tuple[ca.Sparsity, IntArray]:
    """Return the pattern of the Hessian and where its entries stand in the stacked blocks."""
    rows: list[IntArray] = []
    columns: list[IntArray] = []
    for variables in index:
        border = np.broadcast_to(theta, (len(variables), theta.size))
        for left, right in ((variables, variables), (variables[:-1], variables[1:]), (variables, border)):
            pairs = np.broadcast_arrays(left[:, :, None], right[:, None, :])
            rows.append(pairs[0].ravel())
            columns.append(pairs[1].ravel())
    rows.append(np.repeat(theta, theta.size))
    columns.append(np.tile(theta, theta.size))
    row, column = np.concatenate(rows), np.concatenate(columns)
    chosen = np.flatnonzero((row >= 0) & (column >= 0) & (row <= column))
    chosen = chosen[np.lexsort((row[chosen], column[chosen]))]
    count = theta[-1] + 1
    return ca.Sparsity.triplet(count, count, row[chosen].tolist(), column[chosen].tolist()), chosen
