"""Errors of a free run that go on to its end, counted where they arise.

What a model lacks acts for a moment, and the error that it leaves behind stays: stretches of residuals are far from
independent, though what acts in them is. The sum of the scores, J' r, is summed in another order then (summation by
parts): each change of the residual from one sample to the next, times all that it does to later ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.influence import Influence
from friction_ocp.simulation.grid import FloatArray, IntArray


@dataclass(frozen=True)
class Pull:
    """How the residuals pull on the parameters, as a sum over rows of `reach` times `error`."""

    reach: FloatArray
    """(rows, parameters)."""
    error: FloatArray
    """(rows,)."""
    weighed: FloatArray
    """(rows, parameters): by how much a step of the parameters takes `error` down."""

    def information(self, rows: IntArray) -> FloatArray:
        """Return (parameters, parameters) what some rows tell: those of all rows add up to J' W J."""
        part = self.reach[rows].T @ self.weighed[rows]
        return 0.5 * (part + part.T)


def pull(found: Influence, weight: FloatArray, wandering: Sequence[IntArray]) -> Pull:
    """Return the pull of residuals that count by `weight`, (rows,), those of some runs by where their errors arise.

    `wandering` holds the rows of each of these, a whole free run in the order of time.
    """
    reach, error, weighed = found.jacobian, found.score_weight, weight[:, None] * found.jacobian
    if wandering:
        reach, error = reach.copy(), error.copy()
    for run in wandering:
        for channel in np.unique(found.channel[run]):
            own = run[found.channel[run] == channel]
            reach[own] = np.cumsum(reach[own][::-1], axis=0)[::-1]
            error[own] = np.diff(error[own], prepend=0.0)
            weighed[own] = np.diff(weighed[own], axis=0, prepend=0.0)
    return Pull(reach, error, weighed)
