"""Counters that start over: wrap-arounds and resets are found and unrolled."""

from __future__ import annotations

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.recording import FloatArray

AMBIGUOUS = 0.4
"""Share of a turn above which a step may be one in the other direction that was sampled too slowly."""
FAR = 10.0
"""A jump to the value of a reset counts as one if it is so many times larger than steps usually are."""
_KNOWN_TURNS = (*(float(2**bits) for bits in (8, 10, 12, 13, 14, 16, 17, 18, 20, 24, 32)), 360.0, 2.0 * np.pi)


def unroll(values: FloatArray, wrap: float | None, reset: float | None, where: str) -> FloatArray:
    """Return a counter as if it had never started over, in the unit that it counts in.

    `wrap` is how much it loses (or gains) when it starts over, so that each step is taken the short way round;
    `reset` the value to which it is set at an unknown time: from there it goes on at its usual step. Raises
    FrictionOcpError where a step is so long that its direction cannot be told.
    """
    if reset is not None:
        values = _unroll_resets(values, reset)
    return values if wrap is None else _unroll_turns(values, wrap, where)


def _unroll_turns(values: FloatArray, wrap: float, where: str) -> FloatArray:
    result, present = values.copy(), np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[present])
    turns = np.round(steps / wrap)
    short = steps - wrap * turns
    doubtful = np.flatnonzero(np.abs(short) > AMBIGUOUS * wrap)
    if len(doubtful):
        sample = present[doubtful[0] + 1]
        what = f"the step to sample {sample} is {short[doubtful[0]]:.6g}, near half of wrap = {wrap:.6g}"
        allowed = f"steps of at most {AMBIGUOUS:g} turns, or the direction cannot be told"
        raise FrictionOcpError(Finding(where, what, allowed, "correct wrap, or sample faster"))
    result[present[1:]] -= wrap * np.cumsum(turns)
    return result


def _unroll_resets(values: FloatArray, reset: float) -> FloatArray:
    result, present = values.copy(), np.flatnonzero(np.isfinite(values))
    seen = values[present]
    steps = np.diff(seen)
    usual = float(np.median(np.abs(steps[steps != 0.0]))) if np.any(steps != 0.0) else 0.0
    jumps = np.flatnonzero((np.abs(steps) > FAR * usual) & (np.abs(seen[1:] - reset) <= 2.0 * usual)) + 1
    for at in jumps:
        before = steps[at - 2] if at >= 2 and at - 1 not in jumps else 0.0
        result[present[at:]] += seen[at - 1] + before - seen[at]
    return result


def looks_like_counter(values: FloatArray) -> float | None:
    """Return the turn after which values seem to start over, or None.

    Evidence is a step of more than three quarters of a known turn (a power of two, 360, 2 pi) between values that
    stay within it and otherwise move by less than a quarter of it.
    """
    seen = values[np.isfinite(values)]
    if len(seen) < 4:
        return None
    steps, span = np.abs(np.diff(seen)), float(np.ptp(seen))
    for turn in _KNOWN_TURNS:
        far = steps > 0.75 * turn
        between = np.any((steps > 0.25 * turn) & ~far)
        if span <= (1.0 + 1e-9) * turn and not between and 0.0 < np.mean(far) < 0.2:
            return turn
    return None
