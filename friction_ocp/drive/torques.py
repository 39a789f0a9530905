"""The torques on the shafts of a drive other than friction and what rigid joints transmit."""

from __future__ import annotations

from typing import Any

import casadi as ca

from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.mechanism import Mechanism, Motion, column, symbol
from friction_ocp.drive.motors import cogging_torque, motor_torque
from friction_ocp.drive.parts import SecondStage, Shaft, Transmission
from friction_ocp.friction.smoothing import smooth_abs, soft_threshold, sqrt, where


def applied_torques(mech: Mechanism, motion: Motion, corner: Any) -> dict[str, Any]:
    """Return the torque on every shaft other than friction and torque through rigid joints."""
    torques = {shaft.name: _external_torque(mech, shaft, motion) for shaft in mech.drive.shafts}
    for item in mech.topology.elastic:
        exerted = elastic_torque(mech, item, motion, corner)
        torques[item.to_shaft] = torques[item.to_shaft] + exerted
        torques[item.from_shaft] = torques[item.from_shaft] - exerted * transfer(mech, item, motion)
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
    damper acts while the flanks touch, the loop always.
    """
    twist = plain_twist(mech, item, motion)
    if item.kinematic_error is not None:
        twist = twist + item.kinematic_error.value(*mech.angle_passed(item.from_shaft, motion))
    rate = twist_rate(mech, item, motion, motion.v)
    return _spring_torque(item, twist, rate, corner) + _loop_torque(mech, item, motion, rate)


def plain_twist(mech: Mechanism, item: Transmission, motion: Motion) -> Any:
    """Return by how far the input is ahead of the output, on its side, were the ratio the same all around."""
    return mech.shaft_angle(item.from_shaft, motion) / item.ratio - mech.shaft_angle(item.to_shaft, motion)


def transfer(mech: Mechanism, item: Transmission, motion: Motion) -> Any:
    """Return the turn of the output over that of the input: 1 / ratio, and how the kinematic error changes it."""
    if item.kinematic_error is None:
        return 1.0 / item.ratio
    return 1.0 / item.ratio + item.kinematic_error.slope(*mech.angle_passed(item.from_shaft, motion))


def twist_rate(mech: Mechanism, item: Transmission, motion: Motion, v: ca.SX) -> Any:
    """Return the rate of the twist at group speeds `v`."""
    turning = transfer(mech, item, motion) * mech.shaft_speed(item.from_shaft, motion, v)
    return turning - mech.shaft_speed(item.to_shaft, motion, v)


def _spring_torque(item: Transmission, twist: Any, rate: Any, corner: Any) -> Any:
    if item.backlash is None:
        return _wound_torque(item, twist) + item.damping * rate
    half = 0.5 * item.backlash
    inside = symbol("twist")
    wound = soft_threshold(inside, half, half, corner * half)
    contact = ca.substitute(ca.jacobian(wound, inside), inside, twist)
    wound = ca.substitute(wound, inside, twist)
    torque = _wound_torque(item, wound) + item.damping * rate * contact
    return where(wound >= 0, ca.fmax(torque, 0.0), ca.fmin(torque, 0.0))


def _wound_torque(item: Transmission, wound: Any) -> Any:
    torque = item.stiffness * wound
    if item.stiffening is not None:
        torque = torque + item.stiffening * wound**3
    return torque if item.second_stage is None else torque + _staged_torque(item.second_stage, wound)


def _staged_torque(stage: SecondStage, wound: Any) -> Any:
    share = sqrt(1.0 - stage.rounding * stage.rounding)
    begin, width = share * stage.twist, stage.rounding * stage.twist
    soft = smooth_abs(wound - begin, width) - smooth_abs(wound + begin, width)
    return stage.stiffness * (wound + 0.5 * soft / share)


def _loop_torque(mech: Mechanism, item: Transmission, motion: Motion, rate: Any) -> Any:
    """Return the torque of a loop, its mean over a step at constant rate where there is a step."""
    if item.hysteresis is None or motion.loops is None:
        return 0.0
    loop = mech.loops(motion.loops)[item.name]
    if motion.steady is None:
        return loop.torque()
    return loop.mean_torque(rate, twist_rate(mech, item, motion, motion.steady), motion.h)


def loop_rates(mech: Mechanism, motion: Motion) -> ca.SX:
    """Return the time derivatives of the deflections of loops."""
    assert motion.loops is not None
    loops = mech.loops(motion.loops)
    return column([one for item in mech.looping for one in loops[item.name].rates(_rate(mech, item, motion))])


def loops_after(mech: Mechanism, motion: Motion) -> ca.SX:
    """Return the deflections of loops after a step at its mean speeds, which `motion` has."""
    assert motion.loops is not None
    loops, h = mech.loops(motion.loops), motion.h
    return column([one for item in mech.looping for one in loops[item.name].after(_rate(mech, item, motion), h)])


def _rate(mech: Mechanism, item: Transmission, motion: Motion) -> Any:
    return twist_rate(mech, item, motion, motion.v)
