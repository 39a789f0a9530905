"""Counters that start over: wrap-arounds and resets are found and unrolled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.conditioning import detect_resolution
from friction_ocp.recording.recording import FloatArray
from friction_ocp.recording.sampling import interrupted

AMBIGUOUS = 0.4
"""Share of a turn above which a step may be one in the other direction that was sampled too slowly."""
FAR = 10.0
"""A jump to the value of a reset counts as one if it is so many times larger than steps usually are."""
_FEWEST_BITS = 8
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


@dataclass(frozen=True)
class Turnover:
    """A counter that starts over, as its samples show it."""

    turn: float
    """What it loses each time, in the unit of the samples."""
    samples: tuple[int, ...]
    """The first sample after each jump."""
    steps: int | None = None
    """How many steps of its resolution a turn has; None where it is one of 360 deg."""


def looks_like_counter(values: FloatArray, time: FloatArray | None = None) -> Turnover | None:
    """Return where raw values seem to start over, after a power of two, 360 or 2 pi; else None.

    With `time`, (n,) s, what passes in a gap is left aside.
    """
    seen = values[np.isfinite(values)]
    whole = bool(np.all(seen == np.round(seen)))
    turns = (turn for turn in _KNOWN_TURNS if not (whole and turn == 2.0 * np.pi))
    return _first_turnover(values, time, {turn: None for turn in turns})


def turnover(values: FloatArray, unit: str, time: FloatArray | None = None) -> Turnover | None:
    """Return the same of values in SI, that may start over after one turn or a power of two of their resolution."""
    seen = values[np.isfinite(values)]
    turns: dict[float, int | None] = {2.0 * np.pi: None} if unit == "rad" else {}
    resolution = detect_resolution(seen)
    if resolution is not None:
        bits = max(int(np.ceil(np.log2(np.round(np.ptp(seen) / resolution) + 1.0))), _FEWEST_BITS)
        turns[resolution * 2.0**bits] = 2**bits
    return _first_turnover(values, time, turns)


def _first_turnover(values: FloatArray, time: FloatArray | None, turns: Mapping[float, int | None]) -> Turnover | None:
    """Return the first turn that values lose and win: they stay within it, and without the jumps nothing is left.

    A jump is a step of more than three quarters of a turn, among others of less than a quarter of it. What is left of
    half of the jumps once the turn is taken off has to be no longer than the longest other step: were they steps like
    the `N` others, more than half of `J` of them would be longer with the probability (J / (J + N))^(J / 2). A command
    that steps to and fro by anything but a turn fails.
    """
    present = np.flatnonzero(np.isfinite(values))
    if present.size < 4:
        return None
    joined = np.ones(present.size - 1, dtype=bool) if time is None else ~interrupted(time[present])
    after, steps = present[1:][joined], np.abs(np.diff(values[present]))[joined]
    span = float(np.ptp(values[present]))
    for turn, resolved in turns.items():
        far = steps > 0.75 * turn
        jumps, others = steps[far], steps[~far]
        few = 0 < jumps.size < 0.2 * steps.size
        if span > (1.0 + 1e-9) * turn or not few or np.any(others > 0.25 * turn) or not np.any(others):
            continue
        if np.median(np.abs(jumps - turn)) <= np.max(others) + 1e-9 * turn:
            return Turnover(turn, tuple(after[far].tolist()), resolved)
    return None
