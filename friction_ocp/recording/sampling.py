"""When samples were taken, as they show it: gaps."""

from __future__ import annotations

import numpy as np

from friction_ocp.recording.recording import FloatArray

CHANCE = 0.01
"""Probability up to which what is seen is not taken for chance."""


def gaps(time: FloatArray) -> tuple[tuple[float, float], ...]:
    """Return where samples are missing, first and last instant, s, of every gap between samples at `time`.

    A gap is an interval that is too long for chance even if samples came at random instants (Poisson), the most
    irregular way to log steadily: then the longest of `n` intervals of mean `m` is above m log(n / CHANCE) with the
    probability CHANCE. Gaps are left out of the mean, one after the other.
    """
    intervals = np.diff(time)
    usual = np.ones(intervals.size, dtype=bool)
    while usual.any():
        bound = float(np.mean(intervals[usual])) * np.log(intervals.size / CHANCE)
        shorter = intervals <= bound
        if np.array_equal(shorter, usual):
            break
        usual = shorter
    at = np.flatnonzero(~usual)
    return tuple(zip(time[at].tolist(), time[at + 1].tolist(), strict=True))
