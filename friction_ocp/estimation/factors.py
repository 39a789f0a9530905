"""Roots of inverse covariances, where rounding may have left a covariance without any."""

from __future__ import annotations

import numpy as np

from friction_ocp.simulation.grid import FloatArray

HELD = (0.0, 1e-12, 1e-9, 1e-6, 1.0)
"""Added in turn to a unit diagonal that rounding has left without factors; with the last one there are some."""


def inverse_roots(covariances: FloatArray) -> FloatArray:
    """Return (n, k, k) W with W'W the inverse of each of some covariances (n, k, k); NaN where numbers are missing.

    Directions that differ by less than rounding, as where a motion grows by many orders over a segment, are held apart
    by as much as it takes.
    """
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariances)), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.stack([_inverse_root(each) for each in covariances])


def _inverse_root(covariance: FloatArray) -> FloatArray:
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    for held in HELD:
        try:
            factor = np.linalg.cholesky(correlation + held * np.eye(scale.size))
            return np.asarray(np.linalg.inv(factor), dtype=np.float64) / scale
        except np.linalg.LinAlgError:
            continue
    return np.full(covariance.shape, np.nan)
