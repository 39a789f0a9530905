"""Rules about the recordings: what they hold, in what unit, and whether it can be true."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.drive.units import DRIVE_TORQUE, SHAFT_SIGNALS, signal_unit
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import RecordingUse, StaticUse
from friction_ocp.expressions import closest
from friction_ocp.problem_file.rules.case import Case, Rule, quantity_text
from friction_ocp.problem_file.rules.clipping import channels_are_not_clipped
from friction_ocp.problem_file.rules.power import sign_of_work
from friction_ocp.quantities import si_unit
from friction_ocp.recording.checks import check_recording
from friction_ocp.recording.conditioning import FEWEST_SAMPLES
from friction_ocp.recording.doubts import turnover_text
from friction_ocp.recording.recording import FloatArray


def recordings_are_sound(case: Case) -> Iterator[Finding]:
    """Time rises, and no channel is empty, infinite or all NaN."""
    for place, use in case.uses():
        yield from check_recording(use.recording, case.at_recording(place, use))


def recordings_have_names_of_their_own(case: Case) -> Iterator[Finding]:
    """Results are filed by the name of the recording, and a held-out recording is not trained on."""
    first: dict[str, tuple[str, str]] = {}
    for place, use in (*case.uses(), *case.static_uses()):
        file = str(_path(use) or use.name)
        other, other_file = first.setdefault(use.name, (place, file))
        if other == place:
            continue
        where = case.at(f"{place}: {file}")
        if file != other_file:
            yield Finding(where, f"'{use.name}' is also the name of {other}", remedy="rename one of the files")
        else:
            what = f"this file also stands in {other}"
            yield Finding(where, what, remedy="validate on a recording that is not trained on", severity="warning")


def pieces_share_nothing(case: Case) -> Iterator[Finding]:
    """No sample counts twice, and none that is held out is trained on, where pieces of one log are used."""
    outputs = [channel.name for channel in case.drive.outputs]
    known = list[tuple[str, RecordingUse, float, float]]()
    for place, use in case.uses():
        there = [use.recording.channels[name].time for name in outputs if name in use.recording.channels]
        times = np.concatenate([time for time in there if time.size] or [np.empty(0)])
        if not times.size or use.recording.path is None:
            continue
        begin, end = float(np.min(times)), float(np.max(times))
        for other, piece, first, last in known:
            shared = min(end, last) - max(begin, first)
            if piece.recording.path == use.recording.path and piece.name != use.name and shared >= 0.0:
                what = f"{quantity_text(shared, 's')} of this piece also stand in {other}"
                remedy = "begin it where the other ends, or end it where that begins"
                yield Finding(case.at_recording(place, use), what, remedy=remedy, severity="warning")
        known.append((place, use, begin, end))


def _path(use: RecordingUse | StaticUse) -> Path | None:
    return use.recording.path if isinstance(use, RecordingUse) else use.points.path


def outputs_have_enough_samples(case: Case) -> Iterator[Finding]:
    """At least one output of every recording has samples enough to tell the motion from."""
    for place, use in case.uses():
        there = [use.recording.channels.get(channel.name) for channel in case.drive.outputs]
        counts = [int(np.count_nonzero(np.isfinite(item.values))) for item in there if item is not None]
        if counts and 0 < max(counts) < FEWEST_SAMPLES:
            what = f"no output has more than {max(counts)} samples"
            remedy = "record or import more of it"
            yield Finding(case.at_recording(place, use), what, f"at least {FEWEST_SAMPLES}", remedy)


def outputs_move(case: Case) -> Iterator[Finding]:
    """What is compared changes in at least one training recording, or the machine stood still all the time."""
    for channel in case.drive.outputs:
        level = _only_level(case, channel)
        if level is not None and _pooled(case, channel).size > 1:
            what = f"output '{channel.name}' never moves: it is {level} throughout all training recordings"
            remedy = "record motion, or correct which column of the log it is"
            yield Finding(case.at(f"channels.{channel.name}"), what, remedy=remedy, severity="warning")


def recordings_have_the_channels(case: Case) -> Iterator[Finding]:
    """Every channel of the problem is in every recording."""
    for place, use in case.uses():
        there = list(use.recording.channels)
        for channel in case.drive.channels:
            if channel.name not in there:
                what = f"the recording has no channel '{channel.name}'"
                allowed = f"it has {', '.join(there)}"
                yield Finding(case.at_recording(place, use), what, allowed, closest(channel.name, there))


def units_fit_signals(case: Case) -> Iterator[Finding]:
    """A channel is recorded in a unit of what it measures."""
    for where, channel, recorded in case.recorded():
        try:
            expected = signal_unit(case.drive, channel.measures)
        except FrictionOcpError:
            continue
        if recorded.unit != expected:
            what = f"channel '{channel.name}' is in {recorded.unit}, but {channel.measures} is in {expected}"
            allowed = f"a unit that converts to {expected}"
            remedy = "correct the unit in the recording, or measures"
            yield Finding(where, what, allowed, _if_moving_otherwise(case, channel, recorded.unit) or remedy)


def _if_moving_otherwise(case: Case, channel: Channel, unit: str) -> str:
    """Return the remedy where a unit is that of a shaft that moves in a line instead of turning, or the reverse."""
    motion = next((shaft.motion for shaft in case.drive.shafts if shaft.name == channel.part), None)
    kind = SHAFT_SIGNALS.get(channel.signal)
    if motion is None or kind is None:
        return ""
    other = "rotary" if motion == "linear" else "linear"
    words = f"state `motion: {other}` at shaft '{channel.part}' if that is how it moves, or correct the unit"
    return words if unit == si_unit(kind, other) else ""


def inputs_move(case: Case) -> Iterator[Finding]:
    """What drives the machine changes in at least one training recording."""
    driving = [channel for channel in case.drive.inputs if channel.is_driving]
    still = {channel.name: level for channel in driving if (level := _only_level(case, channel)) is not None}
    for name, level in still.items():
        what = f"input '{name}' never moves: it is {level} throughout all training recordings"
        alone = len(still) == len(driving)
        remedy = "record an excitation, or correct which channel is the input"
        yield Finding(case.at(f"channels.{name}"), what, remedy=remedy, severity="error" if alone else "warning")


def motors_are_enabled(case: Case) -> Iterator[Finding]:
    """A motor that is never enabled does not turn."""
    for channel in case.drive.inputs:
        present = _pooled(case, channel)
        if channel.signal == "enable" and present.size and not bool(np.any(present > 0.5)):
            what = f"'{channel.name}' never exceeds 0.5: motor '{channel.part}' is never enabled"
            yield Finding(case.at(f"channels.{channel.name}"), what, "1 while the motor is driven, 0 while not")


def _only_level(case: Case, channel: Channel) -> str | None:
    """Return the value that an input always has, None where it moves or is not there."""
    present = _pooled(case, channel)
    if not present.size or float(np.ptp(present)) > 1e-9 * float(np.max(np.abs(present))):
        return None
    unit = next(recorded.unit for _, other, recorded in case.recorded() if other is channel)
    return quantity_text(float(present[0]), unit)


def _pooled(case: Case, channel: Channel) -> FloatArray:
    names = [use.recording.channels.get(channel.name) for use in case.problem.train]
    values = [recorded.values[np.isfinite(recorded.values)] for recorded in names if recorded is not None]
    return np.concatenate(values) if values else np.empty(0)


def angles_do_not_start_over(case: Case) -> Iterator[Finding]:
    """No angle loses a full turn of its counter from one sample to the next."""
    for where, channel, recorded in case.recorded():
        found = case.turnover(recorded) if channel.signal == "theta" else None
        if found is not None:
            remedy = "import it again with `wrap` in its map, which --inspect of the log tells, or unroll it"
            yield Finding(where, turnover_text(recorded, found), "an angle goes on past a full turn", remedy)


def current_and_motion_agree(case: Case) -> Iterator[Finding]:
    """The recorded power can be that of a body with friction: it would not be if a sign were wrong."""
    if len(case.drive.motors) != 1:
        return
    motor = case.drive.motors[0]
    sign = float(np.sign(case.numbers.get(f"{motor.name}.torque_constant", 1.0)))
    for channel in case.drive.channels:
        if channel.part == motor.name and channel.signal in ("current", "torque", "voltage"):
            yield from _turned_round(case, channel, motor.shaft, sign)


def drive_torque_and_motion_agree(case: Case) -> Iterator[Finding]:
    """What moves a body with friction does work on it: it would not if a sign were wrong."""
    for channel in case.drive.outputs:
        if channel.signal == DRIVE_TORQUE:
            yield from _turned_round(case, channel, channel.part, 1.0)


def _turned_round(case: Case, channel: Channel, shaft: str, sign: float) -> Iterator[Finding]:
    """Yield the recordings in which an effort fits the motion of a shaft only with its sign turned round.

    The sign is the same in all of them: where another recording fits only as it is, what is odd is that recording.
    """
    weights = [item.name for item in case.drive.shafts if item.gravity is not None]
    gain, offset = (case.numbers[f"{channel.name}.{key}"] for key in ("gain", "offset"))
    signs = dict[str, int]()
    for place, use in case.uses():
        motion, recorded = case.motion(shaft, use, rigidly=True), use.recording.channels.get(channel.name)
        if motion is None or recorded is None or not gain:
            continue
        heavy = [seen for name in weights if (seen := case.motion(name, use)) is not None]
        effort = sign * (recorded.values - offset) / gain
        signs[case.at_recording(place, use)] = sign_of_work(motion, recorded.time, effort, heavy)
    fits_elsewhere = 1 in signs.values()
    for where, found in signs.items():
        if found < 0:
            what = f"channel '{channel.name}' and the motion of shaft '{shaft}' have opposite signs"
            allowed = "a positive torque accelerates in the positive direction"
            remedy = f"set the gain of '{channel.name}' to -1, or correct the sign of the position"
            if fits_elsewhere:
                allowed, remedy = "they agree in other recordings", "look whether this one is what it says"
            yield Finding(where, what, allowed, remedy, "warning" if fits_elsewhere else "error")


NAMES: tuple[Rule, ...] = (recordings_have_names_of_their_own, pieces_share_nothing)
RECORDINGS: tuple[Rule, ...] = (
    recordings_are_sound,
    recordings_have_the_channels,
    units_fit_signals,
    channels_are_not_clipped,
    angles_do_not_start_over,
    motors_are_enabled,
    inputs_move,
    outputs_have_enough_samples,
    outputs_move,
    current_and_motion_agree,
    drive_torque_and_motion_agree,
)
