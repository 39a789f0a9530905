"""How far two curves over time agree: their coherence, and the distance between them as plane curves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.signal as _signal  # pyright: ignore[reportMissingTypeStubs]
import scipy.spatial as _spatial  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.simulation.grid import FloatArray

signal: Any = _signal  # its own types are incomplete
spatial: Any = _spatial

SEGMENTS = 8
"""Segments, overlapping by half, that a coherence is averaged over."""
FINENESS = 10
"""Points of the simulated curve for each measured one, between which its distance is not looked at."""


@dataclass(frozen=True)
class Coherence:
    """Share of a measured signal that depends linearly on the simulated one, by frequency."""

    frequency: FloatArray
    """(n,) Hz."""
    share: FloatArray
    """(n,) 0 to 1."""
    power: FloatArray
    """(n,) share of each frequency in the power of the measured signal about its mean."""

    @property
    def explained(self) -> float:
        """Share of the measured signal's power that depends linearly on the simulated one."""
        return float(np.sum(self.share * self.power))

    def thinned(self, points: int) -> Coherence:
        """Return at most `points` frequencies, each standing for neighbours whose width grows with the frequency."""
        if self.frequency.size <= points:
            return self
        bins = np.unique(np.round(np.geomspace(1, self.frequency.size, points)).astype(np.int64) - 1)
        power = np.add.reduceat(self.power, bins)
        own, weight = (np.maximum(values, np.finfo(np.float64).tiny) for values in (self.power, power))
        frequency, share = (np.add.reduceat(values * own, bins) / weight for values in (self.frequency, self.share))
        return Coherence(frequency, share, power)


def coherence(time: FloatArray, measured: FloatArray, simulated: FloatArray) -> Coherence:
    """Return the magnitude-squared coherence of two signals at the same times, evenly resampled where need be.

    Source: Welch 1967; the Leighton telescope paper shows it in Figs. 13, 19 and 21.
    """
    grid, first, second = _even(time, measured, simulated)
    length = max(8, 2 * grid.size // (SEGMENTS + 1))
    rate = (grid.size - 1) / (grid[-1] - grid[0])
    with np.errstate(all="ignore"):  # a signal without power depends on nothing
        frequency, share = signal.coherence(first, second, rate, nperseg=length)
    _, power = signal.welch(first, rate, nperseg=length)
    total = max(float(np.sum(power)), np.finfo(np.float64).tiny)
    return Coherence(np.asarray(frequency), np.nan_to_num(np.asarray(share)), np.asarray(power) / total)


def _even(time: FloatArray, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    known = np.isfinite(first) & np.isfinite(second)
    at = time[known]
    grid = np.linspace(float(at[0]), float(at[-1]), at.size)
    return grid, np.interp(grid, at, first[known]), np.interp(grid, at, second[known])


def curve_distance(time: FloatArray, measured: FloatArray, simulated: FloatArray, scale: float | None = None) -> float:
    """Return d of eq. 15 of the Leighton telescope paper: the deviation of the least distances between two curves.

    `scale` is its k, which turns time into the unit of the signal; the paper does not state it, and None takes the rms
    of the signal over the duration. As a standard deviation, d is blind to a distance that is the same everywhere.
    """
    known = np.isfinite(measured) & np.isfinite(simulated)
    t, v = time[known], measured[known]
    k = float(np.sqrt(np.mean(v**2)) / (t[-1] - t[0])) if scale is None else scale
    fine = np.sort(np.concatenate((np.linspace(float(t[0]), float(t[-1]), FINENESS * t.size), t)))
    curve = np.column_stack((k * fine, np.interp(fine, t, simulated[known])))
    least, _ = spatial.cKDTree(curve).query(np.column_stack((k * t, v)))
    return float(np.std(least))
