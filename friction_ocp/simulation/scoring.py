"""Scores of a sweep from its outputs and their derivatives: what native code sums while it simulates."""

from __future__ import annotations

import numpy as np

from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.kernel import Score, SweepRequest


def add_score(
    score: Score, request: SweepRequest, segments: range, y: FloatArray, dy: FloatArray | None, begin: int
) -> None:
    """Add the losses of some segments, whose nodes from `begin` on have outputs y (n, outputs) and dy (n, outputs, k).

    The node that closes the recording belongs to its last segment.
    """
    by, first = request.yardstick, request.first
    assert by is not None
    measured = by.measured[begin : begin + len(y)]
    seen = np.isfinite(measured)
    errors = np.where(seen, (y - measured) / by.noise, 0.0)
    cost = np.where(seen, by.loss.cost(errors), 0.0)
    weight = np.where(seen, by.loss.weight(errors), 0.0)
    for j in segments:
        closing = j == len(first) - 2
        rows = slice(int(first[j]) - begin, int(first[j + 1]) - begin + closing)
        score.cost[j] += np.sum(cost[rows])
        if dy is not None and score.gradient is not None and score.square is not None:
            slope = (dy[rows] / by.noise[:, None]).reshape(-1, dy.shape[2])
            pull = slope * weight[rows].reshape(-1, 1)
            score.gradient[j] += errors[rows].reshape(-1) @ pull
            score.square[j] += slope.T @ pull
