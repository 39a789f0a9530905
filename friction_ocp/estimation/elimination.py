"""Solution of a Gauss-Newton system by eliminating the node states segment by segment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.program import Blocks, Linearisation
from friction_ocp.simulation.grid import FloatArray


@dataclass(frozen=True)
class Eliminated:
    """Nodes of one recording as affine functions of the parameter step."""

    constant: FloatArray
    """(segments, states)."""
    by_theta: FloatArray
    """(segments, states, parameters)."""


@dataclass(frozen=True)
class Reduced:
    """The system in the parameters alone, and the way back to the nodes."""

    hessian: FloatArray
    gradient: FloatArray
    recordings: tuple[Eliminated, ...]

    def node_steps(self, step: FloatArray) -> tuple[FloatArray, ...]:
        """Return the node steps that belong to a parameter step."""
        return tuple(item.constant + item.by_theta @ step for item in self.recordings)


def reduce_system(system: Linearisation, damping: float, scale: FloatArray | None = None) -> Reduced:
    """Eliminate all nodes; `damping` times its diagonal is added to the Hessian (Levenberg-Marquardt).

    For the parameters it is `damping` times `scale` (parameters,) where that is given.
    """
    own = np.diag(system.theta_theta) if scale is None else scale
    hessian = system.theta_theta + damping * np.diag(own)
    gradient = system.theta_gradient.copy()
    recordings: list[Eliminated] = []
    for blocks in system.blocks:
        eliminated = _eliminate(blocks, damping)
        hessian += np.einsum("kip,kiq->pq", blocks.node_theta, eliminated.by_theta)
        gradient += np.einsum("kip,ki->p", blocks.node_theta, eliminated.constant)
        recordings.append(eliminated)
    return Reduced(0.5 * (hessian + hessian.T), gradient, tuple(recordings))


def _eliminate(blocks: Blocks, damping: float) -> Eliminated:
    """Solve the block-tridiagonal node system for -[gradient, node_theta] (block Thomas algorithm)."""
    count, states = blocks.node_gradient.shape
    right = -np.concatenate([blocks.node_gradient[:, :, None], blocks.node_theta], axis=2)
    diagonal = blocks.node_node.copy()
    index = np.arange(int(states))
    diagonal[:, index, index] *= 1.0 + damping
    diagonal[:, index, index] += 1e-14 * (1.0 + diagonal[:, index, index])
    upper = np.empty_like(blocks.node_next)
    for j in range(count):
        if j:
            lower = blocks.node_next[j - 1].T
            diagonal[j] -= lower @ upper[j - 1]
            right[j] -= lower @ right[j - 1]
        if j < count - 1:
            both = np.concatenate([blocks.node_next[j], right[j]], axis=1)
            solved = np.asarray(np.linalg.solve(diagonal[j], both), dtype=np.float64)
            upper[j], right[j] = solved[:, :states], solved[:, states:]
        else:
            right[j] = np.linalg.solve(diagonal[j], right[j])
    for j in range(count - 2, -1, -1):
        right[j] -= upper[j] @ right[j + 1]
    return Eliminated(right[:, :, 0], right[:, :, 1:])
