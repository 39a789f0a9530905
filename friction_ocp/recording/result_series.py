"""Measured and simulated series of a result, and the estimated states, by recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from friction_ocp.errors import Finding
from friction_ocp.recording.recording import FloatArray


@dataclass(frozen=True)
class ChannelSeries:
    """One channel as recorded and as the free-running simulation has it."""

    time: FloatArray
    """(n,) s."""
    measured: FloatArray
    """(n,) in `unit`; NaN where a sample is missing."""
    simulated: FloatArray
    """(n,) in `unit`."""
    unit: str = ""


@dataclass(frozen=True)
class StateSeries:
    """The estimated states on one time axis."""

    time: FloatArray
    """(n,) s."""
    values: Mapping[str, FloatArray]
    """(n,) for each state, such as "motor.omega"."""
    units: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class RecordingSeries:
    """All series of one recording."""

    channels: Mapping[str, ChannelSeries]
    states: StateSeries | None = None


Datasets = Mapping[tuple[str, str, str], tuple[FloatArray, str]]
"""Values and unit by recording, channel (or "states") and column."""


def datasets_of(series: Mapping[str, RecordingSeries]) -> Datasets:
    """Lay series out as a file holds them."""
    datasets: dict[tuple[str, str, str], tuple[FloatArray, str]] = {}
    for recording, content in series.items():
        for name, channel in content.channels.items():
            datasets[recording, name, "time"] = (channel.time, "s")
            datasets[recording, name, "measured"] = (channel.measured, channel.unit)
            datasets[recording, name, "simulated"] = (channel.simulated, channel.unit)
        if content.states is not None:
            datasets |= {
                (recording, "states", name): (values, content.states.units.get(name, ""))
                for name, values in content.states.values.items()
            }
            datasets[recording, "states", "time"] = (content.states.time, "s")
    return datasets


def series_of(datasets: Datasets, where: str) -> tuple[dict[str, RecordingSeries], list[Finding]]:
    """Gather series from the layout of `datasets_of`, and report what is incomplete."""
    findings: list[Finding] = []
    channels: dict[str, dict[str, ChannelSeries]] = {recording: {} for recording, _, _ in datasets}
    states: dict[str, StateSeries] = {}
    for recording, name in dict.fromkeys((recording, name) for recording, name, _ in datasets):
        columns = {key[2]: found for key, found in datasets.items() if key[:2] == (recording, name)}
        needed = ("time",) if name == "states" else ("time", "measured", "simulated")
        missing = [column for column in needed if column not in columns]
        if missing:
            findings.append(Finding(where, f"/{recording}/{name} has no {' and no '.join(missing)}"))
        elif name == "states":
            time, _ = columns.pop("time")
            values = {key: found[0] for key, found in columns.items()}
            states[recording] = StateSeries(time, values, {key: found[1] for key, found in columns.items()})
        else:
            time, measured, simulated = (columns[column][0] for column in needed)
            channels[recording][name] = ChannelSeries(time, measured, simulated, columns["measured"][1])
    return {name: RecordingSeries(found, states.get(name)) for name, found in channels.items()}, findings
