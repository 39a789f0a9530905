"""What a recording has to be, whichever file it came from: one rule a function, each returning its findings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import dimension_of
from friction_ocp.recording.recording import FloatArray, Recording
from friction_ocp.recording.result_series import RecordingSeries, datasets_of
from friction_ocp.recording.static_points import StaticPoints


def check_time(where: str, label: str, time: FloatArray) -> list[Finding]:
    """Time is finite and strictly increasing, with at least two samples."""
    if time.ndim != 1:
        return [Finding(where, f"{label} has the shape {time.shape}", "one value per sample")]
    if len(time) < 2:
        samples = "1 sample" if len(time) == 1 else "no samples"
        return [Finding(where, f"{label} has {samples}", "at least 2 are needed")]
    bad = np.flatnonzero(~np.isfinite(time))
    if len(bad):
        what = f"{label} is not finite at sample {bad[0]} ({len(bad)} of {len(time)} samples)"
        return [Finding(where, what, remedy="remove these samples")]
    bad = np.flatnonzero(np.diff(time) <= 0.0) + 1
    if len(bad):
        after, before = time[bad[0]], time[bad[0] - 1]
        text = f"{after:.4f} s after {before:.4f} s"
        if after != before and f"{after:.4f}" == f"{before:.4f}":
            text = f"{after!s} s after {before!s} s"
        more = f", and at {len(bad) - 1} more" if len(bad) > 1 else ""
        what = f"{label} is not increasing at sample {bad[0]} ({text}){more}"
        return [Finding(where, what, remedy="fix or split the recording")]
    return []


def check_values(where: str, label: str, values: FloatArray, samples: int, axis: str = "time") -> list[Finding]:
    """Values are as many as their time axis has samples, never infinite, and not all missing."""
    if values.ndim != 1:
        return [Finding(where, f"{label} has the shape {values.shape}", "one value per sample")]
    findings: list[Finding] = []
    if len(values) != samples:
        what = f"{label} has {len(values)} samples, but {axis} has {samples}"
        findings.append(Finding(where, what, "one value per time, NaN where a sample is missing"))
    infinite = np.flatnonzero(np.isinf(values))
    if len(infinite):
        what = f"{label} is infinite at sample {infinite[0]} ({len(infinite)} of {len(values)} samples)"
        findings.append(Finding(where, what, remedy="write NaN for a missing sample"))
    if len(values) and bool(np.all(np.isnan(values))):
        what = f"{label} has no value: all {len(values)} samples are NaN"
        findings.append(Finding(where, what, remedy="remove the channel or import it again"))
    return findings


def check_recording(recording: Recording, where: str) -> list[Finding]:
    """Everything a recording needs before it is used or written; its units are taken to be SI."""
    if not recording.channels:
        return [Finding(where, "there are no channels", "at least one under /channels")]
    findings: list[Finding] = []
    clocks: dict[str, FloatArray] = {}
    for name, channel in recording.channels.items():
        clock = clocks.setdefault(channel.clock, channel.time)
        if clock is channel.time:
            continue
        if not np.array_equal(clock, channel.time):
            what = f"channel '{name}' has another time axis than the other channels of clock '{channel.clock}'"
            findings.append(Finding(where, what, "one time axis per clock", "give the channel a clock of its own"))
    for clock, time in clocks.items():
        findings += check_time(where, "time" if clock == "time" else f"clock '{clock}'", time)
    for name, channel in recording.channels.items():
        axis = "time" if channel.clock == "time" else f"its clock '{channel.clock}'"
        findings += check_values(where, f"channel '{name}'", channel.values, channel.time.size, axis)
    return findings


def check_static_points(points: StaticPoints, where: str) -> list[Finding]:
    """Static points have speed and torque or current, one value per point, in units that belong together."""
    columns = points.columns
    findings: list[Finding] = []
    if "torque" not in columns and "current" not in columns:
        findings.append(Finding(where, "there is neither /torque nor /current", "one of them beside /speed"))
    for name, values in columns.items():
        findings += check_values(where, f"/{name}", values, points.speed.size, "/speed")
        if name not in points.units:
            findings.append(Finding(where, f"/{name} has no unit", remedy=f"state the unit of '{name}'"))
    for name, unit in points.units.items():
        allowed = _allowed_units(name, points)
        if name in columns and unit not in allowed:
            findings.append(Finding(where, f"/{name} is in {unit}", f"a unit that converts to {' or '.join(allowed)}"))
    return findings


def _allowed_units(column: str, points: StaticPoints) -> tuple[str, ...]:
    """SI units of a column; those of a rotary or of a linear drive, as the unit of its speed says."""
    linear = points.units.get("speed") == "m/s"
    torque = "N" if linear else "N m"
    return {
        "speed": ("rad/s", "m/s"),
        "torque": (torque,),
        "current": ("A",),
        "std_error": (torque,) if points.torque is not None else ("A",),
        "position": ("m",) if linear else ("rad",),
    }.get(column, ("1",))


def check_series(series: Mapping[str, RecordingSeries], where: str) -> list[Finding]:
    """Each series has one value per time; no channel is called states, no state is called time."""
    findings = _check_names(series, where)
    for content in series.values():
        states: list[str] = [] if content.states is None else list(content.states.values)
        findings += _check_names([*content.channels, *states], where)
        if "states" in content.channels:
            findings.append(Finding(where, "a channel is called 'states'", "the group of the states", "rename it"))
        if "time" in states:
            findings.append(Finding(where, "a state is called 'time'", "the time axis of the states", "rename it"))
    for (recording, name, column), (values, _) in (datasets := datasets_of(series)).items():
        samples = datasets[recording, name, "time"][0].size
        if values.size != samples:
            what = f"{recording}/{name}/{column} has {values.size} samples, but its time has {samples}"
            findings.append(Finding(where, what, "one value per time"))
    return findings


def check_written_names(recording: Recording, where: str) -> list[Finding]:
    """Names fit into an HDF5 path, and units and attributes can be read again."""
    findings = check_attributes(recording.attributes, where)
    for name, channel in recording.channels.items():
        findings += _check_names([name, channel.clock], where)
        try:
            dimension_of(channel.unit, f"{where}: channel '{name}'")
        except FrictionOcpError as error:
            findings += error.findings
    return findings


def check_attributes(attributes: Mapping[str, str], where: str) -> list[Finding]:
    """Further attributes leave the names of the format alone."""
    reserved = [key for key in attributes if key in ("format", "title", "source", "licence")]
    return [Finding(where, f"attribute '{key}' has a place of its own", remedy="rename it") for key in reserved]


def _check_names(names: Iterable[str], where: str) -> list[Finding]:
    bad = [name for name in names if not name or "/" in name or "\0" in name or name == "."]
    return [Finding(where, f"'{name}' cannot be a name", "text without a slash", "rename it") for name in bad]
