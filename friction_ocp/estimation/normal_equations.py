"""Normal equations of one recording, summed over batches of segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.simulation.grid import FloatArray, IntArray

Batch = slice | IntArray
"""Segments, none of them twice."""


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

    def add(self, batch: Batch, jacobian: FloatArray, error: FloatArray, weight: FloatArray, slope: FloatArray) -> None:
        """Add rows of a batch of segments, each depending on its node and on the parameters.

        `jacobian` (segments, rows, states + k) by node and by k numbers that move with the parameters by `slope`
        (k, parameters); `error` and `weight` (segments, rows).
        """
        weighted = (jacobian * weight[:, :, None]).transpose(0, 2, 1)
        self.add_squares(batch, weighted @ jacobian, np.einsum("kij,kj->ki", weighted, error), slope)

    def add_squares(self, batch: Batch, square: FloatArray, gradient: FloatArray, slope: FloatArray) -> None:
        """Add J'WJ (segments, states + k, states + k) and J'We (segments, states + k) of a batch of segments."""
        states = self.node_node.shape[1]
        self.node_node[batch] += square[:, :states, :states]
        self.node_theta[batch] += square[:, :states, states:] @ slope
        self.node_gradient[batch] += gradient[:, :states]
        self.theta_theta += slope.T @ square[:, states:, states:].sum(axis=0) @ slope
        self.theta_gradient += slope.T @ gradient[:, states:].sum(axis=0)

    def fold_nodes(self, slope: FloatArray) -> None:
        """Make the first nodes functions of the parameters with derivatives `slope` (nodes, states, parameters).

        No gap joins them; the last may be joined to a node that stays.
        """
        count, back = len(slope), slope.transpose(0, 2, 1)
        cross = np.sum(back @ self.node_theta[:count], axis=0)
        self.theta_theta += cross + cross.T + np.sum(back @ self.node_node[:count] @ slope, axis=0)
        self.theta_gradient += np.einsum("ksp,ks->p", slope, self.node_gradient[:count])
        if count <= len(self.node_next):
            self.node_theta[count] += self.node_next[count - 1].T @ slope[-1]
            self.node_next[count - 1] = 0.0
        self.node_node[:count], self.node_theta[:count] = np.eye(slope.shape[1]), 0.0
        self.node_gradient[:count] = 0.0
