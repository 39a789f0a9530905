"""The change of speed over one step: friction implicit and set-valued, everything else at the midpoint.

Each group obeys J (v1 - v0) / h = tau(v) - torque of friction, whose response over the step is
offset + slope * mean speed + [-lower, upper] (friction/element.py). Solving for v1 is a soft threshold: no
smoothing is needed, sticking is exact, and stiff friction does not limit the step. A shaft that comes to rest
within the step does so at the share of the step where its speed is zero; over the rest of the step it sticks or
starts anew, so that the order 2 holds across events too. Related: Moreau 1988 (time stepping of dry friction).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from friction_ocp.drive.coordinates import group_accelerations
from friction_ocp.drive.mechanism import Mechanism, Motion, column, symbol
from friction_ocp.drive.motors import motor_torque
from friction_ocp.drive.parts import Shaft, Transmission
from friction_ocp.drive.torques import applied_torques, elastic_torque
from friction_ocp.friction.element import FrictionElement, StepResponse
from friction_ocp.friction.modifiers import WarmUp
from friction_ocp.friction.smoothing import smooth_abs, soft_threshold, where

NEWTON_STEPS = 6
NO_LEVEL = 1e-100
"""Keeps the shares of shafts and their derivatives finite where no shaft of a group has dry friction."""


@dataclass(frozen=True)
class Unknown:
    """Torques through loaded rigid joints, on their output sides: `symbols` equal `found`, which depends on them."""

    symbols: ca.SX
    found: ca.SX

    @property
    def solution(self) -> ca.SX:
        """The torques, by Newton's method from zero: the equations are piecewise linear."""
        slope = ca.SX.eye(self.symbols.numel()) - ca.jacobian(self.found, self.symbols)
        newton = self.symbols - ca.solve(slope, self.symbols - self.found)
        solution = ca.SX.zeros(self.symbols.numel())
        for _ in range(NEWTON_STEPS):
            solution = ca.substitute(newton, self.symbols, solution)
        return solution


@dataclass(frozen=True)
class Kick:
    """Result of one speed update."""

    v: ca.SX
    """(groups,) speeds after the step."""
    mean: ca.SX
    """(groups,) mean speeds over the step."""
    load: dict[str, Any]
    """Torques that friction depends on: through each transmission on its output side, and of each motor."""
    torques: dict[str, Any]
    """Torque on each shaft other than friction and torque through rigid joints."""
    friction: dict[str, Any]
    """Friction torque on each shaft."""
    unknown: Unknown | None = None
    """The torques in whose symbols `v` and `load` are written; None where they are not."""


@dataclass(frozen=True)
class Step:
    """What a speed update starts from."""

    h: Any
    v: ca.SX
    """(groups,) speeds at the start."""
    at: Motion
    """Midpoint angles and the speeds about which torques are linearised."""
    bristle: dict[str, Any]
    width: ca.SX
    """(groups + 1,) rounding of the sign by group, in rad/s; last the relative rounding of backlash corners."""


def implicit_kick(mech: Mechanism, step: Step) -> Kick:
    """Return the speeds after a step in terms of the torques through loaded rigid joints, still to be solved for."""
    joints = mech.loaded_joints()
    symbols = ca.SX.sym("transmitted", len(joints))
    torques, stiffening = _applied(mech, step)
    corner = step.width[len(mech.topology.roots)]
    load = {item.name: elastic_torque(mech, item, step.at, corner) for item in mech.topology.elastic}
    load |= {joint.name: symbols[k] for k, joint in enumerate(joints)} | motor_loads(mech, step.at)
    v, mean, friction = _solve(mech, step, torques, stiffening, load)
    friction |= _prescribed_friction(mech, step, load)
    if not joints:
        return Kick(v, mean, load, torques, friction)
    acceleration = group_accelerations(mech, (v - step.v) / step.h)
    found = column([through_joint(mech, joint, step.at, acceleration, torques, friction) for joint in joints])
    return Kick(v, mean, load, torques, friction, Unknown(symbols, found))


def _prescribed_friction(mech: Mechanism, step: Step, load: dict[str, Any]) -> dict[str, Any]:
    """Return the friction torque on the shafts whose motion is an input, at the speeds of the step."""
    friction: dict[str, Any] = {}
    for group in mech.prescribed:
        for name in mech.topology.members(group):
            shaft = mech.drive.shaft(name)
            omega, transmitted = mech.shaft_speed(name, step.at), transmitted_torque(mech, shaft, load)
            element = shaft.friction.under(mech.surroundings(shaft, step.at))
            if name in step.bristle:
                friction[name], _ = element.bristle_torque(omega, step.bristle[name], transmitted)
            else:
                friction[name] = element.torque(omega, transmitted, step.width[group])
    return friction


def _applied(mech: Mechanism, step: Step) -> tuple[dict[str, Any], list[Any]]:
    """Return the torque on each shaft and, by group, the derivative of its torque by its own speed."""
    groups = len(mech.topology.roots)
    speed = ca.SX.sym("speed", groups)
    symbolic = applied_torques(mech, replace(step.at, v=speed), step.width[groups])
    total = [_group_sum(mech, step.at, g, symbolic) for g in range(groups)]
    own = [ca.substitute(ca.jacobian(ca.SX(total[g]), speed[g]), speed, step.at.v) for g in range(groups)]
    torques = {name: ca.substitute(ca.SX(torque), speed, step.at.v) for name, torque in symbolic.items()}
    return torques, own


def _group_sum(mech: Mechanism, at: Motion, group: int, torques: dict[str, Any]) -> Any:
    return sum(mech.speed_ratio(name, at) * torques[name] for name in mech.topology.members(group))


def motor_loads(mech: Mechanism, at: Motion) -> dict[str, Any]:
    """Return the torques of the motors that load a shaft by themselves."""
    return {motor.name: motor_torque(mech, motor, at) for motor in mech.loading_motors()}


def transmitted_torque(mech: Mechanism, shaft: Shaft, load: dict[str, Any]) -> Any:
    """Return |torque| that loads the friction of a shaft, on the shaft's own side: that through its joints.

    A shaft without any is loaded by its motors: they may be one part with a gear inside.
    """
    if shaft.friction.load is None:
        return 0.0
    torques = [
        load[joint.name] / joint.ratio if joint.from_shaft == shaft.name else load[joint.name]
        for joint in mech.load_joints(shaft)
    ] or [load[motor.name] for motor in mech.motors_on(shaft)]
    return smooth_abs(sum(torques[1:], torques[0]))


def losses(mech: Mechanism, motion: Motion, load: dict[str, Any]) -> Iterator[tuple[WarmUp, Any]]:
    """Yield how the losses of friction warm a shaft, in the order of states, and what is lost there, W."""
    for name, warm_up in mech.warming.items():
        shaft = mech.drive.shaft(name)
        omega = mech.shaft_speed(shaft.name, motion)
        element = shaft.friction.under(mech.surroundings(shaft, motion))
        yield warm_up, omega * element.torque(omega, transmitted_torque(mech, shaft, load))


def _solve(
    mech: Mechanism, step: Step, torques: dict[str, Any], own: list[Any], load: dict[str, Any]
) -> tuple[ca.SX, ca.SX, dict[str, Any]]:
    """Return new and mean speeds of the groups and the friction torque on each shaft."""
    speeds = [step.v[g] for g in range(len(mech.topology.roots))]
    means = list(speeds)
    friction: dict[str, Any] = {}
    for group in mech.free_groups:
        members = mech.topology.members(group)
        responses = {name: _response(mech, step, mech.drive.shaft(name), load) for name in members}
        whole, before = _combined(mech, step.at, responses), step.v[group]
        damping = whole.slope - own[group]
        pushed = _group_sum(mech, step.at, group, torques) - own[group] * step.at.v[group] - whole.offset
        pushed = pushed - mech.inertial_torque(group, step.at)
        gain = step.h / mech.inertia(group, step.at)
        free = before + gain * (pushed - 0.5 * damping * before)
        divisor = ca.fmax(ca.SX(1.0 + 0.5 * gain * damping), 0.5)
        moved = soft_threshold(free, gain * whole.upper, gain * whole.lower, step.width[group]) / divisor
        speeds[group], means[group] = moved, 0.5 * (before + moved)
        if not ca.SX(whole.upper + whole.lower).is_zero():
            at_rest = {name: _response(mech, step, mech.drive.shaft(name), load, 0.0) for name in members}
            resting = _combined(mech, step.at, at_rest)
            slid = (free - gain * where(before >= 0, whole.upper, -whole.lower)) / divisor
            speeds[group], means[group] = _through_rest(step, group, gain * pushed, gain, resting, slid, moved)
        set_valued = (free - speeds[group] * divisor) / gain
        friction |= _shared(mech, step, group, responses, whole, set_valued, speeds[group])
    return column(speeds), column(means), friction


def _through_rest(
    step: Step, group: int, pushed: Any, gain: Any, resting: StepResponse, slid: Any, moved: Any
) -> tuple[Any, Any]:
    """Return new and mean speed of a group that may come to rest within the step.

    `slid` is the speed that unchanged sliding would lead to, `moved` the soft threshold over the whole step, which
    holds where the speed keeps its sign, the group starts from rest, or the sign is smoothed.
    """
    before = step.v[group]
    stops = ca.logic_and(before * slid < 0, step.width[group] <= 0)
    stopping = where(stops, before / where(stops, before - slid, 1.0), 0.0)
    rest = 1.0 - stopping
    after = soft_threshold(rest * pushed, rest * gain * resting.upper, rest * gain * resting.lower)
    mean = 0.5 * (stopping * before + rest * after)
    return where(stops, after, moved), where(stops, mean, 0.5 * (before + moved))


def _response(
    mech: Mechanism, step: Step, shaft: Shaft, load: dict[str, Any], speed: float | None = None
) -> StepResponse:
    """Return the response of a shaft's friction about the step's own speed, or about the group speed given."""
    omega = symbol("omega")
    element: FrictionElement = shaft.friction.under(mech.surroundings(shaft, step.at))
    transmitted = transmitted_torque(mech, shaft, load)
    response = element.step_response(step.h, omega, step.bristle.get(shaft.name, 0.0), transmitted)
    now = mech.shaft_speed(shaft.name, step.at) if speed is None else ca.SX(speed)
    terms = (response.offset, response.slope, response.upper, response.lower)
    return StepResponse(*(ca.substitute(ca.SX(term), omega, now) for term in terms))


def _combined(mech: Mechanism, at: Motion, responses: dict[str, StepResponse]) -> StepResponse:
    """Refer the responses of all shafts of a group to its first shaft."""
    offset, slope, upper, lower = 0.0, 0.0, 0.0, 0.0
    for name, response in responses.items():
        ratio = mech.speed_ratio(name, at)
        forward, backward = _levels(ratio, response)
        offset += ratio * response.offset
        slope += ratio**2 * response.slope
        upper += forward
        lower += backward
    return StepResponse(offset, slope, upper, lower)


def _levels(ratio: Any, response: StepResponse) -> tuple[Any, Any]:
    """Return the set-valued levels of a shaft as its group feels them, forward and backward motion of the group."""
    size = smooth_abs(ratio) if isinstance(ratio, ca.SX) else abs(ratio)
    same = ca.SX(ratio) > 0
    forward, backward = where(same, response.upper, response.lower), where(same, response.lower, response.upper)
    return size * forward, size * backward


def _shared(
    mech: Mechanism,
    step: Step,
    group: int,
    responses: dict[str, StepResponse],
    whole: StepResponse,
    set_valued: Any,
    after: Any,
) -> dict[str, Any]:
    """Divide the friction of a group among its shafts; the set-valued part by the shares of the levels."""
    mean = 0.5 * (step.v[group] + after)
    only = sum(not ca.SX(item.upper + item.lower).is_zero() for item in responses.values()) <= 1
    friction: dict[str, Any] = {}
    for name, response in responses.items():
        ratio = mech.speed_ratio(name, step.at)
        if only:
            share: Any = 0.0 if ca.SX(response.upper + response.lower).is_zero() else 1.0
        else:
            forward, backward = _levels(ratio, response)
            share = where(set_valued >= 0, forward / (whole.upper + NO_LEVEL), backward / (whole.lower + NO_LEVEL))
        friction[name] = response.offset + response.slope * mean * ratio + set_valued * share / ratio
    return friction


def through_joint(
    mech: Mechanism,
    joint: Transmission,
    at: Motion,
    acceleration: ca.SX,
    torques: dict[str, Any],
    friction: dict[str, Any],
) -> Any:
    """Return the torque through a rigid joint on its output side, from the balance of what lies beyond it.

    `acceleration` (groups,); `torques` and `friction` by shaft.
    """
    total: Any = 0.0
    for name in mech.topology.beyond(joint):
        turning = mech.drive.shaft(name).inertia * mech.shaft_acceleration(name, at, acceleration)
        resisting = turning + friction.get(name, 0.0)
        ratio = mech.speed_ratio(name, at) / mech.speed_ratio(joint.to_shaft, at)
        total = total + ratio * (resisting - torques[name])
    return total
