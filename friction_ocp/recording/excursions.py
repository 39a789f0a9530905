"""Samples that no machine took: values that leave a signal in one step and come back in one, as after a lost frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from friction_ocp.recording.recording import Channel, FloatArray
from friction_ocp.recording.sampling import interrupted

FASTER = 10.0
"""Steps of a position over the longest other one from which they are none of a motion.

A motion would have to be so many times faster than ever else, reach that within a sample, turn and be as slow as before
within another. Friction and impacts take speed away, and what rings comes back with steps not much shorter than the
first. Noise does not either: of Gaussian noise the longest of other steps is 3 standard deviations at least, so that
this is a sample 30 of them off."""
LARGER = 1000.0
"""The same of what may jump: impacts and switches do that to accelerations, currents and speeds, up to the range of a
sensor; what is beyond all others by so much is a code for an error, or a number of other bits."""
FEW, LONGEST = 0.01, 20
"""Share of the steps, and samples on end, up to which values are stray ones and no part of the motion."""


def excursions(channel: Channel) -> npt.NDArray[np.intp]:
    """Return the samples of a channel that leave its other ones and return, each way farther than any motion."""
    if channel.values.shape != channel.time.shape:
        return np.empty(0, dtype=np.intp)
    present = np.flatnonzero(np.isfinite(channel.values))
    values = channel.values[present]
    if values.size < 2.0 / FEW:
        return np.empty(0, dtype=np.intp)
    steps = np.abs(np.diff(values))
    steps[interrupted(channel.time[present])] = 0.0
    level = _longest_other(steps, FASTER if channel.unit in ("rad", "m") else LARGER)
    if level is None:
        return np.empty(0, dtype=np.intp)
    return present[_between(np.flatnonzero(steps > level), values, level)]


def _longest_other(steps: FloatArray, factor: float) -> float | None:
    """Return the longest of the steps that are not among a few, each `factor` times as long; None without such few."""
    most = max(int(FEW * steps.size), 2)
    top = np.sort(steps)[-most - 1 :][::-1]
    apart = np.flatnonzero((top[:-1] > factor * top[1:]) & (top[1:] > 0.0))
    return float(top[apart[-1] + 1]) if apart.size else None


def _between(far: npt.NDArray[np.intp], values: FloatArray, level: float) -> npt.NDArray[np.intp]:
    """Return the samples between a far step and the next one, where that leads back to where a motion may have gone."""
    found: list[npt.NDArray[np.intp]] = []
    k = 0
    while k + 1 < far.size:
        first, last = int(far[k]), int(far[k + 1])
        returned = abs(values[last + 1] - values[first]) <= (last - first + 1) * level
        if last - first <= LONGEST and returned:
            found.append(np.arange(first + 1, last + 1))
            k += 1
        k += 1
    return np.concatenate(found) if found else np.empty(0, dtype=np.intp)
