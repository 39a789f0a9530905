"""The level of one parameter over many fits, whose scatter is their own and that of the nights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.uncertainty import reach95
from friction_ocp.simulation.grid import BoolArray, FloatArray

_MOST_STEPS, _ENOUGH = 100, 1e-9
_EXACT = 1e-9
"""Standard error over the spread of the estimates below which a fit counts as exact."""


@dataclass(frozen=True)
class Level:
    """A weighted least-squares line through the estimates of a series."""

    coefficients: FloatArray
    """(columns,)."""
    covariance: FloatArray
    """(columns, columns)."""
    night_scatter: float
    """Standard deviation from one night to the next beyond the standard errors of the fits."""
    freedom: int
    """Estimates beyond what the line needs."""
    weight: float
    """Mean inverse variance of a night."""

    def at(self, design: FloatArray) -> FloatArray:
        """Return (n,) the line at rows of a design (n, columns)."""
        return design @ self.coefficients

    def interval95(self, column: int) -> tuple[float, float] | None:
        """Return the interval of one coefficient; None where no estimate is left over to tell it by."""
        if self.freedom < 1:
            return None
        half = reach95(self.freedom) * float(np.sqrt(self.covariance[column, column]))
        middle = float(self.coefficients[column])
        return middle - half, middle + half


def level_of(design: FloatArray, value: FloatArray, std_error: FloatArray) -> Level:
    """Fit a line (n, columns) to estimates (n,) with standard errors (n,)."""
    return levels_of(design, value, std_error, np.ones((1, value.size), dtype=np.bool_))[0]


def levels_of(design: FloatArray, value: FloatArray, std_error: FloatArray, taken: BoolArray) -> list[Level]:
    """Fit a line to several choices (k, n) of the estimates.

    Every night has a variance of its own beside that of its fit, as large as the estimates ask for: the weighted
    squares then have their expectation. Source: Paule & Mandel 1982.
    """
    middle, spread = float(np.median(value)), float(np.ptp(value)) or float(np.max(std_error)) or 1.0
    wanted, own = (value - middle) / spread, np.maximum(std_error / spread, _EXACT) ** 2
    freedom = taken.sum(axis=1) - design.shape[1]
    variance = np.zeros(len(taken))
    moving = freedom > 0
    for _ in range(_MOST_STEPS):
        weight = taken / (own + variance[:, None])
        residual = wanted - _lines(design, wanted, weight)[0] @ design.T
        squares, fall = np.sum(weight * residual**2, axis=1), np.sum(weight**2 * residual**2, axis=1)
        # one over the squares is concave in the variance: steps from the left never pass the root
        step = (squares / np.maximum(freedom, 1) - 1.0) * squares / np.maximum(fall, 1e-300)
        step = np.where(moving & (squares > freedom), step, 0.0)
        variance += step
        if np.all(step <= _ENOUGH * variance):
            break
    weight = taken / (own + variance[:, None])
    coefficients, covariance = _lines(design, wanted, weight)
    coefficients = coefficients * spread
    coefficients[:, 0] += middle  # the first column of a design is the level
    means = weight.sum(axis=1) / taken.sum(axis=1) / spread**2
    return [
        Level(coefficients[k], covariance[k] * spread**2, float(np.sqrt(variance[k])) * spread, int(freedom[k]), mean)
        for k, mean in enumerate(means.tolist())
    ]


def _lines(design: FloatArray, value: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (k, columns) coefficients and (k, columns, columns) covariances of weighted lines, weights (k, n)."""
    gram: FloatArray = np.einsum("kn,ni,nj->kij", weight, design, design)
    covariance: FloatArray = np.asarray(np.linalg.pinv(gram, hermitian=True), dtype=np.float64)
    return np.einsum("kij,kn,nj,n->ki", covariance, weight, design, value, optimize=True), covariance
