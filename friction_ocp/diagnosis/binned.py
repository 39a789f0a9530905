"""Means over intervals of a variable, with the band in which they lie."""

from __future__ import annotations

import numpy as np

from friction_ocp.simulation.grid import FloatArray, IntArray

REACH = 1.96


def means(bins: IntArray, values: FloatArray, size: int) -> FloatArray:
    """Return (size,) the mean of the values in each interval; 0 where there are none."""
    return np.bincount(bins, values, size) / np.maximum(np.bincount(bins, minlength=size), 1)


def band(bins: IntArray, values: FloatArray, size: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (size,) the means and the ends of their 95 % band."""
    mean, count = means(bins, values, size), np.maximum(np.bincount(bins, minlength=size), 1)
    spread = np.sqrt(np.maximum(means(bins, values**2, size) - mean**2, 0.0) / count)
    return mean, mean - REACH * spread, mean + REACH * spread
