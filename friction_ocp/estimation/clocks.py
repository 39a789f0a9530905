"""Stamps of loggers with clocks of their own, moved onto the clock of the recording as far as that is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from friction_ocp.drive.parts import Clock, Drive
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.parameters import Value, start_of
from friction_ocp.recording.recording import Recording
from friction_ocp.simulation.grid import FloatArray

Moves = Mapping[str, Mapping[str, tuple[float, float]]]
"""By recording and clock: offset, s, and drift."""


def on_one_clock(problem: Problem, moves: Moves | None = None) -> Problem:
    """Return a problem whose stamps are moved by what their clocks are fast by: by their guesses unless stated.

    What is left to be found is small then, as the model expands delays about the moved stamps. Moving again begins from
    the stamps as they were recorded.
    """
    if not problem.drive.clocks:
        return problem

    def moved(use: RecordingUse) -> RecordingUse:
        return _moved(use, problem.drive, _guessed(use, problem.drive) if moves is None else moves[use.name])

    train, validation = (tuple(map(moved, uses)) for uses in (problem.train, problem.validation))
    return replace(problem, train=train, validation=validation)


def _guessed(use: RecordingUse, drive: Drive) -> dict[str, tuple[float, float]]:
    """Return by clock what it is fast by before any fit; what is tied counts as nothing."""
    if use.moved:
        return dict(use.moved)

    def number(clock: Clock, key: str, value: Value) -> float:
        if f"{clock.path}.{key}" in use.set:
            return use.set[f"{clock.path}.{key}"]
        known: Any = start_of(value)
        return float(known) if isinstance(known, (int, float)) else 0.0

    return {
        clock.name: (number(clock, "offset", clock.offset), number(clock, "drift", clock.drift))
        for clock in drive.clocks
    }


def _moved(use: RecordingUse, drive: Drive, fast: Mapping[str, tuple[float, float]]) -> RecordingUse:
    original = use.original or use.recording
    foreign = {channel.name for channel in drive.channels if channel.clock in fast}
    start = log_start(original, drive)
    channels = dict(original.channels)
    for channel in drive.channels:
        if channel.name in foreign and channel.name in channels:
            found, (offset, drift) = channels[channel.name], fast[channel.clock]
            channels[channel.name] = replace(found, time=_shown(found.time, start, offset, drift))
    return replace(use, recording=replace(original, channels=channels), moved=dict(fast), original=original)


def stamped(use: RecordingUse, drive: Drive, name: str, time: float) -> float:
    """Return what the clock of a channel shows at a time of the recording, s: by its guess, where that is another."""
    channel = next((item for item in drive.channels if item.name == name), None)
    fast = _guessed(use, drive)
    if channel is None or channel.clock not in fast:
        return time
    start = log_start(use.recording, drive)
    offset, drift = fast[channel.clock]
    return start + offset + (1.0 + drift) * (time - start)


def log_start(recording: Recording, drive: Drive) -> float:
    """Return when a log began on its own clock, s: from then on others drift, whatever piece of it is used."""
    if recording.log_began is not None:
        return recording.log_began
    foreign = {channel.name for channel in drive.channels if drive.clock_of(channel) is not None}
    own = {name: item for name, item in recording.channels.items() if name not in foreign}
    return replace(recording, channels=own or recording.channels).first_sample


def _shown(time: FloatArray, start: float, offset: float, drift: float) -> FloatArray:
    """Return the time on the clock of the recording for what another clock shows."""
    return start + (time - start - offset) / (1.0 + drift)
