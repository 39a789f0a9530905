"""The torques on the shafts of a drive other than friction and what rigid joints transmit."""

from __future__ import annotations

from typing import Any

import casadi as ca

from friction_ocp.drive.mechanism import TIME, Mechanism, Motion, symbol
from friction_ocp.drive.motors import cogging_torque, motor_torque
from friction_ocp.drive.parts import Shaft, Transmission
from friction_ocp.friction.smoothing import soft_threshold, where


def applied_torques(mech: Mechanism, motion: Motion, corner: Any) -> dict[str, Any]:
    """Return the torque on every shaft other than friction and torque through rigid joints."""
    torques = {shaft.name: _external_torque(mech, shaft, motion) for shaft in mech.drive.shafts}
    for item in mech.topology.elastic:
        exerted = elastic_torque(mech, item, motion, corner)
        torques[item.to_shaft] = torques[item.to_shaft] + exerted
        torques[item.from_shaft] = torques[item.from_shaft] - exerted / item.ratio
    for motor in mech.drive.motors:
        made = motor_torque(mech, motor, motion) + cogging_torque(mech, motor, motion)
        torques[motor.shaft] = torques[motor.shaft] + made
    return torques


def _external_torque(mech: Mechanism, shaft: Shaft, motion: Motion) -> Any:
    torque: Any = ca.SX(0.0)
    if shaft.gravity is not None:
        angle = mech.shaft_angle(shaft.name, motion) + shaft.gravity.phase
        torque = torque - shaft.gravity.torque * ca.sin(ca.SX(angle))
    if shaft.external_torque is not None:
        torque = torque + shaft.external_torque.constant
    if shaft.disturbance is not None:
        torque = torque + shaft.disturbance.value(mech.inputs[TIME], motion.h)
    return torque


def elastic_torque(mech: Mechanism, item: Transmission, motion: Motion, corner: Any) -> Any:
    """Return the torque that an elastic transmission exerts on its output shaft.

    Backlash is a dead zone of the twist whose corners are rounded by `corner` times the free play; the
    damper acts while the flanks touch.
    """
    twist = mech.shaft_angle(item.from_shaft, motion) / item.ratio - mech.shaft_angle(item.to_shaft, motion)
    rate = mech.shaft_speed(item.from_shaft, motion.v) / item.ratio - mech.shaft_speed(item.to_shaft, motion.v)
    if item.backlash is None:
        return item.stiffness * twist + item.damping * rate
    half = 0.5 * item.backlash
    inside = symbol("twist")
    wound = soft_threshold(inside, half, half, corner * half)
    contact = ca.substitute(ca.jacobian(wound, inside), inside, twist)
    wound = ca.substitute(wound, inside, twist)
    torque = item.stiffness * wound + item.damping * rate * contact
    return where(wound >= 0, ca.fmax(torque, 0.0), ca.fmin(torque, 0.0))
