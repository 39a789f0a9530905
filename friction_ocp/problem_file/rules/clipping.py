"""Whether a channel ran into the end of its range, and whether what it shows there can be true."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.errors import Finding
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.problem_file.rules.case import Case, Motion, quantity_text
from friction_ocp.problem_file.rules.resting import MOTIONS, comes_straight, is_shown_to_rest
from friction_ocp.recording.conditioning import high_frequency_noise, is_clipped, plateaus
from friction_ocp.recording.recording import Channel as RecordedChannel
from friction_ocp.recording.recording import FloatArray
from friction_ocp.simulation.grid import IntArray

_STRAIGHT = 1e-9
"""Fourth differences of straight ramps and plateaus, as a share of the range: only rounding."""
_AT_LIMIT = 1e-3
"""Distance from a limit of the controller, over their range, of a command that is at it: rounding."""
_CERTAIN = 5.0
"""Standard errors by which the motion must ask for more effort than the record shows; model errors are not white."""
_MATERIAL = 0.1
"""The same as a share of the largest effort."""
_FEW, _MANY = 8, 50
"""Stretches to compare with below which nothing can be said, and into how many a whole recording would be cut."""


def channels_are_not_clipped(case: Case) -> Iterator[Finding]:
    """A measurement does not run into the end of its range.

    Set points are left out, what stays at the stated limits of the controller that commands it, and what rests as
    another channel of the same motion does. An effort at its limits is true where the amplifier is at its limit, which
    the motion tells; an input of nothing but ramps and plateaus may be a command, and a motion that comes straight to
    its extremes may rest there, which is only doubtful.
    """
    for place, use in case.uses():
        for channel in case.drive.channels:
            recorded = use.recording.channels.get(channel.name)
            if recorded is None or _is_command(channel) or not is_clipped(recorded.values):
                continue
            if _limited(case, channel, recorded) or is_shown_to_rest(case, channel, use):
                continue
            low, high = float(np.nanmin(recorded.values)), float(np.nanmax(recorded.values))
            limits = f"{quantity_text(low, recorded.unit)} or {quantity_text(high, recorded.unit)}"
            rests = channel.signal in MOTIONS and comes_straight(recorded)
            limited = channel.role == "input" and (_is_straight(recorded) or _may_be_true(case, channel, use))
            meant = "the machine rested there" if channel.signal == "theta" else "the speed was constant there"
            known = meant if rests else "the amplifier was at its limit" if limited else ""
            left = f"; it may be left as it is if {known}" if known else ""
            yield Finding(
                case.at_recording(place, use),
                f"channel '{channel.name}' is clipped: it stays at its extremes of {limits}",
                remedy=f"record it with a wider range, or cut that part out{left}",
                severity="warning" if known else "error",
            )


def _is_command(channel: Channel) -> bool:
    return channel.part in ("reference", "temperature") or channel.signal in (
        "enable",
        "supply_voltage",
        "current_command",
    )


def _limited(case: Case, channel: Channel, recorded: RecordedChannel) -> bool:
    """Whether a channel shows a controller's command, and every extreme at which it stays is one of its limits."""
    controller = case.bound.controller
    motor = next((item for item in case.bound.motors if item.name == channel.part), None)
    if controller is None or motor is None or controller.saturation is None or channel.signal != controller.output:
        return False
    bound = next(item for item in case.bound.channels if item.name == channel.name)
    limits = [bound.gain * motor.share * limit + bound.offset for limit in controller.saturation]
    starts, _ = plateaus(recorded.values)
    near = max(channel.resolution or 0.0, _AT_LIMIT * abs(limits[1] - limits[0]))
    return all(min(abs(recorded.values[k] - limit) for limit in limits) <= near for k in starts)


def _is_straight(recorded: RecordedChannel) -> bool:
    spread = float(np.nanmax(recorded.values) - np.nanmin(recorded.values))
    return not high_frequency_noise(recorded.time, recorded.values) > _STRAIGHT * spread


def _may_be_true(case: Case, channel: Channel, use: RecordingUse) -> bool:
    """Whether an effort at its limits can be what moved the machine: the motion does not ask for more."""
    motor = next((item for item in case.drive.motors if item.name == channel.part), None)
    if motor is None or channel.signal not in ("current", "torque", "voltage"):
        return False
    motion, recorded = case.motion(motor.shaft, use), use.recording.channels[channel.name]
    return motion is None or not asks_for_more(motion, recorded.time, recorded.values)


def asks_for_more(motion: Motion, time: FloatArray, effort: FloatArray) -> bool:
    """Tell whether a motion needs more effort than was recorded while the record was at its extremes.

    The mean effort of stretches in between is explained by a body with friction and weight: what it gains in speed, and
    the means of speed, of its sign and of sine and cosine of the angle. Where the record is cut off, that asks for
    more; where the amplifier is at its limit, for what is there.
    """
    present = np.isfinite(effort)
    applied = np.interp(motion.time, time[present], effort[present])
    begin, end, side = _stretches(applied)
    free = side == 0.0
    span = motion.time[end] - motion.time[begin]

    def mean(rate: FloatArray) -> FloatArray:
        total = np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(motion.time))))
        return (total[end] - total[begin]) / span

    angle = np.zeros_like(motion.omega) if motion.theta is None else motion.theta
    terms = (motion.omega, np.sign(motion.omega), np.ones_like(angle), np.sin(angle), np.cos(angle))
    columns = np.column_stack([(motion.omega[end] - motion.omega[begin]) / span, *map(mean, terms)])
    needed = mean(applied)
    if np.count_nonzero(free) < _FEW or free.all() or not np.all(np.isfinite(columns)):
        return False
    scales = np.maximum(np.linalg.norm(columns[free], axis=0), 1e-300)
    factors = np.asarray(np.linalg.lstsq(columns[free] / scales, needed[free])[0], dtype=np.float64) / scales
    errors: FloatArray = columns @ factors - needed
    spread = float(np.sqrt(np.mean(errors[free] ** 2)))
    more: FloatArray = (side * errors)[~free]
    certain = float(np.mean(more)) > _CERTAIN * spread / np.sqrt(more.size)
    return bool(certain and np.mean(more) > _MATERIAL * np.max(np.abs(applied)))


def _stretches(values: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Return first and last sample of stretches, and at which extreme they stay: 1, -1, or 0 for those in between.

    Those in between are as long as the median of the others; or shorter, where there would be few.
    """
    starts, stops = plateaus(values)
    longest = max(values.size // _MANY, 1)
    length = min(int(np.median(stops - starts)) + 1, longest) if starts.size else longest
    last, at = values.size - 1, 0
    found = list[tuple[int, int, float]]()
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        begin = max(start - 1, at)
        found += [(k, k + length, 0.0) for k in range(at, begin - length + 1, length)]
        at = min(stop, last)
        found.append((begin, at, 1.0 if values[start] == np.max(values) else -1.0))
    found += [(k, k + length, 0.0) for k in range(at, last - length + 1, length)]
    begins, ends, sides = zip(*found, strict=True)
    return np.array(begins), np.array(ends), np.array(sides)
