"""A drive at constant speed: what its motors deliver is the sum of all friction, referred to the shaft of the motor.

Generalises eq. 7 of the Leighton telescope paper, T_load = T_rh + R T_rl, to any tree of shafts: elastic
transmissions are stretched, but turn at their ratio.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import casadi as ca

from friction_ocp.drive.kick import Unknown, through_joint, transmitted_torque
from friction_ocp.drive.mechanism import Mechanism, Motion, column, mechanism
from friction_ocp.drive.parts import Drive, Motor, Transmission
from friction_ocp.drive.topology import topology
from friction_ocp.drive.torques import applied_torques

Effort = Literal["torque", "current"]


@dataclass(frozen=True)
class SteadyDrive:
    """What the motors of a drive deliver at constant speed."""

    effort: ca.Function
    """(speed, angle of the reference shaft, numbers) -> torque or current of the motors."""
    parameter_names: tuple[str, ...]
    """The order of the numbers."""


def reference_shaft(drive: Drive) -> str:
    """Return the shaft whose speed steady points state: that of the first motor, else the first one."""
    return drive.motors[0].shaft if drive.motors else drive.shafts[0].name


def steady_speeds(drive: Drive) -> dict[str, float]:
    """Return the speed of every shaft of a drive with plain numbers over that of the reference shaft."""
    stiff = tuple(replace(item, stiffness=None, kinematic_error=None) for item in drive.transmissions)
    joined = topology(replace(drive, transmissions=stiff))
    reference = reference_shaft(drive)
    members = joined.members(joined.group_of[reference])
    return {name: float(joined.speed_ratio[name] / joined.speed_ratio[reference]) for name in members}


def steady_drive(drive: Drive, effort: Effort, placed: bool = False) -> SteadyDrive:
    """Return the effort that each motor's command has at constant speed, so that all together overcome the friction.

    A motor takes its `share` of the command, so that equal motors get their mean. Gravity counts at the angle, and so
    does, where the efforts are `placed` at angles, the wave of a friction over them; other waves average out over whole
    turns, and the drive is as at the start of its warm-up.
    """
    mech = mechanism(_averaged(drive, placed))
    omega, theta = ca.SX.sym("omega"), ca.SX.sym("theta")
    value = _balanced(mech, reference_shaft(drive), effort, omega, theta)
    numbers = column(list(mech.parameters.values()))
    return SteadyDrive(ca.Function("effort", [omega, theta, numbers], [value]), tuple(mech.parameters))


def _averaged(drive: Drive, placed: bool) -> Drive:
    """Return the drive without springs, play, waves, warm-up and anything that is recorded; `placed` keeps ripples."""
    kept = {"warm_up": None} if placed else {"warm_up": None, "ripple": None}
    return replace(
        drive,
        shafts=tuple(replace(item, disturbance=None, friction=replace(item.friction, **kept)) for item in drive.shafts),
        transmissions=tuple(Transmission(item.from_shaft, item.to_shaft, item.ratio) for item in drive.transmissions),
        motors=tuple(replace(item, cogging=None, torque_ripple=None) for item in drive.motors),
        controller=None,
        channels=(),
    )


def _balanced(mech: Mechanism, shaft: str, effort: Effort, omega: ca.SX, theta: ca.SX) -> ca.SX:
    """Return the effort under which nothing accelerates; joints that load friction pass on what is left beyond them."""
    topology = mech.topology
    group, own = topology.group_of[shaft], topology.speed_ratio[shaft]
    groups = len(topology.roots)
    speeds = column([omega / own if g == group else 0.0 for g in range(groups)])
    angles = column([theta / own if g == group else 0.0 for g in range(groups)])
    joints = mech.loaded_joints()
    symbols = ca.SX.sym("unknown", len(joints) + 1)
    load: dict[str, Any] = {joint.name: symbols[k] for k, joint in enumerate(joints)}
    load |= {motor.name: symbols[-1] * _torque(motor, effort) for motor in mech.loading_motors()}
    at = Motion(angles, speeds, ca.SX.zeros(0), ca.SX.zeros(0))
    torques = applied_torques(mech, at, 0.0)
    friction = {
        item.name: item.friction.under(mech.surroundings(item, at)).torque(
            mech.shaft_speed(item.name, at), transmitted_torque(mech, item, load)
        )
        for item in mech.drive.shafts
    }
    resisting = [topology.speed_ratio[name] * (friction[name] - torques[name]) for name in topology.members(group)]
    driving = _driving(mech, group, effort) if mech.drive.motors else {shaft: 1.0}
    per_command = sum(topology.speed_ratio[name] * torque for name, torque in driving.items())
    command = ca.SX(sum(resisting)) / per_command
    if not joints and not mech.loading_motors():
        return command
    driven = {name: torque + symbols[-1] * driving.get(name, 0.0) for name, torque in torques.items()}
    still = ca.SX.zeros(groups)
    found = [through_joint(mech, joint, at, still, driven, friction) for joint in joints]
    return Unknown(symbols, column([*found, command])).solution[-1]


def _driving(mech: Mechanism, group: int, effort: Effort) -> dict[str, Any]:
    """Return the torque of the motors on each shaft of a group for a command of one."""
    torques: dict[str, Any] = {}
    for motor in mech.drive.motors:
        if mech.topology.group_of[motor.shaft] == group:
            torques[motor.shaft] = torques.get(motor.shaft, 0.0) + _torque(motor, effort)
    return torques


def _torque(motor: Motor, effort: Effort) -> Any:
    """Return the torque of a motor for a command of one."""
    return motor.share * (motor.torque_constant if effort == "current" else 1.0)
