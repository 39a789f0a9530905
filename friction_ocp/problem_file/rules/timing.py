"""Rules about when channels show what: outputs are compared while the inputs that move the machine are known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.errors import Finding
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.problem_file.rules.case import Case, Rule, quantity_text
from friction_ocp.recording.doubts import AT_ENDS, end_texts
from friction_ocp.recording.recording import Channel as RecordedChannel
from friction_ocp.recording.sampling import known_span

_MUCH = 0.5
"""Share of the time of a channel that a delay may move out of the recording before it is doubted."""


def delays_are_shorter_than_recordings(case: Case) -> Iterator[Finding]:
    """Once delays and clocks are taken back, outputs are seen while inputs drive the machine."""
    told: set[str] = set()
    driving = [channel for channel in case.drive.inputs if channel.is_driving]
    for (_, use), output, channel in product(case.uses(), case.drive.outputs, driving):
        one, other = _span(case, use, output), _span(case, use, channel)
        if one is None or other is None:
            continue
        length = min(one[1] - one[0], other[1] - other[0])
        common = max(min(one[1], other[1]) - max(one[0], other[0]), 0.0)
        shifts = {**_shifts(case, output), **_shifts(case, channel)}
        path = max(shifts, key=lambda path: abs(shifts[path]), default="")
        if common < (1.0 - _MUCH) * length and shifts.get(path) and path not in told:
            told.add(path)
            what = (
                f"{case.written(path)} leaves {_seconds(common)} of {_seconds(length)} in which both "
                f"'{output.name}' and '{channel.name}' are recorded in {use.name}"
            )
            remedy = "convert it if it is in ms, or correct its sign"
            severity = "error" if common == 0.0 else "warning"
            where = case.at(case.place(path))
            yield Finding(where, what, "a time in s, shorter than the recordings", remedy, severity)


def inputs_are_known_throughout(case: Case) -> Iterator[Finding]:
    """What moves the machine is recorded from the first sample of the outputs to the last; delays are stated."""
    for place, use in case.uses():
        seen = [_on_one_clock(case, use, channel) for channel in case.drive.outputs]
        times = [item.time for item in seen if item is not None and item.time.size]
        if not times:
            continue
        begin, end = min(float(time[0]) for time in times), max(float(time[-1]) for time in times)
        for channel in case.drive.inputs:
            recorded = _on_one_clock(case, use, channel) if channel.is_driving else None
            if recorded is None:
                continue
            last = known_span(recorded.time[np.isfinite(recorded.values)], channel.hold == "zero")[1]
            for text, remedy in end_texts(recorded, begin, end if end > last else -np.inf):
                yield Finding(case.at_recording(place, use), text, AT_ENDS, remedy, "warning")


def _on_one_clock(case: Case, use: RecordingUse, channel: Channel) -> RecordedChannel | None:
    """Return a channel as recorded, its stamps moved by the offset of its clock; None where they are not in order."""
    recorded = use.recording.channels.get(channel.name)
    if recorded is None or recorded.time.shape != recorded.values.shape or not np.all(np.diff(recorded.time) > 0):
        return None
    clock = case.drive.clock_of(channel)
    offset = 0.0 if clock is None else case.numbers[f"{clock.path}.offset"]
    return replace(recorded, time=recorded.time - offset) if np.isfinite(offset) and offset else recorded


def _span(case: Case, use: RecordingUse, channel: Channel) -> tuple[float, float] | None:
    """Return when what a channel shows began and ended, s; for inputs, when it acts."""
    recorded = use.recording.channels.get(channel.name)
    if recorded is None or recorded.time.size < 2 or not np.all(np.diff(recorded.time) > 0):
        return None
    shift = sum(_shifts(case, channel).values())
    return float(recorded.time[0]) + shift, float(recorded.time[-1]) + shift


def _shifts(case: Case, channel: Channel) -> dict[str, float]:
    """Return what moves the samples of a channel in time, s, by the path of the number that does."""
    clock = case.drive.clock_of(channel)
    early = [f"{channel.name}.delay", *([f"{clock.path}.offset"] if clock is not None else [])]
    late = [f"{motor.name}.dead_time" for motor in case.drive.motors if motor.name == channel.part]
    signs = {**dict.fromkeys(early, -1.0), **dict.fromkeys(late if channel.role == "input" else [], 1.0)}
    return {path: sign * case.numbers[path] for path, sign in signs.items() if np.isfinite(case.numbers[path])}


def _seconds(time: float) -> str:
    return quantity_text(float(f"{time:.3g}"), "s")


TIMING: tuple[Rule, ...] = (delays_are_shorter_than_recordings, inputs_are_known_throughout)
