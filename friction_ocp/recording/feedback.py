"""What a control loop makes of a measured motion: it throws its command to and fro, and that is no noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from friction_ocp.recording.conditioning import MAD_TO_STD, fourth_differences

FloatArray = npt.NDArray[np.float64]

BEFORE, AFTER = 16, 2
"""Samples of a motion, before and after one of a command, that may explain it: a loop filters and logs shift."""
EACH = 10
"""Samples for each number of a regression, at least."""
MOST = 20_000
"""Samples that it is fitted to, at most."""
INLIERS, TIMES = 4.0, 12
"""Deviations within which residuals count, and how often these are chosen again: a loop that saturates is no filter."""


def unexplained_noise(time: FloatArray, values: FloatArray, motions: Sequence[FloatArray]) -> float:
    """Return the deviation of white noise of a signal (n,) that no linear filter of `motions` explains; NaN if untold.

    An upper bound, as high frequencies by themselves are one: what a sensor adds to a current moves nothing, so that no
    sample of a motion knows of it. A loop that follows the counts of an encoder is a filter of these counts, and what
    it commands is felt. Fourth differences, as in `high_frequency_noise`, leave smooth references out of it.
    """
    known = [motion for motion in motions if motion.shape == values.shape]
    lags = range(-AFTER, BEFORE + 1)
    first, last = BEFORE, values.size - AFTER - 4
    if not known or last - first < EACH * len(lags) * len(known):
        return float("nan")
    steps = [fourth_differences(time, motion) for motion in known]
    target = fourth_differences(time, values)
    moves = np.ptp(np.lib.stride_tricks.sliding_window_view(values, 5), axis=1) > 0.0
    rows = np.arange(first, last)[moves[first:last]]
    rows = rows[:: max(rows.size // MOST, 1)]
    columns = np.column_stack([step[rows - lag] for step in steps for lag in lags])
    whole = np.isfinite(columns).all(axis=1) & np.isfinite(target[rows])
    columns, target = columns[whole], target[rows[whole]]
    sizes = np.sqrt(np.mean(columns**2, axis=0)) if whole.any() else np.zeros(columns.shape[1])
    columns = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    if not columns.shape[1] or target.size < EACH * columns.shape[1]:
        return float("nan")
    counted = np.full(target.size, True)
    left, level = target, float("inf")
    for _ in range(TIMES):
        left = target - columns @ np.linalg.lstsq(columns[counted], target[counted])[0]
        level = MAD_TO_STD * float(np.median(np.abs(left)))
        counted = np.abs(left) <= INLIERS * level
        if np.sum(counted) < EACH * columns.shape[1]:
            break
    return level
