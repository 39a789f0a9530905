"""What a motor does: its voltage, current and torque, and the control law that commands it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from friction_ocp.drive.control import ControlSignals, command, has_integral, integral_rate, saturate
from friction_ocp.drive.following import Follower
from friction_ocp.drive.mechanism import FEEDBACK_DELAY, Mechanism, Motion, column
from friction_ocp.drive.parts import Controller, Motor
from friction_ocp.friction.smoothing import exp, log1p_mean, power, sqrt, where

ALL_GONE = -0.999
"""Of a saturation that falls to nothing: as far as its torque per ampere is followed."""
NEWTON_STEPS = 4
"""From the current without saturation; each squares the error, and a millionth is left where it began at a half."""
LEAST_SLOPE = 0.1
"""Of voltage over current, in resistances: below it, where iron saturates at once, they are turned back."""


def motor_torque(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the torque that current makes in a motor, 0 while it is not enabled; cogging is apart from it."""
    if mech.drive.driving_signal(motor) == "torque":
        torque = _enabled(mech, motor, _driving(mech, motor, motion))
        left = _left_of_torque(motor, torque / motor.torque_constant)
        return torque * left * torque_ripple_factor(mech, motor, motion)
    current = motor_current(mech, motor, motion)
    if current is None:
        return 0.0
    made = motor.torque_constant * current * _left_of_torque(motor, current)
    return made * torque_ripple_factor(mech, motor, motion) - _rippling_drag(mech, motor, motion, current)


def _rippling_drag(mech: Mechanism, motor: Motor, motion: Motion, current: Any) -> Any:
    """Return what a ripple that is passed within a step takes of the mean torque beside its mean.

    Where it raises the torque constant it raises the back-EMF, too, and the current of a winding without inductance is
    the less: their product goes with the square of the ripple.
    """
    angle, passed = mech.angle_passed(motor.shaft, motion)
    settled = mech.drive.driving_signal(motor) == "voltage" and not mech.has_winding_state(motor)
    if motor.torque_ripple is None or passed is None or not settled:
        return 0.0
    left = _left_of_torque(motor, current) * _left_of_emf(motor, current)
    drag = motor.torque_constant**2 / motor.resistance * mech.shaft_speed(motor.shaft, motion)
    return _enabled(mech, motor, drag * left * motor.torque_ripple.variance(angle, passed))


def _left_of_torque(motor: Motor, current: Any) -> Any:
    """Return the factor on the torque that saturation leaves at a current."""
    if motor.saturation is None:
        return 1.0
    used, sharpness, tail = motor.saturation * current**2, motor.saturation_sharpness, motor.saturation_tail
    if sharpness is None:
        return 1.0 / sqrt(1.0 + used)
    fall = power(used, 0.5 * sharpness)
    if tail is None:
        return 1.0 / power(1.0 + fall, 1.0 / sharpness)
    fall = fall / sharpness
    return exp(-fall * log1p_mean(where(tail * fall > ALL_GONE, tail * fall, ALL_GONE)))


def _left_of_emf(motor: Motor, current: Any) -> Any:
    """Return the factor on the back-EMF that saturation leaves at a current."""
    left, share = _left_of_torque(motor, current), motor.saturation_in_emf
    return left if share is None else 1.0 - share * (1.0 - left)


def torque_ripple_factor(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the factor on torque and back-EMF at the angle of the motor."""
    if motor.torque_ripple is None:
        return 1.0
    return 1.0 + motor.torque_ripple.value(*mech.angle_passed(motor.shaft, motion))


def cogging_torque(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the torque on the motor's shaft that is there without any current."""
    return 0.0 if motor.cogging is None else motor.cogging.value(*mech.angle_passed(motor.shaft, motion))


def _enabled(mech: Mechanism, motor: Motor, value: Any) -> Any:
    enable = mech.true_input(f"{motor.name}.enable")
    return value if enable is None else where(enable > 0.5, value, 0.0)


def motor_current(mech: Mechanism, motor: Motor, motion: Motion) -> Any | None:
    """Return the winding current, 0 while the motor is not enabled; None for a motor not driven electrically."""
    signal = mech.drive.driving_signal(motor)
    if mech.has_winding_state(motor):
        current = motion.extra[mech.extra_names.index(f"{motor.name}.current")]
    elif signal == "current":
        current = _driving(mech, motor, motion)
    elif signal == "voltage":
        current = _settled_current(motor, _driving(mech, motor, motion), _back_emf(mech, motor, motion))
    else:
        return None
    return _enabled(mech, motor, current)


def _back_emf(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the back-EMF that iron without saturation would make."""
    speed = mech.shaft_speed(motor.shaft, motion)
    return motor.torque_constant * torque_ripple_factor(mech, motor, motion) * speed


def _settled_current(motor: Motor, voltage: Any, back_emf: Any) -> Any:
    """Return the current of a winding without inductance, whose back-EMF saturates with its torque (Newton)."""
    plain = (voltage - back_emf) / motor.resistance
    if motor.saturation is None:
        return plain
    current = ca.SX.sym("current")
    error = motor.resistance * current + back_emf * _left_of_emf(motor, current) - voltage
    nearer = current - error / ca.fmax(ca.gradient(error, current), LEAST_SLOPE * motor.resistance)
    found = ca.SX(plain)
    for _ in range(NEWTON_STEPS):
        found = ca.substitute(nearer, current, found)
    return found


def motor_voltage(mech: Mechanism, motor: Motor, motion: Motion) -> Any | None:
    """Return the terminal voltage of a motor that is driven by it; a duty controller scales the supply voltage."""
    return _driving(mech, motor, motion) if mech.drive.driving_signal(motor) == "voltage" else None


def _driving(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the torque, current or voltage that drives a motor, behind its command."""
    if all(item.name != motor.name for item in mech.following):
        return motor_command(mech, motor, motion)
    assert motion.following is not None
    return mech.followers(motion.following)[motor.name].value


def motor_command(mech: Mechanism, motor: Motor, motion: Motion) -> Any:
    """Return the torque, current or voltage that a motor is to follow."""
    given, controller = mech.true_input(f"{motor.name}.{mech.drive.driving_signal(motor)}"), mech.drive.controller
    if given is None and controller is None:
        given = mech.true_input(f"{motor.name}.current_command")
    if given is not None:
        return motor.share * given
    assert controller is not None
    wanted = motor.share * _controlled(mech, controller, motion)
    supply = mech.true_input(f"{motor.name}.supply_voltage") if controller.type == "duty" else None
    return wanted if supply is None else wanted * supply


def _controlled(mech: Mechanism, controller: Controller, motion: Motion) -> Any:
    if controller.sample_time is not None:
        return motion.memory[mech.memory_names.index("controller.held")]
    integral = motion.extra[mech.extra_names.index("controller.integral")] if has_integral(controller) else 0.0
    return saturate(controller, command(controller, seen_by_controller(mech, motion), integral))


def followers(mech: Mechanism, motion: Motion) -> list[tuple[Follower, Any]]:
    """Return what follows commands late, each with its command."""
    if motion.following is None:
        return []
    found = mech.followers(motion.following)
    return [(found[motor.name], motor_command(mech, motor, motion)) for motor in mech.following]


def at_rest(mech: Mechanism, motion: Motion) -> ca.SX:
    """Return the states of what follows commands late, these having been the same for long."""
    begun = mech.followers(ca.SX.zeros(len(mech.following_names)))
    starts = ((begun[motor.name], motor_command(mech, motor, motion)) for motor in mech.following)
    return column([one for item, wanted in starts for one in item.at_rest(wanted)])


def shown_lag(mech: Mechanism, motor: Motor, motion: Motion, signal: str) -> Motion:
    """Return the motion with what drives a motor as far behind its command as a recording of that signal shows it."""
    if motor.lag is None or motor.lag_hidden is None or mech.drive.driving_signal(motor) != signal:
        return motion
    names = [item.name for item in mech.following]
    return replace(
        motion,
        following=column(
            [
                one + (motor.lag_hidden if name == motor.name else 0.0) * (rest - one)
                for name, (item, wanted) in zip(names, followers(mech, motion), strict=True)
                for one, rest in zip(item.states, item.at_rest(wanted), strict=True)
            ]
        ),
    )


def follows_smooth_command(mech: Mechanism, motor: Motor) -> bool:
    """Whether the command of a motor changes within a step: recorded and joined by lines, or of a continuous loop."""
    names = [f"{motor.name}.{signal}" for signal in ("torque", "current", "current_command", "voltage")]
    given = [channel for channel in mech.drive.inputs if channel.measures in names]
    if given:
        return any(channel.hold == "linear" for channel in given)
    return mech.drive.controller is not None and mech.drive.controller.sample_time is None


def following_rates(mech: Mechanism, motion: Motion) -> ca.SX:
    """Return the time derivatives of what follows commands late; its times are positive here."""
    return column([rate for item, wanted in followers(mech, motion) for rate in item.rates(wanted)])


def seen_by_controller(mech: Mechanism, motion: Motion) -> ControlSignals:
    """Return what the controller sees through its feedback channel.

    The delay of an angle is expanded to first order by its speed; that of a speed is left out.
    """
    controller = mech.drive.controller
    assert controller is not None
    channel = next(item for item in mech.drive.channels if item.name == controller.feedback)
    theta, omega = mech.shaft_angle(channel.part, motion), mech.shaft_speed(channel.part, motion)
    if channel.eccentricity is not None:
        theta, omega, _ = channel.eccentricity.seen((theta, omega, 0.0))
    theta = theta - mech.parameters.get(FEEDBACK_DELAY, 0.0) * omega
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
            back_emf = _back_emf(mech, motor, motion) * _left_of_emf(motor, current)
            driving = _enabled(mech, motor, _driving(mech, motor, motion) - back_emf)
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
