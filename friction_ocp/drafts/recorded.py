"""What the recordings of a folder measure, as far as names and units tell."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.drafts.axis import Axis
from friction_ocp.drive.coordinates import ORDERS
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.hdf5 import read_either
from friction_ocp.recording.recording import Recording

_REFERENCE = re.compile(
    r"goal|ref|target|set_?point|desired|demand|wanted|command|cmd|soll|error|schlepp|abweichung|fehler|deviation",
    re.IGNORECASE,
)
"""Set points, and what is left to them: no sensor of the machine."""
_SHORT_REFERENCE = frozenset({"set", "sp", "err"})
"""The same as words of a name, not as parts of words: an offset, a spindle and a ferrite bear them, too."""
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_SUPPLY = re.compile(r"supply|bus|battery|dc_?link", re.IGNORECASE)
_ENABLE = re.compile(r"enable", re.IGNORECASE)
_MOTOR = re.compile(r"motor|rotor|input", re.IGNORECASE)
_VALIDATION = re.compile(r"valid|check|test|hold_?out", re.IGNORECASE)
_TAKEN = re.compile(r"fric|drag|tang|torque|drive", re.IGNORECASE)
_SIGNALS = {"rad": "theta", "rad/s": "omega", "rad/s^2": "alpha", "m": "theta", "m/s": "omega", "m/s^2": "alpha"}
_EFFORTS = {"A": "current", "N m": "torque", "N": "torque", "V": "voltage"}


@dataclass(frozen=True)
class Recorded:
    """The recordings of a folder, and what their common channels measure."""

    train: tuple[Path, ...]
    validation: tuple[Path, ...]
    channels: Mapping[str, Mapping[str, Any]]
    """Section `channels` of a draft."""
    driven_by: str
    """current, torque, voltage, or the motion itself."""
    left_out: tuple[str, ...]
    """Channels whose meaning is not told by name and unit, or that a draft does not need."""
    sizes: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """What the recordings tell about the axis of a test bench: whether it is linear, its friction and inertia."""
    unread: tuple[Finding, ...] = ()
    """What is wrong with files of the folder that are no recordings, or spoilt ones."""


def recordings_of(folder: Path, axis: Axis) -> Recorded:
    """Read the recordings of a folder; raises FrictionOcpError where there are none or nothing drives the axis."""
    if not folder.is_dir():
        raise FrictionOcpError(Finding(str(folder), "there is no such folder", "a folder with recordings (.h5)"))
    found, spoilt = _read_all(folder)
    if not found:
        remedy = "turn logs into recordings with friction-ocp import"
        raise FrictionOcpError([*spoilt, Finding(str(folder), "there are no recordings", "*.h5", remedy)])
    units = _common(found)
    sizes: dict[str, Any] = {}
    if axis.held:
        channels, driven_by = _held_channels(units, axis, folder), "motion"
        sizes = _sizes(found[0][1], channels)
    else:
        channels, driven_by = _channels(units, axis, folder)
    train, validation = _split([path for path, _ in found])
    left_out = tuple(sorted({name for _, item in found for name in item.channels} - channels.keys()))
    return Recorded(train, validation, channels, driven_by, left_out, sizes, tuple(spoilt))


def _read_all(folder: Path) -> tuple[list[tuple[Path, Recording]], list[Finding]]:
    found: list[tuple[Path, Recording]] = []
    findings: list[Finding] = []
    for path in sorted(folder.glob("*.h5")):
        try:
            item = read_either(path)
        except FrictionOcpError as error:
            findings += error.findings
            continue
        if isinstance(item, Recording):
            found.append((path, item))
    return found, findings


def _common(found: Sequence[tuple[Path, Recording]]) -> dict[str, str]:
    """Return the units of the channels that all recordings have, in the order of the first."""
    first = found[0][1].channels
    shared = [name for name in first if all(name in item.channels for _, item in found)]
    return {name: first[name].unit for name in shared}


def _channels(units: Mapping[str, str], axis: Axis, folder: Path) -> tuple[dict[str, dict[str, Any]], str]:
    force = "N" if axis.linear and axis.motor_inertia is None else "N m"
    able = {unit: signal for unit, signal in _EFFORTS.items() if signal != "torque" or unit == force}
    efforts = [(name, able[unit]) for name, unit in units.items() if unit in able and not _SUPPLY.search(name)]
    if not efforts:
        what = f"no channel drives the motor: they are {_listed(units)}"
        remedy = (
            "write a controller and its reference into the problem, as in problems/xl330, or take the template "
            "test_bench where the force or torque that a motion takes was measured"
        )
        raise FrictionOcpError(Finding(str(folder), what, f"a current (A), torque ({force}) or voltage (V)", remedy))
    measured = [item for item in efforts if not _is_reference(item[0])] or efforts
    order = ("current", "torque", "voltage")
    driving, driven_by = min(measured, key=lambda item: order.index(item[1]))
    channels: dict[str, dict[str, Any]] = {driving: {"measures": f"motor.{driven_by}", "role": "input"}}
    for name, unit in units.items():
        if unit in _SIGNALS and not _is_reference(name) and _fits(unit, axis):
            channels[name] = {"measures": f"{_shaft(name, unit, axis)}.{_SIGNALS[unit]}"}
        elif unit == "degC":
            channels[name] = {"measures": "temperature", "role": "input"}
        elif unit == "1" and _ENABLE.search(name):
            channels[name] = {"measures": "motor.enable", "role": "input", "hold": "zero"}
    if not any(item["measures"].split(".")[-1] in ORDERS for item in channels.values()):
        what = f"no channel sees the motion: they are {_listed(units)}"
        raise FrictionOcpError(Finding(str(folder), what, "an angle, a speed or an acceleration"))
    return channels, driven_by


def _held_channels(units: Mapping[str, str], axis: Axis, folder: Path) -> dict[str, dict[str, Any]]:
    """Return the motion, the speed before the angle, as what drives a test bench, and the effort as what it takes."""
    motions = [(name, _SIGNALS[unit]) for name, unit in units.items() if unit in ("rad/s", "m/s", "rad", "m")]
    moved = min((item for item in motions if not _is_reference(item[0])), key=lambda item: item[1], default=None)
    force = "N m" if moved is None or units[moved[0]].startswith("rad") else "N"
    efforts = sorted((name for name, unit in units.items() if unit == force), key=lambda name: not _TAKEN.search(name))
    if moved is None or not efforts:
        what = f"a motion and what it takes are not both there: they are {_listed(units)}"
        raise FrictionOcpError(Finding(str(folder), what, "an angle or a speed, and a torque; for a length, a force"))
    return {
        moved[0]: {"measures": f"{axis.load}.{moved[1]}", "role": "input"},
        efforts[0]: {"measures": f"{axis.load}.drive_torque"},
    }


def _sizes(recording: Recording, channels: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return what a test bench is like: friction as large as the effort, an inertia that takes a tenth of it."""
    motion, effort = (recording.channels[name] for name in channels)
    moves = motion.unit.endswith("/s")
    speed = motion.values if moves else np.gradient(motion.values, motion.time)
    way = np.cumsum(np.nan_to_num(speed) * np.gradient(motion.time)) if moves else motion.values
    level = float(np.nanmedian(np.abs(effort.values))) or 1.0
    fast = float(np.nanquantile(np.abs(speed), 0.9)) or 1.0
    quick = fast**2 / (0.5 * float(np.nanmax(way) - np.nanmin(way)) or 1.0)
    return {
        "linear": motion.unit.startswith("m"),
        "tau_c": level,
        "viscous": 0.1 * level / fast,
        "load_inertia": 0.1 * level / quick,
    }


def _is_reference(name: str) -> bool:
    """Whether a name is that of a set point, or of the deviation from one."""
    return bool(_REFERENCE.search(name)) or any(word.lower() in _SHORT_REFERENCE for word in _WORD.findall(name))


def _listed(units: Mapping[str, str]) -> str:
    return ", ".join(f"{name} ({unit})" for name, unit in units.items())


def _fits(unit: str, axis: Axis) -> bool:
    """Whether some shaft of the axis moves in this unit."""
    linear = unit.startswith("m")
    return axis.linear if linear else (not axis.linear or axis.motor_inertia is not None)


def _shaft(name: str, unit: str, axis: Axis) -> str:
    """Return the shaft that a channel looks at: the one in its name, else the motor's."""
    if axis.motor_inertia is None or (axis.linear and unit.startswith("m")):
        return axis.load
    if axis.linear or _MOTOR.search(name):
        return "motor"
    told = re.compile(rf"{re.escape(axis.load)}|load|output|link|joint|table|axis|arm", re.IGNORECASE)
    return axis.load if told.search(name) else "motor"


def _split(paths: Sequence[Path]) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Return training and validation recordings: by their names, else every fourth, at least the last of several."""
    named = [path for path in paths if _VALIDATION.search(path.stem)]
    if not named or len(named) == len(paths):
        named = [path for k, path in enumerate(paths) if k % 4 == 3] or list(paths[1:][-1:])
    return tuple(path for path in paths if path not in named), tuple(named)
