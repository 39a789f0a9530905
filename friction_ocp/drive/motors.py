"""What a motor does: its voltage, current and torque, and the control law that commands it."""

from __future__ import annotations

from typing import Any

import casadi as ca

from friction_ocp.drive.control import ControlSignals, command, has_integral, integral_rate, saturate
from friction_ocp.drive.mechanism import Mechanism, Motion, column
from friction_ocp.drive.parts import Motor
from friction_ocp.friction.smoothing import where


def motor_torque(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the torque that current makes in a motor, 0 while it is not enabled; cogging is apart from it."""
    torque = mech.true_input(f"{motor.name}.torque")
    torque = _commanded(mech, motor, "torque", motion) if torque is None else motor.share * torque
    if torque is not None:
        torque = _enabled(mech, motor, torque)
    else:
        current = motor_current(mech, motor, motion)
        torque = 0.0 if current is None else motor.torque_constant * current
    if motor.torque_ripple is None:
        return torque
    return torque * (1.0 + motor.torque_ripple.value(*mech.angle_passed(motor.shaft, motion)))


def cogging_torque(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the torque on the motor's shaft that is there without any current."""
    return 0.0 if motor.cogging is None else motor.cogging.value(*mech.angle_passed(motor.shaft, motion))


def _enabled(mech: Mechanism, motor: Motor, value: Any) -> Any:
    enable = mech.true_input(f"{motor.name}.enable")
    return value if enable is None else where(enable > 0.5, value, 0.0)


def motor_current(mech: Mechanism, motor: Motor, motion: Motion) -> Any | None:
    """Return the winding current, 0 while the motor is not enabled; None for a motor driven by torque."""
    current = _current(mech, motor, motion)
    return None if current is None else _enabled(mech, motor, current)


def _current(mech: Mechanism, motor: Motor, motion: Motion) -> Any | None:
    if mech.has_winding_state(motor):
        return motion.extra[mech.extra_names.index(f"{motor.name}.current")]
    for signal in ("current", "current_command"):
        current = mech.true_input(f"{motor.name}.{signal}")
        if current is not None:
            return motor.share * current
    commanded = _commanded(mech, motor, "current", motion)
    if commanded is not None:
        return commanded
    voltage = motor_voltage(mech, motor, motion)
    if voltage is None:
        return None
    return (voltage - motor.torque_constant * mech.shaft_speed(motor.shaft, motion.v)) / motor.resistance


def motor_voltage(mech: Mechanism, motor: Motor, motion: Motion) -> Any | None:
    """Return the terminal voltage; a duty controller scales the supply voltage."""
    voltage = mech.true_input(f"{motor.name}.voltage")
    if voltage is not None:
        return motor.share * voltage
    commanded = _commanded(mech, motor, "voltage", motion)
    controller = mech.drive.controller
    if commanded is None or controller is None or controller.type != "duty":
        return commanded
    supply = mech.true_input(f"{motor.name}.supply_voltage")
    return commanded if supply is None else commanded * supply


def _commanded(mech: Mechanism, motor: Motor, output: str, motion: Motion) -> Any | None:
    controller = mech.drive.controller
    if controller is None or controller.output != output:
        return None
    if controller.sample_time is not None:
        return motor.share * motion.memory[mech.memory_names.index("controller.held")]
    integral = motion.extra[mech.extra_names.index("controller.integral")] if has_integral(controller) else 0.0
    return motor.share * saturate(controller, command(controller, seen_by_controller(mech, motion), integral))


def seen_by_controller(mech: Mechanism, motion: Motion) -> ControlSignals:
    """Return what the controller sees through its feedback channel."""
    controller = mech.drive.controller
    assert controller is not None
    channel = next(item for item in mech.drive.channels if item.name == controller.feedback)
    theta, omega = mech.shaft_angle(channel.part, motion), mech.shaft_speed(channel.part, motion.v)
    if channel.eccentricity is not None:
        theta, omega, _ = channel.eccentricity.seen((theta, omega, 0.0))
    theta, omega = theta * channel.gain + channel.offset, omega * channel.gain
    angle, speed = mech.true_input("reference.theta"), mech.true_input("reference.omega")
    wanted = (0.0 if angle is None else angle, 0.0 if speed is None else speed)
    if channel.signal == "omega":
        return ControlSignals(*wanted, 0.0, omega + channel.offset, measures_speed=True)
    return ControlSignals(*wanted, theta, omega)


def extra_rates(mech: Mechanism, motion: Motion) -> ca.SX:
    """Return the time derivatives of the winding currents and of the controller's integral."""
    rates: list[Any] = []
    for motor in mech.drive.motors:
        if mech.has_winding_state(motor):
            current = motion.extra[mech.extra_names.index(f"{motor.name}.current")]
            emf = motor.torque_constant * mech.shaft_speed(motor.shaft, motion.v)
            driving = _enabled(mech, motor, motor_voltage(mech, motor, motion) - emf)
            rates.append((driving - motor.resistance * current) / motor.inductance)
    if "controller.integral" in mech.extra_names:
        controller = mech.drive.controller
        assert controller is not None
        integral = motion.extra[mech.extra_names.index("controller.integral")]
        rates.append(integral_rate(controller, seen_by_controller(mech, motion), integral))
    return column(rates)


def cut(mech: Mechanism, extra: ca.SX) -> ca.SX:
    """Return the continuous states without the winding currents of motors that are not enabled."""
    kept = list(ca.vertsplit(extra))
    for motor in mech.drive.motors:
        if mech.has_winding_state(motor):
            k = mech.extra_names.index(f"{motor.name}.current")
            kept[k] = _enabled(mech, motor, kept[k])
    return column(kept)
