"""Whether a motion that stays at its extremes rests there, or goes on where its channel does not show it."""

from __future__ import annotations

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.problem_file.rules.case import Case
from friction_ocp.recording.conditioning import plateaus
from friction_ocp.recording.recording import Channel as RecordedChannel
from friction_ocp.simulation.grid import FloatArray, IntArray

MOTIONS = ("theta", "omega")
"""Signals of a motion."""
_SEEN = 0.25
"""Share of the way that a motion would have gone on by, below which another channel shows that it did not."""
_STRAIGHT = 0.1
"""Deceleration before an extreme, over what would turn the motion beyond it, below which nothing turns it there."""
_LONG = 8
"""Samples at an extreme from which on it is asked how the motion gets there."""
_BESIDE, _REACH = 3, 25
"""Samples right before an extreme that are left out, since machines stop within them, and the most that are asked."""


def is_shown_to_rest(case: Case, channel: Channel, use: RecordingUse) -> bool:
    """Whether another channel of the same motion stays, too, where a channel is at its extremes."""
    recorded = use.recording.channels[channel.name]
    begin, end = _stays(recorded.values)
    if channel.signal not in MOTIONS or not begin.size:
        return False
    inner = (begin > 1) & (end < recorded.values.size - 1)
    beyond = _beyond(recorded, begin[inner], end[inner])
    gain = abs(case.numbers[f"{channel.name}.gain"])
    for other in case.drive.channels:
        ratio = None if other == channel or other.signal not in MOTIONS else case.ratio(channel.part, other.part)
        seen = None if ratio is None else case.seen_by(other, use)
        if seen is None or ratio is None or not beyond.size:
            continue
        motion = seen.omega if channel.signal == "omega" else seen.theta
        if motion is None:  # a speed tells of an angle by its integral
            steps = 0.5 * (seen.omega[1:] + seen.omega[:-1]) * np.diff(seen.time)
            motion = np.concatenate(([0.0], np.cumsum(steps)))
        times = recorded.time[np.array([begin[inner], (begin[inner] + end[inner]) // 2, end[inner]])]
        first, middle, last = gain * abs(ratio) * np.interp(times, seen.time, motion)
        if np.median(np.abs(middle - 0.5 * (first + last))) < _SEEN * np.median(beyond):
            return True
    return False


def comes_straight(recorded: RecordedChannel) -> bool:
    """Whether a motion comes to its extremes as if nothing turned it there: what turns it would begin right there."""
    y, step = recorded.values, float(np.median(np.diff(recorded.time)))
    begin, end = _stays(y)
    beside = np.clip((end - begin + 1) // 8, 2, _REACH)
    ways = list[float]()
    for k in range(begin.size):
        sign = 1.0 if y[begin[k]] == np.nanmax(y) else -1.0
        span = step * float(beside[k])
        for at, reach in ((begin[k] - _BESIDE, -beside[k]), (end[k] + _BESIDE, beside[k])):
            if 0 <= at + 2 * reach < y.size:
                near, middle, last = sign * y[[at, at + reach, at + 2 * reach]]
                slope, bent = (near - last) / (2.0 * span), -(near - 2.0 * middle + last) / span**2
                turned = 2.0 * slope / (step * float(end[k] - begin[k]))
                ways.append(bent / turned if turned > 0.0 else np.nan)
    known = np.array([way for way in ways if np.isfinite(way)])
    return bool(known.size) and float(np.median(known)) < _STRAIGHT


def _stays(values: FloatArray) -> tuple[IntArray, IntArray]:
    """Return first and last sample of every stay at an extreme that is long."""
    starts, stops = plateaus(values)
    long = stops - starts >= _LONG
    return starts[long].astype(np.int64), (stops[long] - 1).astype(np.int64)


def _beyond(recorded: RecordedChannel, begin: IntArray, end: IntArray) -> FloatArray:
    """Return how far a motion would have gone on that comes to its extremes, and leaves them, at these speeds."""
    y = recorded.values
    moved = np.abs(y[begin] - y[begin - 2]) + np.abs(y[np.minimum(end + 2, y.size - 1)] - y[end])
    return np.asarray(moved / 4.0 * (end - begin + 1) / 4.0, dtype=np.float64)
