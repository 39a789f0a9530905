"""How a map turns the signals of a foreign file into a recording: what every import format shares."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import to_si
from friction_ocp.recording.checks import check_recording, check_static_points
from friction_ocp.recording.conditioning import without_low_pass
from friction_ocp.recording.counters import looks_like_counter, unroll
from friction_ocp.recording.foreign import EXACT_INTEGERS, ForeignFile, Signal, Values, check_sizes, is_real
from friction_ocp.recording.import_map import Column, ImportMap
from friction_ocp.recording.recording import Channel, FloatArray, Recording
from friction_ocp.recording.sampling import first_of_each
from friction_ocp.recording.static_points import StaticPoints


@dataclass(frozen=True)
class _Wanted:
    """One entry of the map with the signal that it names."""

    place: str
    entry: Column
    index: int
    signal: Signal
    unit: str


def recording_of(file: ForeignFile, import_map: ImportMap, path: Path) -> Recording:
    """Turn the mapped signals into channels in SI units; raises FrictionOcpError with every finding."""
    wanted = _wanted(file, import_map)
    values, origin = _read(file, wanted, path)
    channels = _channels(file, import_map, wanted, values)
    recording = Recording(channels=channels, **_provenance(import_map, path, _origin(file, origin)))
    _raise(check_recording(recording, str(path)))
    return recording


def static_points_of(file: ForeignFile, import_map: ImportMap, path: Path) -> StaticPoints:
    """Turn the mapped columns into static points in SI units; raises FrictionOcpError with every finding."""
    found, _ = _read(file, _wanted(file, import_map), path)
    columns = {place.removeprefix("points."): column for place, column in found.items()}
    values = {name: column[0] for name, column in columns.items()}
    units = {name: column[1] for name, column in columns.items()}
    points = StaticPoints(units=units, **values, **_provenance(import_map, path))
    _raise(check_static_points(points, str(path)))
    return points


def _read(
    file: ForeignFile, wanted: Mapping[str, _Wanted], path: Path
) -> tuple[dict[str, tuple[FloatArray, str]], int]:
    """Return values in SI and their unit by place, and from where times count, ns; raises all findings together."""
    check_sizes(path, [item.signal for item in wanted.values()])
    raw = file.read(sorted({item.index for item in wanted.values()}))
    origin = _far_origin([(raw[item.index], item) for place, item in wanted.items() if _is_time(place)])
    findings: list[Finding] = []
    values: dict[str, tuple[FloatArray, str]] = {}
    for place, item in wanted.items():
        try:
            values[place] = _converted(raw[item.index], item, origin if _is_time(place) else 0, path)
        except FrictionOcpError as error:
            findings += error.findings
    _raise(findings)
    return values, origin


def _provenance(import_map: ImportMap, path: Path, more: Mapping[str, str] = {}) -> dict[str, Any]:
    """Return what recordings and static points say of where they come from."""
    sha256 = _fingerprint(path)
    return {
        "name": path.stem,
        "title": import_map.title or path.stem,
        "source": import_map.source,
        "licence": import_map.licence,
        "path": path,
        "sha256": sha256,
        "attributes": {"imported_from": path.name, "imported_sha256": sha256, **more},
    }


def _is_time(place: str) -> bool:
    return place == "time" or place.endswith(".time")


def _wanted(file: ForeignFile, import_map: ImportMap) -> dict[str, _Wanted]:
    """Return what the map names by its place there; raises FrictionOcpError for what cannot be found or has no unit."""
    entries = {} if import_map.time is None else {"time": import_map.time}
    for name, entry in import_map.channels.items():
        entries[f"channels.{name}"] = entry
        if entry.time is not None:
            entries[f"channels.{name}.time"] = entry.time
    entries |= {f"points.{name}": entry for name, entry in import_map.points.items()}
    findings: list[Finding] = []
    wanted: dict[str, _Wanted] = {}
    for place, entry in entries.items():
        where = f"{import_map.where}: {place}"
        index = _find(file.signals, entry, where)
        if isinstance(index, Finding):
            findings.append(index)
            continue
        signal = file.signals[index]
        findings += _faults(signal, entry, where)
        wanted[place] = _Wanted(place, entry, index, signal, entry.unit or signal.unit)
    findings += _without_time(import_map, wanted)
    _raise(findings)
    return wanted


def _find(signals: Sequence[Signal], column: Column, where: str) -> int | Finding:
    """Return the index of a signal, or why it cannot be found."""
    shown = [f"{index} '{signal.name}'" for index, signal in enumerate(signals)]
    allowed = "columns: " + ", ".join(shown[:40]) + (f", and {len(shown) - 40} more" if len(shown) > 40 else "")
    if isinstance(column.column, int):
        found = column.column < len(signals)
        return column.column if found else Finding(where, f"there is no column {column.column}", allowed)
    matches = [index for index, signal in enumerate(signals) if signal.name == column.column.strip()]
    if len(matches) > 1:
        return Finding(where, f"{len(matches)} columns are called '{column.column}'", allowed, "give the index")
    return matches[0] if matches else Finding(where, f"there is no column '{column.column}'", allowed)


def _faults(signal: Signal, entry: Column, where: str) -> list[Finding]:
    if not signal.numeric:
        return [Finding(where, f"'{signal.name}' holds no numbers", "a column of numbers", "name another one")]
    if not entry.unit and not signal.unit:
        return [Finding(where, f"there is no unit, and the file states none for '{signal.name}'", "{column, unit}")]
    if entry.unit and signal.unit and entry.instead_of != signal.unit and not _same(entry, signal.unit):
        what = f"the unit is '{entry.unit}', but the file says '{signal.unit}' of '{signal.name}'"
        remedy = f"leave the unit out, or confirm it with instead_of: {signal.unit}"
        return [Finding(where, what, "the unit of the file", remedy)]
    return []


def _same(entry: Column, stated: str) -> bool:
    """Whether the unit of the map is that of the file in another spelling; counts know no other unit."""
    if entry.scale is not None:
        return stated in ("count", "counts", "1", "-")
    try:
        (mine, kind), (theirs, other) = (to_si((1.0, 2.0), unit) for unit in (entry.unit, stated))
    except FrictionOcpError:
        return False
    return kind == other and bool(np.array_equal(mine, theirs))


def _without_time(import_map: ImportMap, wanted: Mapping[str, _Wanted]) -> list[Finding]:
    if import_map.time is not None or import_map.step is not None:
        return []
    lost = [
        (name, item)
        for name, entry in import_map.channels.items()
        if entry.time is None
        and (item := wanted.get(f"channels.{name}")) is not None
        and item.signal.numeric
        and not item.signal.clock
    ]
    remedy = "name the column of the times, time: {column, unit}, or their step, time: {step: 1 ms} or {rate: 1000 Hz}"
    return [
        Finding(f"{import_map.where}: channels.{name}", f"the file gives '{item.signal.name}' no times", "", remedy)
        for name, item in lost
    ]


def _far_origin(times: Sequence[tuple[Values, _Wanted]]) -> int:
    """Return the earliest instant, ns, of far time axes where one of them is too large for floats; else 0."""
    if not any(raw.dtype.kind in "iu" and raw.size and int(raw[0]) > EXACT_INTEGERS for raw, _ in times):
        return 0
    firsts = (_first_instant(raw, _nanoseconds(item)) for raw, item in times)
    return min((first for first in firsts if first > EXACT_INTEGERS), default=0)


def _nanoseconds(item: _Wanted) -> Fraction:
    """Return how long one count of a time axis is, ns; 0 where its unit is none of time."""
    try:
        size, unit = to_si(1.0, item.unit, scale=item.entry.scale)
    except FrictionOcpError:
        return Fraction(0)
    return Fraction(f"{float(size) * 1e9:.15g}") if unit == "s" else Fraction(0)


def _first_instant(raw: Values, nanoseconds: Fraction) -> int:
    """Return the first instant of a time axis in whole ns; 0 where it has none."""
    seen = raw[np.isfinite(raw)] if is_real(raw) else raw[:0]
    return math.floor(Fraction(seen[0].item()) * nanoseconds) if seen.size else 0


def _since(raw: Values, origin: int, nanoseconds: Fraction) -> FloatArray:
    """Return a time axis that counts from `origin`, ns, in its own unit; one that is not far counts from its own."""
    if _first_instant(raw, nanoseconds) <= EXACT_INTEGERS:
        return np.asarray(raw, dtype=np.float64)
    whole, rest = divmod(Fraction(origin), nanoseconds)
    exact = raw if raw.dtype.kind in "iu" else np.asarray(raw, dtype=np.float64)
    return np.asarray(exact - exact.dtype.type(whole), dtype=np.float64) - float(rest / nanoseconds)


def _converted(raw: Values, item: _Wanted, origin: int, path: Path) -> tuple[FloatArray, str]:
    """Return values in SI, counters unrolled."""
    where = f"{path}: {item.place}"
    if not is_real(raw):
        raise FrictionOcpError(Finding(where, f"'{item.signal.name}' holds no real numbers but {raw.dtype}"))
    counted = _since(raw, origin, _nanoseconds(item)) if origin else np.asarray(raw, dtype=np.float64)
    if _is_time(item.place) and item.entry.wrap is None and item.entry.reset is None:
        _refuse_turnover(counted, item, where)
    values = unroll(counted, item.entry.wrap, item.entry.reset, where)
    if item.entry.held is not None:
        values = first_of_each(values, int(item.entry.held), where)
    converted, unit = to_si(values, item.unit, where, scale=item.entry.scale)
    if _is_time(item.place) and unit != "s":
        raise FrictionOcpError(Finding(where, f"'{item.signal.name}' is in {item.unit}", "a unit such as s, ms or us"))
    return converted, unit


def _refuse_turnover(counted: FloatArray, item: _Wanted, where: str) -> None:
    counter = looks_like_counter(counted)
    if counter is not None:
        at = counter.samples[0]
        what = f"'{item.signal.name}' starts over at sample {at} ({counted[at]:.10g} after {counted[at - 1]:.10g})"
        raise FrictionOcpError(Finding(where, what, "times that only grow", f"state `wrap: {counter.turn:.10g}`"))


def _channels(
    file: ForeignFile,
    import_map: ImportMap,
    wanted: Mapping[str, _Wanted],
    values: Mapping[str, tuple[FloatArray, str]],
) -> dict[str, Channel]:
    """Give every channel its values and its time axis; equal axes are one clock, the first of them `time`."""
    values = _without_empty_rows(import_map, values)
    axes: dict[str, FloatArray] = {}
    if import_map.time is not None and any(entry.time is None for entry in import_map.channels.values()):
        axes["time"] = values["time"][0]
    channels: dict[str, Channel] = {}
    for name, entry in import_map.channels.items():
        signal = wanted[f"channels.{name}"].signal
        if entry.time is not None:
            label, time = wanted[f"channels.{name}.time"].signal.name, values[f"channels.{name}.time"][0]
        elif import_map.time is not None:
            label, time = "time", values["time"][0]
        elif import_map.step is not None:
            rows = values[f"channels.{name}"][0].size
            label, time = "time", np.asarray(import_map.step * np.arange(rows), dtype=np.float64)
        else:
            label, time = signal.clock, file.clock(signal.clock)
        clock = next((known for known, axis in axes.items() if axis is time or np.array_equal(axis, time)), None)
        if clock is None:
            clock = _clock_name(label, axes) if axes else "time"
            axes[clock] = time
        series, unit = values[f"channels.{name}"]
        if entry.low_pass is not None:
            series = without_low_pass(axes[clock], series, entry.low_pass)
        channels[name] = Channel(name, axes[clock], series, unit, clock=clock)
    return channels


def _without_empty_rows(
    import_map: ImportMap, values: Mapping[str, tuple[FloatArray, str]]
) -> dict[str, tuple[FloatArray, str]]:
    """Leave out where a time axis of the map and all that stands over it have no number: other channels go on there."""
    users = {f"channels.{name}.time": [f"channels.{name}"] for name in import_map.channels}
    users["time"] = [f"channels.{name}" for name, entry in import_map.channels.items() if entry.time is None]
    result = dict(values)
    for time, channels in users.items():
        places = [time, *channels] if time in values else []
        if len({values[place][0].size for place in places}) == 1:
            kept = np.any([np.isfinite(values[place][0]) for place in places], axis=0)
            result |= {place: (values[place][0][kept], values[place][1]) for place in places}
    return result


def _clock_name(label: str, taken: Mapping[str, FloatArray]) -> str:
    """Return a name for a time axis that fits into an HDF5 path and is not taken."""
    plain = re.sub(r"[^\w.-]+", "_", label).strip("_.") or "clock"
    names = (plain, *(f"{plain}_{k}" for k in range(2, len(taken) + 3)))
    return next(name for name in names if name not in taken)


def _origin(file: ForeignFile, origin: int) -> dict[str, str]:
    """Return from when the times count, where they have been shifted."""
    text = str(origin) if origin else file.origin
    return {"time_origin": text} if text else {}


def _fingerprint(path: Path) -> str:
    """Return the SHA-256 of a file, or of all files of a folder in the order of their names."""
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    digests = [f"{item.name} {_fingerprint(item)}" for item in sorted(path.iterdir()) if item.is_file()]
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _raise(findings: list[Finding]) -> None:
    if findings:
        raise FrictionOcpError(findings)
