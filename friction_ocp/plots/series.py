"""Measured and simulated series as a screen can show them: few points, no peak lost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

ChannelColumns = Mapping[str, FloatArray]
"""`time`, `measured` and `simulated`, each (n,)."""

Series = Mapping[str, Mapping[str, ChannelColumns]]
"""Columns by recording and channel: the content of result.h5."""

POINTS = 4000
_GAP = 5.0  # a measurement is interrupted where its samples are this many usual steps apart


@dataclass(frozen=True)
class Trace:
    """One channel of one recording, thinned for display."""

    time: FloatArray
    """(m,) s."""
    measured: FloatArray
    """(m,) NaN in a gap."""
    simulated: FloatArray
    """(m,)."""
    residual: FloatArray
    """(m,) measured minus simulated."""
    samples: int
    """Measured samples before thinning."""


def traces_of(channels: Mapping[str, ChannelColumns], points: int = POINTS) -> Iterator[tuple[str, Trace]]:
    """Yield name and trace of each channel; what is not measured, such as the states, is left out."""
    for name, columns in channels.items():
        if {"time", "measured", "simulated"} <= set(columns):
            yield name, trace_of(columns, points)


def trace_of(columns: ChannelColumns, points: int = POINTS) -> Trace:
    """Thin one channel to at most `points` common instants that keep the peaks of every curve."""
    time, measured, simulated = (
        np.asarray(columns[name], dtype=np.float64) for name in ("time", "measured", "simulated")
    )
    shown = _measured_or_in_gap(time, np.isfinite(measured))
    time, measured, simulated = time[shown], measured[shown], simulated[shown]
    residual = measured - simulated
    kept = peak_indices((measured, simulated, residual), points)
    samples = int(np.isfinite(measured).sum())
    return Trace(time[kept], measured[kept], simulated[kept], residual[kept], samples)


def peak_indices(signals: Sequence[FloatArray], points: int) -> IntArray:
    """Return at most `points` (>= 16) increasing indices: ends, and per bucket each signal's extremes and a gap.

    A gap is marked by its first NaN in any signal. Peaks that coincide leave room for more buckets.
    """
    samples = len(signals[0])
    if samples <= points:
        return np.arange(samples)
    sure = (points - 2) // (2 * len(signals) + 1)
    for buckets in (3 * sure, 2 * sure, 3 * sure // 2):
        picks = _peaks_per_bucket(signals, buckets)
        if len(picks) <= points:
            return picks
    return _peaks_per_bucket(signals, sure)


def _peaks_per_bucket(signals: Sequence[FloatArray], buckets: int) -> IntArray:
    samples = len(signals[0])
    width = -(-samples // buckets)
    starts = np.arange(0, samples, width)
    picks = [np.array([0, samples - 1])]
    missing = np.zeros((len(starts), width), dtype=np.bool_)
    for signal in signals:
        rows = np.full(len(starts) * width, np.nan)
        rows[:samples] = signal
        rows = rows.reshape(len(starts), width)
        finite = np.isfinite(rows)
        some = finite.any(axis=1)
        picks += [
            (starts + np.where(finite, rows, np.inf).argmin(axis=1))[some],
            (starts + np.where(finite, rows, -np.inf).argmax(axis=1))[some],
        ]
        missing |= ~finite
    missing.reshape(-1)[samples:] = False
    picks.append((starts + missing.argmax(axis=1))[missing.any(axis=1)])
    return np.unique(np.concatenate(picks))


def rounded(values: FloatArray, digits: int = 6) -> list[float | None]:
    """Return values rounded to `digits` digits of their range, with None where they are not finite."""
    finite = values[np.isfinite(values)]
    extent = float(np.ptp(finite) or np.abs(finite).max()) if finite.size else 0.0
    decimals = digits - 1 - int(np.floor(np.log10(extent))) if extent > 0 else digits
    short = np.round(values, min(decimals, 300))
    return [float(value) if np.isfinite(value) else None for value in short]


def _measured_or_in_gap(time: FloatArray, present: BoolArray) -> BoolArray:
    """Return which samples to show: a slow channel on a fast axis is not a row of gaps."""
    where = np.flatnonzero(present)
    if len(where) < 2:
        return np.ones(len(time), dtype=np.bool_)
    steps = np.diff(time[where])
    before = np.searchsorted(where, np.arange(len(time)), side="right") - 1
    outside = (before < 0) | (before >= len(steps))
    in_gap = steps[np.clip(before, 0, len(steps) - 1)] > _GAP * float(np.median(steps))
    return present | outside | in_gap
