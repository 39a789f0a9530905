"""How inputs are read between their samples: held, or joined by lines. A wrong reading looks like a delay."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.problem import Problem

_DRIVING = ("current", "current_command", "torque", "voltage")


def other_reading(problem: Problem) -> Problem | None:
    """Return the problem with the inputs of its motors read the other way; None where there are none."""
    drive = problem.drive
    read = {item.name: _turned(item) for item in drive.inputs if item.signal in _DRIVING}
    if not read:
        return None
    channels = tuple(read.get(item.name, item) for item in drive.channels)
    return replace(problem, drive=replace(drive, channels=channels))


def _turned(channel: Channel) -> Channel:
    return replace(channel, hold="linear" if channel.hold == "zero" else "zero")


def corrections(stated: Problem, read: Problem) -> list[str]:
    """Return a sentence for every input that is not read as stated."""
    before = {item.name: item.hold for item in stated.drive.channels}
    words = {"zero": "is held between its samples", "linear": "runs in lines from sample to sample"}
    return [
        f"{item.name}: {words[item.hold]}: with `hold: {before[item.name]}` the recordings would need a delay"
        for item in read.drive.channels
        if item.hold != before[item.name]
    ]
