"""A table of numbers, and how a map turns it into a recording: what every import format shares."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import to_si
from friction_ocp.recording.checks import check_recording
from friction_ocp.recording.import_map import Column, ImportMap
from friction_ocp.recording.recording import Channel, FloatArray, Recording


@dataclass(frozen=True)
class Table:
    """Columns of one file, read only where they are wanted."""

    names: tuple[str, ...]
    read: Callable[[Sequence[int]], Mapping[int, FloatArray]]
    """Column indices -> (n,) each, NaN where a cell is empty; raises FrictionOcpError for what is not a number."""


def recording_of(table: Table, import_map: ImportMap, path: Path) -> Recording:
    """Turn the mapped columns into channels in SI units; raises FrictionOcpError with every finding."""
    where = str(path)
    entries = {"time": import_map.time} | {f"channels.{name}": entry for name, entry in import_map.channels.items()}
    found = {
        place: _find_column(table.names, entry, f"{import_map.where}: {place}") for place, entry in entries.items()
    }
    _raise([index for index in found.values() if isinstance(index, Finding)])
    indices = {place: index for place, index in found.items() if isinstance(index, int)}
    columns = table.read(sorted(set(indices.values())))
    values = {
        place: to_si(columns[indices[place]], entry.unit, f"{where}: {place}", scale=entry.scale)
        for place, entry in entries.items()
    }
    time, _ = values["time"]
    with path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    recording = Recording(
        name=path.stem,
        channels={name: Channel(name, time, *values[f"channels.{name}"]) for name in import_map.channels},
        title=import_map.title or path.stem,
        source=import_map.source,
        licence=import_map.licence,
        path=path,
        sha256=sha256,
        attributes={"imported_from": path.name, "imported_sha256": sha256},
    )
    _raise(check_recording(recording, where))
    return recording


def _find_column(names: Sequence[str], column: Column, where: str) -> int | Finding:
    """Return the index of a column, or why it cannot be found."""
    allowed = "columns: " + ", ".join(f"{index} '{name}'" for index, name in enumerate(names))
    if isinstance(column.column, int):
        found = column.column < len(names)
        return column.column if found else Finding(where, f"there is no column {column.column}", allowed)
    matches = [index for index, name in enumerate(names) if name == column.column.strip()]
    if len(matches) > 1:
        return Finding(where, f"{len(matches)} columns are called '{column.column}'", allowed, "give the index")
    return matches[0] if matches else Finding(where, f"there is no column '{column.column}'", allowed)


def _raise(findings: list[Finding]) -> None:
    if findings:
        raise FrictionOcpError(findings)
