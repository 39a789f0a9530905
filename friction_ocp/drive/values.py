"""Every number of a drive under its path, and the drive with those numbers replaced."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from friction_ocp.drive.parts import Drive
from friction_ocp.parameters import Leaf, bind, leaves


def drive_leaves(drive: Drive) -> Iterator[Leaf]:
    """Yield every number of the drive, named by its path such as `load.friction.tau_c`."""
    for shaft in drive.shafts:
        yield from leaves(shaft, shaft.name, shaft.motion)
    for transmission in drive.transmissions:
        yield from leaves(transmission, transmission.name, drive.shaft(transmission.to_shaft).motion)
    for motor in drive.motors:
        yield from leaves(motor, motor.name, drive.shaft(motor.shaft).motion)
    if drive.controller is not None:
        yield from leaves(drive.controller, "controller")
    for channel in drive.channels:
        yield from leaves(channel, channel.name, _motion_of(drive, channel.part))
    for clock in drive.clocks:
        yield from leaves(clock, clock.path)


def _motion_of(drive: Drive, part: str) -> str:
    for shaft in drive.shafts:
        if shaft.name == part:
            return shaft.motion
    return drive.shafts[0].motion


def bind_drive(drive: Drive, values: Mapping[str, Any]) -> Drive:
    """Return the drive with every number replaced by `values[path]` (floats or SX)."""
    return dataclasses.replace(
        drive,
        shafts=tuple(bind(shaft, shaft.name, values) for shaft in drive.shafts),
        transmissions=tuple(bind(item, item.name, values) for item in drive.transmissions),
        motors=tuple(bind(motor, motor.name, values) for motor in drive.motors),
        controller=None if drive.controller is None else bind(drive.controller, "controller", values),
        channels=tuple(bind(channel, channel.name, values) for channel in drive.channels),
        clocks=tuple(bind(clock, clock.path, values) for clock in drive.clocks),
    )
