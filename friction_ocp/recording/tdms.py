"""LabVIEW TDMS files: channels in groups, waveforms with their own start and step."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.recording.foreign import ForeignFile, Library, Signal, Values, instant, opened, reading, seconds_since
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray

KIND = "a TDMS file"
LIBRARY = Library("nptdms", "npTDMS", "tdms")
_UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit", "Unit")


@contextmanager
def open_tdms(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the channels of a TDMS file as `group/channel`; waveforms have time axes, columns of dates become s."""
    nptdms: Any = LIBRARY.load(path)
    with opened(path, KIND, lambda: nptdms.TdmsFile.open(path)) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        starts = [_start(channel) for channel in channels]
        dates = [int(channel[0].astype("datetime64[ns]").astype(np.int64)) for channel in channels if _is_date(channel)]
        origin = min([*dates, *(start for start in starts if start is not None)], default=0)
        clocks = _clocks(channels)
        by_clock = {name: k for k, name in clocks.items()}

        def read(wanted: Sequence[int]) -> Mapping[int, Values]:
            with reading(path, KIND):
                return {k: _samples(channels[k], origin) for k in wanted}

        def clock(name: str) -> FloatArray:
            k = by_clock[name]
            start = starts[k]
            shift = 0.0 if start is None else (start - origin) * 1e-9
            first = float(channels[k].properties.get("wf_start_offset", 0.0))
            step = float(channels[k].properties["wf_increment"])
            return shift + first + step * np.arange(len(channels[k]), dtype=np.float64)

        signals = tuple(_signal(channel, clocks.get(k, "")) for k, channel in enumerate(channels))
        yield ForeignFile(signals, read, clock, "TDMS", instant(origin))


def _signal(channel: Any, clock: str) -> Signal:
    unit = next((str(channel.properties[key]) for key in _UNIT_KEYS if channel.properties.get(key)), "")
    numeric = channel.dtype is not None and np.dtype(channel.dtype).kind in "biuf"
    name, unit = f"{channel.group_name}/{channel.name}", unit or header_unit(str(channel.name))
    if _is_date(channel):
        return Signal(name, len(channel), "s")
    return Signal(name, len(channel), unit, clock, numeric)


def _clocks(channels: Sequence[Any]) -> dict[int, str]:
    """Return the names of the time axes of waveforms by channel: one for each start, step and length in a group."""
    names: dict[tuple[str, ...], str] = {}
    clocks: dict[int, str] = {}
    for k, channel in enumerate(channels):
        if channel.properties.get("wf_increment"):
            facts = [channel.properties.get(key) for key in ("wf_start_time", "wf_start_offset", "wf_increment")]
            key = (channel.group_name, str(len(channel)), *map(str, facts))
            clocks[k] = names.setdefault(key, f"{channel.group_name} {len(names)}" if names else channel.group_name)
    return clocks


def _start(channel: Any) -> int | None:
    """Return the start of a waveform in ns since 1970, None where it states none."""
    start = channel.properties.get("wf_start_time")
    if start is None or not channel.properties.get("wf_increment"):
        return None
    return int(np.datetime64(start).astype("datetime64[ns]").astype(np.int64))


def _is_date(channel: Any) -> bool:
    return len(channel) > 0 and channel.dtype is not None and np.dtype(channel.dtype).kind == "M"


def _samples(channel: Any, origin: int) -> Values:
    values: Values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        return seconds_since(values.astype("datetime64[ns]").astype(np.int64), origin)
    return values
