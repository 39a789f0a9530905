"""When samples were taken, as they show it: gaps, and values that are repeated until the next one comes."""

from __future__ import annotations

from math import inf

import numpy as np
import numpy.typing as npt

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.recording import FloatArray

CHANCE = 0.01
"""Probability up to which what is seen is not taken for chance."""


NEXT = 1.5
"""Usual intervals beyond the first and the last sample up to which these still tell the value: the next one, late."""
STEADY = 0.9
"""Share of the intervals that are hardly longer than the median where samples come steadily, not when values change."""


def gaps(time: FloatArray) -> tuple[tuple[float, float], ...]:
    """Return where samples are missing, first and last instant, s, of every gap between samples at `time`."""
    at = np.flatnonzero(interrupted(time))
    return tuple(zip(time[at].tolist(), time[at + 1].tolist(), strict=True))


def interrupted(time: FloatArray) -> npt.NDArray[np.bool_]:
    """Return (n - 1,) which intervals between samples at `time`, (n,) s, are gaps.

    A gap is an interval that is too long for chance even if samples came at random instants (Poisson), the most
    irregular way to log steadily: then the longest of `n` intervals of mean `m` is above m log(n / CHANCE) with the
    probability CHANCE. Gaps are left out of the mean, one after the other.
    """
    intervals = np.diff(time)
    usual = np.isfinite(intervals)
    while usual.any():
        bound = float(np.mean(intervals[usual])) * np.log(intervals.size / CHANCE)
        shorter = intervals <= bound
        if np.array_equal(shorter, usual):
            break
        usual = shorter
    return ~usual


def known_span(time: FloatArray, held: bool) -> tuple[float, float]:
    """Return from when to when samples at `time`, (n,) s, tell a value: up to the next one that would have come.

    Values that are `held` until they change, and come when they do, are known to the end.
    """
    if time.size < 2:
        return (-inf, inf) if not time.size or not held else (float(time[0]), inf)
    intervals = np.diff(time)
    usual = NEXT * float(np.quantile(intervals, STEADY))
    changing = held and usual > NEXT**2 * float(np.median(intervals))
    return float(time[0]) - usual, inf if changing else float(time[-1]) + usual


def unseen_ends(time: FloatArray, begin: float, end: float) -> tuple[tuple[float, float], ...]:
    """Return what samples at `time` leave of a span at its two ends, s, where that is as long as a gap."""
    if not time.size:
        return ()
    known = np.concatenate([[begin] if begin < time[0] else [], time, [end] if end > time[-1] else []])
    return tuple(gap for gap in gaps(known) if gap[1] <= time[0] or gap[0] >= time[-1])


def held_for(values: FloatArray) -> int | None:
    """Return how many times a slower logger's values are repeated in a faster one's rows; None where they are not.

    Changes come a multiple of `k` samples apart, mostly `k`. Where they came at random, all of `M` intervals would be
    multiples of some number above 1 with the probability 2^-M at most, or little more. Changes of one size alone are
    none of those: a coarse sensor of a steady motion makes them at equal distances, too.
    """
    at, sizes = _changes(values)
    apart = np.diff(at)
    if not apart.size or 0.5**apart.size > CHANCE or float(np.ptp(sizes)) <= 1e-9 * float(np.max(sizes)):
        return None
    count = int(np.gcd.reduce(apart))
    return count if count > 1 and np.median(apart) == count else None


def first_of_each(values: FloatArray, count: int, where: str) -> FloatArray:
    """Return values that are repeated `count` times with NaN in place of the repeats.

    Raises FrictionOcpError where a value changes in between.
    """
    at, _ = _changes(values)
    phase = int(at[0]) % count if at.size else 0
    odd = at[at % count != phase]
    if odd.size:
        what = f"values change at samples {at[0]} and {odd[0]}, which are no multiple of held = {count} apart"
        raise FrictionOcpError(Finding(where, what, "every value as many times", "correct held, or leave it out"))
    return np.where(np.arange(values.size) % count == phase, values, np.nan)


def _changes(values: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return at which samples a value differs from the sample before, and by how much."""
    steps = np.abs(np.diff(values))
    at = np.flatnonzero(steps > 0.0)
    return at + 1, steps[at]
