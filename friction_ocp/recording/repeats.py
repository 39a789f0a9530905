"""Samples of a counter that tell nothing new: its error of rounding is that of others.

At rest, and at a steady speed of whole counts a sample, every sample errs by the same; at a speed of halves, thirds
and so on every second or third one does. A thousand such samples tell no more than one. Source: Widrow, Kollar 2008,
Quantization noise, ch. 3: errors are independent only where the signal passes counts irregularly.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.ndimage as _ndimage  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.recording.recording import FloatArray

ndimage: Any = _ndimage  # its own types are incomplete
BoolArray = npt.NDArray[np.bool_]

PERIODS = 4
"""Samples after which errors may repeat themselves; what longer periods leave of their mean is small."""
SHORTEST = 8
"""Samples in a stretch: other noise leaves a counter at one count for a few samples by chance."""
STEADY = 25
"""Samples whose median is the speed that a counter has."""


def repeated(values: FloatArray, step: float) -> BoolArray:
    """Return (n,) which samples of a counter have an error that others have, too.

    `step` is that of its counts. Of a stretch whose errors repeat themselves after p samples, p^2 in its middle are
    not among them: over p samples the mean error has a deviation smaller by p, and stays.
    """
    counts = np.round(values / step)
    found = np.zeros(values.size, dtype=bool)
    for period in range(1, PERIODS + 1):
        for first in range(period):
            for begin, end in _shared(counts[first::period]):
                rows = first + period * np.arange(begin, end)
                rows = rows[~found[rows]]
                spare = rows.size - period
                if spare > 0:
                    found[rows] = True
                    found[rows[spare // 2 :][:period]] = False
    return found


def _shared(counts: FloatArray) -> list[tuple[int, int]]:
    """Return begin and end of the stretches in which counts are where a steady speed of whole counts takes them."""
    travel = np.diff(counts)
    if travel.size < 2:
        return []
    speed = np.asarray(np.round(ndimage.median_filter(travel, size=STEADY, mode="nearest")), dtype=np.float64)
    edges, steady, found = run_edges(speed), is_stay(speed), list[tuple[int, int]]()
    for begin, end in zip(edges[:-1][steady].tolist(), edges[1:][steady].tolist(), strict=True):
        beside = np.asarray(counts[begin : end + 1] - speed[begin] * np.arange(end + 1 - begin), dtype=np.float64)
        bounds, dwells = begin + run_edges(beside), is_stay(beside)
        dwells &= np.diff(bounds) >= SHORTEST
        found += zip(bounds[:-1][dwells].tolist(), bounds[1:][dwells].tolist(), strict=True)
    return found


def run_edges(values: FloatArray) -> npt.NDArray[np.intp]:
    """Return (runs + 1,) where runs of equal values begin, and the end of the last one."""
    return np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1, [values.size]))


def is_stay(values: FloatArray) -> BoolArray:
    """Return (runs of equal values,) which are not just passed through.

    A count that a drive passes at a steady speed errs by as much on the way in as on the way out, which adds up to
    nothing. Where it turns back, or dwells for longer than at the counts beside, that is not so.
    """
    edges = run_edges(values)
    lengths = np.diff(edges)
    if lengths.size < 3:
        return lengths > 1
    level = values[edges[:-1]]
    passed = np.zeros(lengths.size, dtype=bool)
    passed[1:-1] = (level[1:-1] - level[:-2]) * (level[2:] - level[1:-1]) > 0
    beside = np.zeros(lengths.size)
    beside[1:-1] = np.maximum(lengths[:-2], lengths[2:])
    return (lengths > 1) & ~(passed & (lengths <= 2 * beside))
