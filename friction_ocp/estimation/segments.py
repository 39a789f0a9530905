"""How recordings are cut into segments, and how these are joined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.simulation.grid import FloatArray, IntArray


@dataclass(frozen=True)
class GapSlopes:
    """How the weights of the gaps of a recording hang on the parameters."""

    theta: FloatArray
    """(parameters,) those that the weights are laid for."""
    by_theta: FloatArray
    """(segments - 1, states, states, parameters)."""


@dataclass(frozen=True)
class Segments:
    """How one recording is cut."""

    first: IntArray
    """(segments + 1,) first node of each segment; last the last node of the recording."""
    gap_weight: FloatArray | None
    """(segments - 1, states, states) W with W'W the inverse covariance of each continuity gap; None leaves
    the segments unconnected (windows)."""
    measured: int = 0
    """How many nodes, from the first, are no variables but what the smoothed measurement says."""
    start_weight: FloatArray | None = None
    """(segments, states) 1 / standard deviation of the prior on each node, about what the smoothed measurement says."""
    slopes: GapSlopes | None = None
    """Of the weights; None where these are the same whatever the parameters are."""

    @property
    def count(self) -> int:
        """Number of segments."""
        return len(self.first) - 1

    def owner(self, nodes: IntArray) -> IntArray:
        """Return the index of the segment that each grid node belongs to; the closing node to the last one."""
        return np.clip(np.searchsorted(self.first, nodes, side="right") - 1, 0, self.count - 1)

    @property
    def tied(self) -> IntArray:
        """Indices of the nodes that have a prior."""
        if self.start_weight is None:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(np.any(self.start_weight > 0, axis=1))

    def weights(self, theta: FloatArray) -> FloatArray:
        """Return (gaps, states, states) the weights of the gaps under some parameters."""
        if self.gap_weight is None or self.count < 2:
            return np.zeros((0, 0, 0))
        if self.slopes is None:
            return self.gap_weight
        return self.gap_weight + self.slopes.by_theta @ (theta - self.slopes.theta)

    def weighed(self, gaps: FloatArray, theta: FloatArray) -> FloatArray:
        """Return gaps (segments - 1, states) over what is allowed; none where the segments are unconnected."""
        if self.gap_weight is None or self.count < 2:
            return np.zeros((0, gaps.shape[1]))
        return np.einsum("kij,kj->ki", self.weights(theta), gaps)

    def weighed_slopes(self, gaps: FloatArray, count: int) -> FloatArray:
        """Return (gaps, states, parameters) how weighed gaps change with `count` parameters through their weights."""
        if self.slopes is None:
            return np.zeros((*gaps.shape, count))
        return np.einsum("kijp,kj->kip", self.slopes.by_theta, gaps)
