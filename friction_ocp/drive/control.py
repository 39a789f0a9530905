"""Control laws of a drive: continuous ones act at every instant, sampled ones at ticks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from friction_ocp.drive.parts import Controller
from friction_ocp.friction.smoothing import where


@dataclass(frozen=True)
class ControlSignals:
    """What the controller sees, after the feedback channel's gain and offset."""

    reference_theta: Any
    reference_omega: Any
    theta: Any
    omega: Any
    measures_speed: bool = False
    """Whether the channel measures the speed itself, so that there is no angle and nothing to differentiate."""


def saturate(controller: Controller, command: Any) -> Any:
    """Limit a command to the controller's saturation."""
    if controller.saturation is None:
        return command
    low, high = controller.saturation
    return ca.fmin(ca.fmax(ca.SX(command), ca.SX(low)), ca.SX(high))


def command(controller: Controller, seen: ControlSignals, integral: Any) -> Any:
    """Return the unsaturated command of any controller type."""
    angle_error = seen.reference_theta - seen.theta
    match controller.type:
        case "duty" | "p":
            return controller.kp * angle_error
        case "pd":
            return controller.kp * angle_error + controller.kd * (seen.reference_omega - seen.omega)
        case "pi_velocity":
            return controller.kp * (seen.reference_omega - seen.omega) + integral
        case "cascade":
            return controller.kd * _speed_error(controller, seen) + integral


def _speed_error(controller: Controller, seen: ControlSignals) -> Any:
    if controller.type == "cascade":
        wanted = controller.kp * (seen.reference_theta - seen.theta) + seen.reference_omega
        return wanted - seen.omega
    return seen.reference_omega - seen.omega


def has_integral(controller: Controller) -> bool:
    """Whether the controller type integrates its speed error."""
    return controller.type in ("pi_velocity", "cascade")


def integral_rate(controller: Controller, seen: ControlSignals, integral: Any) -> Any:
    """Return the rate of the integral part; anti-windup stops it while the command is saturated outward."""
    rate = controller.ki * _speed_error(controller, seen)
    if controller.saturation is None or not controller.anti_windup:
        return rate
    raw = command(controller, seen, integral)
    outward = (raw - saturate(controller, raw)) * rate > 0
    return where(outward, 0.0 * rate, rate)


def noise_gain(controller: Controller, measures_speed: bool, step: float) -> float:
    """Return the white noise of the command over that of what a controller sees, samples `step` s apart.

    The controller is one of plain numbers; its integral, which is slow, and its saturation are left out.
    """
    names = ("theta", "omega", "controller.previous1", "controller.previous2")
    noisy = {name: ca.SX.sym(name) for name in names}
    ticking = replace(controller, sample_time=controller.sample_time or step)
    seen = ControlSignals(0.0, 0.0, noisy["theta"], noisy["omega"], measures_speed)
    wanted = command(ticking, seen_by_sampled(ticking, seen, noisy), 0.0)
    slopes = ca.jacobian(ca.SX(wanted), ca.vertcat(*noisy.values()))
    return float(ca.evalf(ca.norm_2(slopes.T)))


def memory_names(controller: Controller) -> tuple[str, ...]:
    """Return the states that a sampled controller keeps between ticks."""
    if controller.sample_time is None:
        return ()
    names = ["held"]
    names += [f"pending{k + 1}" for k in range(pipeline_length(controller))]
    if has_integral(controller):
        names.append("integral")
    return tuple(f"controller.{name}" for name in (*names, "previous1", "previous2"))


def pipeline_length(controller: Controller) -> int:
    """Return how many computed commands wait to be applied."""
    if controller.sample_time is None or controller.delay <= 0:
        return 0
    return max(1, -int(-(controller.delay - 1e-9 * controller.sample_time) // controller.sample_time))


def seen_by_sampled(controller: Controller, seen: ControlSignals, memory: Mapping[str, Any]) -> ControlSignals:
    """Replace the true speed by the difference quotient that the controller computes from an angle."""
    if seen.measures_speed:
        return seen
    before, long_before = memory["controller.previous1"], memory["controller.previous2"]
    assert controller.sample_time is not None
    if controller.derivative == "two_tap_mean":
        omega = (seen.theta - long_before) / (2.0 * controller.sample_time)
    else:
        omega = (seen.theta - before) / controller.sample_time
    return ControlSignals(seen.reference_theta, seen.reference_omega, seen.theta, omega)


def compute_tick(controller: Controller, seen: ControlSignals, memory: Mapping[str, Any]) -> dict[str, Any]:
    """Return the memory after the controller has computed a new command."""
    sampled = seen_by_sampled(controller, seen, memory)
    after = dict(memory)
    integral = memory.get("controller.integral", 0.0)
    if has_integral(controller):
        integral = integral + controller.sample_time * integral_rate(controller, sampled, integral)
        after["controller.integral"] = integral
    new = saturate(controller, command(controller, sampled, integral))
    waiting = pipeline_length(controller)
    if waiting:
        for k in range(waiting, 1, -1):
            after[f"controller.pending{k}"] = memory[f"controller.pending{k - 1}"]
        after["controller.pending1"] = new
    else:
        after["controller.held"] = new
    after["controller.previous2"] = memory["controller.previous1"]
    after["controller.previous1"] = seen.theta
    return after


def apply_tick(controller: Controller, memory: Mapping[str, Any]) -> dict[str, Any]:
    """Return the memory after a delayed command has reached the motor."""
    waiting = pipeline_length(controller)
    return {**memory, "controller.held": memory[f"controller.pending{waiting}"]} if waiting else dict(memory)
