"""Rules about when channels show what: a delay longer than a recording leaves nothing to compare."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.errors import Finding
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.problem_file.rules.case import Case, Rule, quantity_text

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


TIMING: tuple[Rule, ...] = (delays_are_shorter_than_recordings,)
