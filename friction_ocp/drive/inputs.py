"""The inputs of a drive: what is recorded, and what the terms of the drive need beside that."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca

from friction_ocp.drive.parts import Channel, Drive, Shaft
from friction_ocp.drive.topology import Topology
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.parameters import is_off

TIME = "/time"
"""The input that holds the time since the start of the recording, s, in drives that depend on it: the name of the
time axis in the file, which no channel can have."""


def input_symbols(drive: Drive, structure: Topology) -> dict[str, ca.SX]:
    """Return a symbol for every input: channels, time derivatives of prescribed motion as `<name>'`, and the time.

    Raises FrictionOcpError where a live term lacks what it needs.
    """
    inputs: dict[str, ca.SX] = {}
    for channel in drive.inputs:
        for order in range(1 + _derivatives(channel, drive, structure)):
            name = channel.name + order * "'"
            inputs[name] = ca.SX.sym(name)
    if any(_depends_on_time(shaft) for shaft in drive.shafts) or any(map(drive.clock_of, drive.outputs)):
        inputs[TIME] = ca.SX.sym(TIME)
    if findings := list(warm_up_faults(drive)):
        raise FrictionOcpError(findings)
    return inputs


def _derivatives(channel: Channel, drive: Drive, structure: Topology) -> int:
    """Return how many time derivatives of an input the drive needs: a speed, and an acceleration where it is seen."""
    if channel not in drive.prescribing:
        return 0
    accelerated = structure.group_of[channel.part] in _seen_groups(drive, structure)
    return (channel.signal == "theta") + accelerated


def _seen_groups(drive: Drive, structure: Topology) -> set[int]:
    """Return the groups of which an output sees the acceleration, or a torque that depends on it."""
    shaft_of = {motor.name: motor.shaft for motor in drive.motors}
    seen: set[int] = set()
    for channel in drive.outputs:
        if channel.part in structure.group_of and channel.signal in ("alpha", DRIVE_TORQUE):
            seen.add(structure.group_of[channel.part])
        elif channel.part in shaft_of and channel.signal in ("torque", "current"):
            seen.add(structure.group_of[shaft_of[channel.part]])
    return seen


def _depends_on_time(shaft: Shaft) -> bool:
    warm_up = shaft.friction.warm_up
    return shaft.disturbance is not None or (warm_up is not None and warm_up.amplitude is not None)


def warm_up_faults(drive: Drive) -> Iterator[Finding]:
    """Yield what is missing for friction that follows a temperature or settles with time."""
    measured = any(channel.measures == "temperature" for channel in drive.inputs)
    for shaft in drive.shafts:
        warm_up = shaft.friction.warm_up
        if warm_up is None:
            continue
        where = f"{shaft.name}.friction.warm_up"
        if not is_off(warm_up.per_kelvin) and not measured:
            what = "friction depends on the temperature, which no input channel measures"
            remedy = "add a channel with measures: temperature, or leave per_kelvin out"
            yield Finding(f"{where}.per_kelvin", what, "0 without it", remedy)
        if is_off(warm_up.amplitude):
            continue
        if warm_up.time_constant is None:
            yield Finding(f"{where}.time_constant", "this key is missing", "s, in which the amplitude is approached")
        if not is_off(warm_up.loss_share) and warm_up.power is None:
            yield Finding(f"{where}.power", "this key is missing", "W lost in friction that warm it by the amplitude")


def moved_from_behind(drive: Drive, structure: Topology) -> Iterator[Finding]:
    """Yield the inputs that prescribe the motion of a shaft behind a rigid joint with a kinematic error."""
    for channel in drive.prescribing:
        if any(joint.kinematic_error is not None for joint, _ in structure.path[channel.part]):
            root = structure.roots[structure.group_of[channel.part]]
            what = f"{channel.measures} is prescribed behind a rigid joint with a kinematic error"
            yield Finding(f"channels.{channel.name}", what, f"{root}.{channel.signal}", "or state a stiffness")
