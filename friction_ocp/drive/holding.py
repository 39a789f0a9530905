"""What it takes to make a shaft move as prescribed: the torque of a tribometer or a dynamometer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from friction_ocp.drive.mechanism import Mechanism, Motion
from friction_ocp.drive.motors import torque_ripple_factor
from friction_ocp.drive.parts import Channel, Motor
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.friction.static import NoFriction


def holding_torques(
    mech: Mechanism, at: Motion, acceleration: ca.SX, torques: Mapping[str, Any], friction: Mapping[str, Any]
) -> dict[int, Any]:
    """Return the torque that each group with a prescribed motion needs, on its first shaft.

    It is what accelerates the inertias of the group and overcomes its friction, less what other torques do:
    tau = J alpha + friction - torques.
    """
    holding: dict[int, Any] = {}
    for group in mech.prescribed:
        members = mech.topology.members(group)
        resisting = sum(mech.speed_ratio(name, at) * (friction[name] - torques[name]) for name in members)
        inertial = mech.inertia(group, at) * acceleration[group] + mech.inertial_torque(group, at)
        holding[group] = inertial + resisting
    return holding


def drive_torque(mech: Mechanism, shaft: str, at: Motion, holding: Mapping[int, Any]) -> Any:
    """Return the holding torque of the group of a shaft, applied to that shaft."""
    return holding[mech.topology.group_of[shaft]] / mech.speed_ratio(shaft, at)


def holding_effort(mech: Mechanism, motor: Motor, at: Motion, holding: Mapping[int, Any], signal: str) -> Any:
    """Return the torque, or the current, with which a motor makes the motion of its shaft what it is.

    Motors that nothing else drives share the torque by their `share`.
    """
    group = mech.topology.group_of[motor.shaft]
    helpers = [
        item
        for item in mech.drive.motors
        if mech.topology.group_of[item.shaft] == group and mech.drive.driving_signal(item) is None
    ]
    together = sum(mech.speed_ratio(item.shaft, at) * item.share for item in helpers)
    torque = holding[group] * motor.share / together
    return torque if signal == "torque" else torque / (motor.torque_constant * torque_ripple_factor(mech, motor, at))


def undetermined_at_rest(mech: Mechanism) -> dict[int, str]:
    """Return the outputs that a rest leaves open, each with the input that tells the speed.

    Dry friction without presliding takes any torque up to its level there, so that no sample can contradict it.
    """
    found: dict[int, str] = {}
    for k, channel in enumerate(mech.drive.outputs):
        group = _held_group(mech, channel)
        if group is None:
            continue
        shafts = [mech.drive.shaft(name) for name in mech.topology.members(group)]
        if any(not item.friction.law.has_bristle and not isinstance(item.friction.law, NoFriction) for item in shafts):
            source = _source(mech, group)
            found[k] = source.name + ("'" if source.signal == "theta" else "")
    return found


def prescribed_accelerations(mech: Mechanism) -> dict[int, str]:
    """Return the outputs that see a prescribed acceleration, each with the input that it is the derivative of."""
    found: dict[int, str] = {}
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part) if channel.signal == "alpha" else _held_group(mech, channel)
        if group in mech.prescribed:
            found[k] = _source(mech, group).name
    return found


def _source(mech: Mechanism, group: int) -> Channel:
    """Return the input that prescribes the motion of a group."""
    return next(item for item in mech.drive.inputs if mech.topology.group_of.get(item.part) == group)


def _held_group(mech: Mechanism, channel: Channel) -> int | None:
    """Return the group whose holding torque a channel sees; None where it sees something else."""
    if channel.signal == DRIVE_TORQUE:
        return mech.topology.group_of[channel.part]
    motor = next((item for item in mech.drive.motors if item.name == channel.part), None)
    if motor is None or channel.signal not in ("torque", "current") or mech.drive.driving_signal(motor) is not None:
        return None
    group = mech.topology.group_of[motor.shaft]
    return group if group in mech.prescribed else None
