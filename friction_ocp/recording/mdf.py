"""ASAM MDF files (version 3 and 4) of vehicle and machine loggers: every channel group has its own time axis."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.recording.foreign import ForeignFile, Library, Signal, Values, opened, reading
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray

KIND = "an MDF file"
LIBRARY = Library("asammdf", "asammdf", "mdf")


@contextmanager
def open_mdf(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the channels of an MDF file; a name that several groups have is followed by its group."""
    asammdf: Any = LIBRARY.load(path)
    with opened(path, KIND, lambda: asammdf.MDF(path)) as file:
        with reading(path, KIND):
            places = [
                (group, index)
                for group, content in enumerate(file.groups)
                for index in range(len(content.channels))
                if index != file.masters_db.get(group)
            ]
            signals = tuple(_signal(file, *place) for place in places)

        def read(wanted: Sequence[int]) -> Mapping[int, Values]:
            with reading(path, KIND):
                return {k: _samples(file, *places[k]) for k in wanted}

        def clock(name: str) -> FloatArray:
            with reading(path, KIND):
                return np.asarray(file.get_master(int(name.removeprefix("group "))), dtype=np.float64)

        yield ForeignFile(signals, read, clock, f"MDF {file.version}", file.start_time.isoformat())


def _signal(file: Any, group: int, index: int) -> Signal:
    content = file.groups[group]
    channel = content.channels[index]
    twice = len(file.channels_db.get(channel.name, ())) > 1
    name = f"{channel.name} (group {group})" if twice else str(channel.name)
    conversion = getattr(channel, "conversion", None)
    unit = str(channel.unit or getattr(conversion, "unit", "") or header_unit(str(channel.name)))
    clock = f"group {group}" if group in file.masters_db else ""
    return Signal(name, int(content.channel_group.cycles_nr), unit, clock, numeric=_is_numeric(file, group, index))


def _is_numeric(file: Any, group: int, index: int) -> bool:
    """Whether the first samples are numbers: texts by conversion, byte arrays and structures are not."""
    if not file.groups[group].channel_group.cycles_nr:
        return True
    try:
        samples = file.get(group=group, index=index, record_offset=0, record_count=1).samples
    except Exception:  # damaged channels are told when they are read
        return True
    return samples.ndim == 1 and samples.dtype.kind in "biuf"


def _samples(file: Any, group: int, index: int) -> Values:
    """Return the physical values of a channel, NaN where the file marks them invalid."""
    found = file.get(group=group, index=index, ignore_invalidation_bits=True)
    bits = getattr(found, "invalidation_bits", None)
    if bits is None or not np.any(bits):
        return np.asarray(found.samples)
    return np.where(np.asarray(bits, dtype=bool), np.nan, np.asarray(found.samples, dtype=np.float64))
