"""One time step of a drive, its outputs and its controller ticks, as CasADi functions of named vectors.

The step is a symmetric splitting: half a drift of the angles, one update of the speeds (kick.py), half a
drift again. Order 2 on smooth motion.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from friction_ocp.drive.control import apply_tick, compute_tick
from friction_ocp.drive.coordinates import ORDERS, group_accelerations, group_angles, group_speeds, pick
from friction_ocp.drive.holding import drive_torque, holding_effort, holding_torques
from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.kick import Step, Unknown, implicit_kick, losses, transmitted_torque
from friction_ocp.drive.mechanism import Mechanism, Motion, column, mechanism, symbol
from friction_ocp.drive.motors import (
    cut,
    extra_rates,
    followers,
    follows_smooth_command,
    motor_current,
    motor_torque,
    motor_voltage,
    seen_by_controller,
    shown_lag,
)
from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.drive.start import start_state
from friction_ocp.drive.torques import loops_after
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.kept import kept
from friction_ocp.parameters import is_off

INSTANT = 1e-2
"""Share of a step over which an acceleration is taken: nearly its value at the node, yet blunt near standstill."""

NOTHING_HELD: Mapping[int, Any] = {}


@dataclass(frozen=True)
class SteppedDrive:
    """A drive in discrete time.

    `step(x, u, p, h, width) -> x` advances by `h` s under midpoint inputs `u`;
    `output(x, u, p, h, width) -> y` predicts the recorded output channels;
    `tick(x, u, p, kind) -> x` lets a sampled controller compute (kind 1) or apply (kind 2);
    `start(y, dy, ddy, u, p) -> x` makes a state from smoothed output channels and their first two time derivatives.
    """

    mechanism: Mechanism
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    parameter_names: tuple[str, ...]
    output_names: tuple[str, ...]
    step: ca.Function
    output: ca.Function
    tick: ca.Function | None
    start: ca.Function
    implicit: Mapping[str, ca.Function]
    """`step` and `output` in implicit form, where friction depends on torques through rigid joints.

    (arguments, torques) -> (value, torques found), before torques = torques found is solved: differentiating this
    is cheaper than differentiating Newton's method.
    """
    noisy_inputs: tuple[str, ...] = ()
    """Inputs whose noise is among the states (input_noise.py)."""


@dataclass(frozen=True)
class State:
    """The state vector and its slices as expressions."""

    x: ca.SX
    angles: ca.SX
    speeds: ca.SX
    bristle: ca.SX
    extra: ca.SX
    following: ca.SX
    loops: ca.SX
    warmth: ca.SX
    memory: ca.SX

    def at(self, q: ca.SX, v: ca.SX) -> Motion:
        """Return the motion at an instant, the groups being at `q` with speeds `v`."""
        return Motion(q, v, self.extra, self.memory, self.following, self.loops, self.warmth)

    def motion(self, mech: Mechanism) -> Motion:
        """Return the motion of a drive in this state."""
        return self.at(group_angles(mech, self.angles), group_speeds(mech, self.speeds))


def state_symbols(mech: Mechanism) -> State:
    """Return symbols for the whole state of a drive."""
    sizes = (
        len(mech.angle_groups),
        len(mech.free_groups),
        len(mech.bristle_names),
        len(mech.extra_names),
        len(mech.following_names),
        len(mech.loop_names),
        len(mech.warming),
        len(mech.memory_names),
    )
    parts = [ca.SX.sym(f"x{k}", size) for k, size in enumerate(sizes)]
    return State(ca.vertcat(*parts), *parts)


def _passes(mech: Mechanism) -> int:
    """One pass suffices where nothing but the own speed couples into the speed update."""
    controller = mech.drive.controller
    loop = bool(mech.following) and controller is not None and controller.sample_time is None
    varying = any(mech.has_varying_ratios(group) for group in range(len(mech.topology.roots)))
    coupled = mech.topology.elastic or mech.bristles or mech.extra_names or mech.warming
    return 2 if coupled or loop or varying else 1


@dataclass(frozen=True)
class _Expression:
    """A value in terms of unknown torques; each unknown may depend on those before it."""

    value: ca.SX
    unknowns: tuple[Unknown, ...]

    def solved(self) -> ca.SX:
        """Return the value without unknowns."""
        value = self.value
        for unknown in reversed(self.unknowns):
            value = ca.substitute(value, unknown.symbols, unknown.solution)
        return value

    def implicit(self, arguments: list[ca.SX]) -> ca.Function:
        """Return (arguments, unknown torques) -> (value, torques found)."""
        symbols = ca.vertcat(*[unknown.symbols for unknown in self.unknowns])
        found = ca.vertcat(*[unknown.found for unknown in self.unknowns])
        return ca.Function("relation", [*arguments, symbols], [self.value, found])


def _advance(mech: Mechanism, state: State, h: ca.SX, width: ca.SX) -> _Expression:
    v0 = group_speeds(mech, state.speeds)
    free_angles = state.angles + 0.5 * h * pick(v0, mech.angle_groups)
    bristle = mech.deflections(state.bristle)
    v1, load = v0, dict[str, Any]()
    at: Motion = replace(state.at(group_angles(mech, free_angles), v0), h=h, steady=v0)
    following_mean, following_after = _advance_following(mech, state, at)
    extra_after, warmth_after, at = state.extra, state.warmth, replace(at, following=following_mean)
    unknowns: list[Unknown] = []
    for _ in range(_passes(mech)):
        # torques at the middle angle shifted by h^2 / 12 of the acceleration have the mean of the step
        # to fourth order in its frequencies (Takahashi & Imada 1984)
        middle = group_angles(mech, free_angles + h / 12.0 * pick(v1 - v0, mech.angle_groups))
        at = replace(at, q=middle)
        done = implicit_kick(mech, Step(h, v0, at, bristle, width))
        v1, load = done.v, done.load
        unknowns += [] if done.unknown is None else [done.unknown]
        at = replace(at, v=done.mean, steady=done.mean)
        extra_after = _advance_extra(mech, state, replace(at, extra=state.extra), h)
        warmth_after = _advance_warmth(mech, state, at, load)
        following_mean, following_after = _advance_following(mech, state, at)
        warmth_mean = 0.5 * (state.warmth + warmth_after)
        at = replace(at, extra=0.5 * (state.extra + extra_after), following=following_mean, warmth=warmth_mean)
    value = ca.vertcat(
        state.angles + h * pick(at.v, mech.angle_groups),
        pick(v1, mech.free_groups),
        _advance_bristles(mech, state, at, load),
        extra_after,
        following_after,
        loops_after(mech, at),
        warmth_after,
        state.memory,
    )
    return _Expression(value, tuple(unknowns))


def _advance_following(mech: Mechanism, state: State, at: Motion) -> tuple[ca.SX, ca.SX]:
    """Return mean and end of what follows commands late, these being constant over the step."""
    means, ends = list[Any](), list[Any]()
    for item, wanted in followers(mech, replace(at, following=state.following)):
        mean, end = item.stepped(wanted, at.h)
        means, ends = [*means, *mean], [*ends, *end]
    return column(means), column(ends)


def _advance_extra(mech: Mechanism, state: State, at: Motion, h: ca.SX) -> ca.SX:
    """Linearly implicit midpoint step of the currents and integrals."""
    if not mech.extra_names:
        return state.extra
    rates = extra_rates(mech, at)
    implicit = ca.SX.eye(rates.numel()) - 0.5 * h * ca.jacobian(rates, state.extra)
    return cut(mech, state.extra + h * ca.solve(implicit, rates))


def _advance_bristles(mech: Mechanism, state: State, at: Motion, load: dict[str, Any]) -> ca.SX:
    after: list[Any] = []
    bristle = mech.deflections(state.bristle)
    for shaft in mech.bristles:
        omega = mech.shaft_speed(shaft.name, at)
        transmitted = transmitted_torque(mech, shaft, load)
        friction = shaft.friction.under(mech.surroundings(shaft, at))
        after.append(friction.advance(at.h, omega, omega, bristle[shaft.name], transmitted))
    return column(after)


def _advance_warmth(mech: Mechanism, state: State, at: Motion, load: dict[str, Any]) -> ca.SX:
    """Return how far friction has settled after a step at its mean speeds, which `at` has."""
    lost = enumerate(losses(mech, at, load))
    return column([warm_up.after(at.h, state.warmth[k], loss) for k, (warm_up, loss) in lost])


def _outputs(mech: Mechanism, state: State, h: ca.SX, width: ca.SX, late: Collection[str]) -> _Expression:
    q, v = group_angles(mech, state.angles), group_speeds(mech, state.speeds)
    at = _observed_following(mech, state.at(q, v), h)
    bristle = mech.deflections(state.bristle)
    instant = INSTANT * h
    done = implicit_kick(mech, Step(instant, v, at, bristle, width))
    acceleration = group_accelerations(mech, (done.v - v) / instant)
    holding = holding_torques(mech, at, acceleration, done.torques, done.friction)
    changing = [name for name in mech.inputs if name + "'" in mech.inputs]
    moving = ca.vertcat(state.angles, state.speeds, column([mech.inputs[name] for name in changing]))
    turning, speeding = pick(v, mech.angle_groups), pick(acceleration, mech.free_groups)
    rates = ca.vertcat(turning, speeding, column([mech.inputs[name + "'"] for name in changing]))

    def rate(value: Any) -> ca.SX:
        return ca.jtimes(ca.SX(value), moving, rates)

    seen = [
        recorded(mech, channel, at, acceleration, holding, rate if channel.name in late else no_rate)
        for channel in mech.drive.outputs
    ]
    value = column(seen)
    return _Expression(value, () if done.unknown is None else (done.unknown,))


def _observed_following(mech: Mechanism, at: Motion, h: ca.SX) -> Motion:
    """Return the motion at a node with what follows commands as it is there; under held ones it is exact as it is."""
    late = zip(mech.following, followers(mech, at), strict=True)
    seen = (
        item.observed(wanted, h) if follows_smooth_command(mech, motor) else item.states
        for motor, (item, wanted) in late
    )
    return replace(at, following=column([one for states in seen for one in states]))


def no_rate(value: Any) -> Any:
    """Return that a signal does not change."""
    return 0.0


def recorded(
    mech: Mechanism,
    channel: Channel,
    at: Motion,
    acceleration: ca.SX,
    holding: Mapping[int, Any] = NOTHING_HELD,
    rate_of: Callable[[Any], Any] = no_rate,
) -> Any:
    """Return gain * true(t - delay) + offset.

    The delay of an angle or a speed is expanded to second order by the motion's own derivatives, that of an
    acceleration or a torque to first order by `rate_of` it. What a clock of its own is fast by is a delay, too.
    `holding` are the torques that prescribe motions, by group.
    """
    value, rate, curvature = _signal(mech, channel, at, acceleration, holding)
    if channel.signal not in ("theta", "omega"):
        rate = rate_of(value)
    delay, clock = channel.delay, mech.drive.clock_of(channel)
    if clock is not None:
        delay = delay + clock.offset + clock.drift * mech.inputs[TIME]
    delayed = value - delay * rate + 0.5 * delay**2 * curvature
    return channel.gain * delayed + channel.offset


def _signal(
    mech: Mechanism, channel: Channel, at: Motion, acceleration: ca.SX, holding: Mapping[int, Any]
) -> tuple[Any, Any, Any]:
    """Return the true signal, and the first two time derivatives of an angle or a speed as far as they are known."""
    if channel.signal in ORDERS:
        theta, omega = mech.shaft_angle(channel.part, at), mech.shaft_speed(channel.part, at)
        alpha = mech.shaft_acceleration(channel.part, at, acceleration)
        if channel.eccentricity is not None:
            theta, omega, alpha = channel.eccentricity.seen((theta, omega, alpha))
        signals = {"theta": (theta, omega, alpha), "omega": (omega, alpha, 0.0), "alpha": (alpha, 0.0, 0.0)}
        return signals[channel.signal]
    if channel.signal == DRIVE_TORQUE:
        return drive_torque(mech, channel.part, at, holding), 0.0, 0.0
    motor = mech.drive.motor(channel.part)
    at = shown_lag(mech, motor, at, channel.signal)
    if mech.topology.group_of[motor.shaft] in holding and mech.drive.driving_signal(motor) is None:
        return holding_effort(mech, motor, at, holding, channel.signal), 0.0, 0.0
    value = {
        "current": motor_current,
        "torque": motor_torque,
        "voltage": motor_voltage,
    }[channel.signal](mech, motor, at)
    return value, 0.0, 0.0


def _tick(mech: Mechanism, state: State, kind: ca.SX) -> ca.SX:
    controller = mech.drive.controller
    assert controller is not None
    at = state.motion(mech)
    memory = {name: state.memory[k] for k, name in enumerate(mech.memory_names)}
    computed, applied = compute_tick(controller, seen_by_controller(mech, at), memory), apply_tick(controller, memory)
    chosen = [ca.if_else(kind < 1.5, computed[name], applied[name]) for name in mech.memory_names]
    kept = (state.angles, state.speeds, state.bristle, state.extra, state.following, state.loops, state.warmth)
    return ca.vertcat(*kept, column(chosen))


@kept(64)
def stepped(drive: Drive) -> SteppedDrive:
    """Return the discrete-time functions of a drive."""
    mech = mechanism(drive)
    state = state_symbols(mech)
    groups = len(mech.topology.roots)
    u, p = column(list(mech.inputs.values())), column(list(mech.parameters.values()))
    h, width, kind = symbol("h"), ca.SX.sym("width", groups + 1), symbol("kind")
    y, dy, ddy = (ca.SX.sym(name, len(mech.drive.outputs)) for name in ("y", "dy", "ddy"))
    arguments = [state.x, u, p, h, width]
    all_late = drive.recorded_late is not None or any(not is_off(motor.dead_time) for motor in drive.delaying)
    late = {channel.name for channel in drive.outputs if all_late or channel.delay != 0.0 or channel.clock}
    maps = {"step": _advance(mech, state, h, width), "output": _outputs(mech, state, h, width, late)}
    tick = ca.Function("tick", [state.x, u, p, kind], [_tick(mech, state, kind)]) if mech.memory_names else None
    return SteppedDrive(
        mechanism=mech,
        state_names=mech.state_names,
        input_names=tuple(mech.inputs),
        parameter_names=tuple(mech.parameters),
        output_names=tuple(channel.name for channel in mech.drive.outputs),
        step=ca.Function("step", arguments, [maps["step"].solved()]),
        output=ca.Function("output", arguments, [maps["output"].solved()]),
        tick=tick,
        start=ca.Function("start", [y, dy, ddy, u, p], [start_state(mech, y, dy, ddy)]),
        implicit={name: item.implicit(arguments) for name, item in maps.items() if item.unknowns},
    )
