"""Rules about numbers that a slip of a unit makes: stated noise, what two sensors say of one motion, time axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.errors import Finding
from friction_ocp.estimation.noise import noise_floor
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.problem_file.rules.case import Case, Motion, Rule, quantity_text
from friction_ocp.quantities import si_unit
from friction_ocp.recording.conditioning import detect_resolution, high_frequency_noise
from friction_ocp.recording.doubts import (
    ACROSS_GAPS,
    AS_NEW,
    AS_TRUE,
    gap_texts,
    missing,
    repeats,
    repeats_text,
    strays_text,
)
from friction_ocp.recording.recording import Channel as RecordedChannel
from friction_ocp.recording.recording import FloatArray

_SLIP = 10.0
"""Factor by which stated noise and what samples scatter differ for other reasons than a unit: slow noise, vibration."""
_LITTLE = 0.01
"""Noise over the standard deviation of a signal up to which it is nothing odd, be it filtered out of sight."""
_NONE = 1e-6
"""Scatter over stated noise below which the samples carry no noise at all; no unit is off by as much."""
_RATIO_SLIP = 2.0
"""Factor between two sensors of one motion that no guess of a ratio is off by."""
_MORE = 1.2
"""Scatter in every recording over what rounding makes, from which a sensor has noise besides."""
_ALIKE = 0.9
"""Correlation of speeds from which two sensors see one motion."""
_APART = 0.5
"""Correlation of speeds below which two sensors see no one motion, where both show one: noise does not hide it."""
_MOVES = 10.0
"""Swing of a signal over its noise from which it shows a motion."""
_SELDOM = 0.5
"""Sampling interval, s, at which hardly any drive is recorded."""


def stated_noise_is_seen(case: Case) -> Iterator[Finding]:
    """The noise that the file states is that of the samples, give or take; only the slow part of it is not seen."""
    for channel in case.drive.channels:
        if channel.noise_std is None:
            continue
        records = _records(case, channel)
        seen = [high_frequency_noise(item.time, item.values) for item in records]
        known = [value for value in seen if np.isfinite(value) and value > _NONE * channel.noise_std]
        if not known:
            continue
        scatter, unit = float(np.median(known)), records[0].unit
        largest = max([scatter, *_steps(records)])
        swing = max(float(np.nanstd(item.values)) for item in records)
        slipped = channel.noise_std > max(_SLIP * largest, _LITTLE * swing)
        slipped |= channel.signal == "theta" and channel.noise_std < scatter / _SLIP
        if slipped:
            stated = quantity_text(channel.noise_std, unit)
            what = f"stated noise {stated}, but the samples scatter by {scatter:.2g} {unit} about a smooth curve"
            allowed = f"standard deviation in {unit}, whatever the unit in the file was"
            where = case.at(f"channels.{channel.name}.noise_std")
            yield Finding(where, what, allowed, "convert it, or leave it out: it is measured then", "warning")


def resolution_is_seen(case: Case) -> Iterator[Finding]:
    """Values lie on the grid of the resolution that the file states, not on a finer one."""
    for channel in case.drive.channels:
        if channel.resolution is None:
            continue
        records = _records(case, channel)
        steps = _steps(records)
        if not steps or channel.resolution <= _RATIO_SLIP * min(steps):
            continue
        unit = records[0].unit
        stated = quantity_text(channel.resolution, unit)
        what = f"stated resolution {stated}, but the samples are on steps of {min(steps):.3g} {unit}"
        where = case.at(f"channels.{channel.name}.resolution")
        remedy = "convert it, or leave it out: it is measured then"
        yield Finding(where, what, f"the step in {unit}", remedy, "warning")


def rounding_is_the_noise(case: Case) -> Iterator[Finding]:
    """Where the file states a resolution and no noise, the samples scatter as rounding makes them, and no more."""
    for channel in case.drive.outputs:
        if channel.resolution is None or channel.noise_std is not None:
            continue
        records = _records(case, channel)
        seen = [high_frequency_noise(item.time, item.values) for item in records]
        known = [value for value in seen if np.isfinite(value)]
        rounding = noise_floor(channel, []).std
        if not known or min(known) <= _MORE * rounding:
            continue
        unit, scatter = records[0].unit, float(np.median(known))
        what = f"the samples scatter by {scatter:.2g} {unit}, more than the {rounding:.2g} {unit} of their resolution"
        where = case.at(f"channels.{channel.name}.resolution")
        remedy = f"state `noise_std: {scatter:.2g}` beside it, or all above the resolution is taken for a gap"
        yield Finding(where, what, "resolution / sqrt(12), unless noise_std is stated", remedy, "warning")


def _records(case: Case, channel: Channel) -> list[RecordedChannel]:
    """Return a channel in all recordings that have it."""
    return [recorded for _, other, recorded in case.recorded() if other is channel]


def _steps(records: Sequence[RecordedChannel]) -> list[float]:
    """Return the steps on which values lie, of the recordings where they lie on some."""
    return [step for item in records if (step := detect_resolution(item.values)) is not None]


def sensors_of_one_motion_agree(case: Case) -> Iterator[Finding]:
    """What two sensors see of shafts that are joined differs by the stated ratio."""
    seeing = [channel for channel in case.drive.channels if channel.signal in ("theta", "omega")]
    for first, second in combinations(seeing, 2):
        known = case.ratio(first.part, second.part)
        if known is None:
            continue
        found = [_factor(case, first, second, known, use) for _, use in case.uses()]
        factors = [factor for factor in found if factor is not None]
        if not factors:
            continue
        factor = float(np.median(factors))
        if 1.0 / _RATIO_SLIP <= factor <= _RATIO_SLIP:
            continue
        expected = "the ratios in the file say" if first.part != second.part else "one shaft has it"
        seen, stated = f"{factor / known:.3g} times as far as '{first.name}'", f"{1.0 / known:.3g} times as {expected}"
        what = f"'{second.name}' moves {seen}, not {stated}"
        allowed = "ratio: speed of the first shaft over that of the second, in rad/m where the second moves in a line"
        remedy = "correct the ratio or its sign, or the unit, scale or sign of one of the two"
        yield Finding(case.at(f"channels.{second.name}"), what, allowed, remedy, "warning")


def _factor(case: Case, first: Channel, second: Channel, ratio: float, use: RecordingUse) -> float | None:
    """Return the speed that one sensor shows over what another and the ratio say; None where they see no one motion."""
    moved = case.seen_by(first, use)
    shown = None if moved is None else case.seen_by(second, use)
    if moved is None or shown is None:
        return None
    known = _at(moved.through(1.0 / ratio), shown.time)
    power = float(known @ known), float(shown.omega @ shown.omega)
    if not min(power) > 0.0:
        return None
    product = float(known @ shown.omega)
    return product / power[0] if abs(product) > _ALIKE * np.sqrt(power[0] * power[1]) else None


def sensors_of_one_shaft_see_one_motion(case: Case) -> Iterator[Finding]:
    """Of shafts that are joined rigidly all sensors show the same motion, whatever their units and signs."""
    seeing = [channel for channel in case.drive.outputs if channel.signal in ("theta", "omega")]
    for first, second in combinations(seeing, 2):
        if case.topology.group_of.get(first.part) != case.topology.group_of.get(second.part):
            continue
        found = [_likeness(case, first, second, use) for _, use in case.uses()]
        alike = [value for value in found if value is not None]
        if alike and max(alike) < _APART:
            names = f"'{second.name}' and '{first.name}'"
            what = f"{names} see no one motion: their speeds correlate by {max(alike):.2f} at most"
            allowed = "sensors of one shaft, or of shafts that are joined rigidly"
            remedy = "leave out what is no sensor of it, such as a following error, or correct its clock or delay"
            yield Finding(case.at(f"channels.{second.name}"), what, allowed, remedy, "warning")


def _likeness(case: Case, first: Channel, second: Channel, use: RecordingUse) -> float | None:
    """Return the correlation of the speeds that two sensors show, without sign; None where noise may hide it."""
    one, other = case.seen_by(first, use), case.seen_by(second, use)
    recorded = [use.recording.channels.get(channel.name) for channel in (first, second)]
    if one is None or other is None or not all(item is not None and _moves(item) for item in recorded):
        return None
    known = _at(one, other.time)
    size = float(np.linalg.norm(known) * np.linalg.norm(other.omega))
    return abs(float(known @ other.omega)) / size if size > 0.0 else None


def _moves(recorded: RecordedChannel) -> bool:
    return float(np.nanstd(recorded.values)) > _MOVES * high_frequency_noise(recorded.time, recorded.values)


def _at(motion: Motion, time: FloatArray) -> FloatArray:
    return np.interp(time, motion.time, motion.omega, left=0.0, right=0.0)


def samples_come_often_enough(case: Case) -> Iterator[Finding]:
    """A time axis in milliseconds, taken for seconds, makes a drive a thousand times slower than it is."""
    for place, use in case.uses():
        channels = [item for item in use.recording.channels.values() if item.time.size > 1]
        intervals = [float(np.median(np.diff(item.time))) for item in channels]
        if intervals and min(intervals) > _SELDOM:
            what = f"a sample every {quantity_text(min(intervals), si_unit('time'))}"
            where = case.at_recording(place, use)
            yield Finding(where, what, "time in s", "correct the time axis if it is in ms", "warning")


def samples_have_no_gaps(case: Case) -> Iterator[Finding]:
    """Where a recording was interrupted, nobody knows what drove the machine; held inputs may come when they change.

    Where outputs alone are missing, it is known.
    """
    driving = [channel.name for channel in case.drive.inputs if channel.hold == "linear"]
    seeing = [channel.name for channel in case.drive.outputs]
    for place, use in case.uses():
        names = [item.name for item in case.drive.channels if item.name in use.recording.channels]
        found = {name: missing(use.recording.channels[name]) for name in names}
        lost = {gap for name in driving for gap in found.get(name, ())}
        interrupted = [name for name, own in found.items() if not lost.isdisjoint(own)]
        for text in gap_texts(use.recording.channels[name] for name in interrupted):
            remedy = "split the recording there if the machine moved meanwhile"
            yield Finding(case.at_recording(place, use), text, ACROSS_GAPS, remedy, "warning")
        alone = [name for name in seeing if name in found and name not in interrupted]
        blind = "; ".join(gap_texts(use.recording.channels[name] for name in alone))
        if blind:
            yield Finding(case.at_recording(place, use), blind, "nothing is compared there", severity="warning")


def samples_are_not_repeated(case: Case) -> Iterator[Finding]:
    """Values that a slower logger held until its next one are not new measurements; a held command is one."""
    for where, channel, recorded in case.recorded():
        count = repeats(recorded) if channel.role == "output" or channel.hold == "linear" else None
        if count is not None:
            held = (
                "state `hold: zero` if it is a command that the drive holds, else " if channel.role == "input" else ""
            )
            remedy = f"{held}import it again with `held: {count}` in its map, or make the repeats NaN"
            yield Finding(where, repeats_text(recorded, count), AS_NEW, remedy, "warning")


def samples_stay_on_course(case: Case) -> Iterator[Finding]:
    """No few samples are codes of errors or lost frames; a robust loss bears them, but of outputs alone."""
    robust = case.problem.estimation.loss != "squares"
    for where, channel, recorded in case.recorded():
        told = None if robust and channel.role == "output" else strays_text(recorded)
        if told is not None:
            remedy = "make these samples NaN"
            remedy += ", or state `loss: huber` in the section estimation" if channel.role == "output" else ""
            yield Finding(where, told, AS_TRUE, remedy, "warning")


PLAUSIBILITY: tuple[Rule, ...] = (
    stated_noise_is_seen,
    resolution_is_seen,
    rounding_is_the_noise,
    sensors_of_one_motion_agree,
    sensors_of_one_shaft_see_one_motion,
    samples_come_often_enough,
    samples_have_no_gaps,
    samples_are_not_repeated,
    samples_stay_on_course,
)
