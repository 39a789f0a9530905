"""A drive as a differential-algebraic system in continuous time, for the integrators of CasADi.

Friction is single-valued here: its jump at standstill is smoothed over a speed `width`. The exact, set-valued drive
is the stepped one (stepping.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from friction_ocp.dae import Dae, Variable
from friction_ocp.drive.coordinates import group_accelerations, group_angles, group_speeds
from friction_ocp.drive.holding import holding_torques
from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.kick import losses, motor_loads, through_joint, transmitted_torque
from friction_ocp.drive.mechanism import FEEDBACK_DELAY, WARMTH, Mechanism, Motion, column, mechanism, symbol
from friction_ocp.drive.motors import extra_rates, following_rates
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.stepping import recorded
from friction_ocp.drive.torques import applied_torques, elastic_torque, loop_rates
from friction_ocp.drive.units import command_unit, signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.quantities import si_unit

HELD = "controller.held"
"""The command of a sampled controller: an input here, constant between its ticks."""


@dataclass(frozen=True)
class _Symbols:
    """The symbols of a drive that are neither its inputs nor its parameters."""

    angles: ca.SX
    speeds: ca.SX
    bristle: ca.SX
    extra: ca.SX
    following: ca.SX
    loops: ca.SX
    warmth: ca.SX
    memory: ca.SX
    torques: ca.SX
    """(joints,) torques through rigid joints that friction depends on: the algebraic variables."""

    @property
    def parts(self) -> tuple[ca.SX, ...]:
        """The states by their kind."""
        return self.angles, self.speeds, self.bristle, self.extra, self.following, self.loops, self.warmth

    @property
    def x(self) -> list[ca.SX]:
        """The states."""
        return [item for part in self.parts for item in ca.vertsplit(part)]


def dae(drive: Drive, width: float) -> Dae:
    """Return the drive in continuous time; static friction is multiplied by the sign of its shaft's speed, which is
    smoothed over `width` > 0 in the unit of that speed, and backlash is rounded over that share of the free play.

    The torque through a rigid joint is an algebraic variable where friction depends on it. The command of a sampled
    controller becomes the input `controller.held`. Raises FrictionOcpError for a width that is not positive.
    """
    if width <= 0:
        what = f"width = {width:g} rad/s leaves a jump that no integrator can pass"
        raise FrictionOcpError(Finding("dae", what, "width > 0", "use the stepped drive for exact friction"))
    mech = _as_late_as_recorded(mechanism(drive))
    symbols = _symbols(mech)
    groups = group_angles(mech, symbols.angles), group_speeds(mech, symbols.speeds)
    at = Motion(*groups, symbols.extra, symbols.memory, symbols.following, symbols.loops, symbols.warmth)
    torques = applied_torques(mech, at, width)
    load = _loads(mech, symbols, at, width)
    friction, rates = _friction(mech, symbols, at, load, width)
    free = column([_acceleration(mech, at, g, torques, friction) for g in range(len(mech.topology.roots))])
    acceleration = group_accelerations(mech, free)
    holding = holding_torques(mech, at, acceleration, torques, friction)
    found = column([through_joint(mech, joint, at, acceleration, torques, friction) for joint in mech.loaded_joints()])
    turning = [at.v[g] for g in mech.angle_groups]
    speeding = [acceleration[g] for g in mech.free_groups]
    outputs = [recorded(mech, channel, at, acceleration, holding) for channel in mech.drive.outputs]
    return Dae(
        states=_states(mech, symbols),
        algebraic=_algebraic(mech, symbols),
        inputs=_inputs(mech, symbols),
        parameters=_parameters(drive, mech),
        outputs=tuple(
            Variable(channel.name, signal_unit(drive, channel.measures), ca.SX(value))
            for channel, value in zip(mech.drive.outputs, outputs, strict=True)
        ),
        ode=ca.vertcat(
            *(column([*turning, *speeding, *rates]), extra_rates(mech, at), following_rates(mech, at)),
            loop_rates(mech, at),
            _warmth_rates(mech, symbols, at, load),
        ),
        alg=symbols.torques - found,
    )


def _symbols(mech: Mechanism) -> _Symbols:
    counts = (
        *(mech.angle_groups, mech.free_groups, mech.bristle_names, mech.extra_names),
        *(mech.following_names, mech.loop_names, mech.warming),
    )
    names = iter(mech.state_names)
    angles, speeds, bristle, *others = (column([symbol(next(names)) for _ in part]) for part in counts)
    extra, following, loops, warmth = others
    memory = column([symbol(name) if name == HELD else 0.0 for name in mech.memory_names])
    joints = column([symbol(f"{joint.name}.torque") for joint in mech.loaded_joints()])
    return _Symbols(angles, speeds, bristle, extra, following, loops, warmth, memory, joints)


def _loads(mech: Mechanism, symbols: _Symbols, at: Motion, width: float) -> dict[str, Any]:
    elastic = {item.name: elastic_torque(mech, item, at, width) for item in mech.topology.elastic}
    rigid = {joint.name: symbols.torques[k] for k, joint in enumerate(mech.loaded_joints())}
    return elastic | rigid | motor_loads(mech, at)


def _friction(
    mech: Mechanism, symbols: _Symbols, at: Motion, load: dict[str, Any], width: float
) -> tuple[dict[str, Any], list[Any]]:
    """Return the friction torque on every shaft, and the rates of the bristles."""
    friction: dict[str, Any] = {}
    rates: list[Any] = []
    deflection = mech.deflections(symbols.bristle)
    for shaft in mech.drive.shafts:
        omega, transmitted = mech.shaft_speed(shaft.name, at), transmitted_torque(mech, shaft, load)
        element = shaft.friction.under(mech.surroundings(shaft, at))
        if shaft.name in deflection:
            torque, rate = element.bristle_torque(omega, deflection[shaft.name], transmitted)
            rates.append(rate)
        else:
            torque = element.torque(omega, transmitted, width)
        friction[shaft.name] = torque
    return friction, rates


def _warmth_rates(mech: Mechanism, symbols: _Symbols, at: Motion, load: dict[str, Any]) -> ca.SX:
    lost = enumerate(losses(mech, at, load))
    return column([warm_up.rate(symbols.warmth[k], loss) for k, (warm_up, loss) in lost])


def _acceleration(mech: Mechanism, at: Motion, group: int, torques: dict[str, Any], friction: dict[str, Any]) -> Any:
    """Return the acceleration of a group; 0 where its motion is an input."""
    if group in mech.prescribed:
        return 0.0
    members = mech.topology.members(group)
    moving = sum(mech.speed_ratio(name, at) * (torques[name] - friction[name]) for name in members)
    return (moving - mech.inertial_torque(group, at)) / mech.inertia(group, at)


def _states(mech: Mechanism, symbols: _Symbols) -> tuple[Variable, ...]:
    return tuple(Variable(item.name(), _state_unit(mech, item.name()), item) for item in symbols.x)


def _state_unit(mech: Mechanism, name: str) -> str:
    drive, (part, _, signal) = mech.drive, name.partition(".")
    if drive.controller is not None and part == "controller":
        return command_unit(drive, drive.controller)
    if name in mech.following_names:
        return signal_unit(drive, f"{part}.{mech.drive.driving_signal(drive.motor(part))}")
    if name.endswith(WARMTH):
        return si_unit("dimensionless")
    twisted = signal.startswith("hysteresis.z")
    if twisted:
        part = next(item.to_shaft for item in mech.looping if item.name == part)
    deflected = twisted or signal.startswith("friction.z")
    return si_unit("angle", drive.shaft(part).motion) if deflected else signal_unit(drive, name)


def _algebraic(mech: Mechanism, symbols: _Symbols) -> tuple[Variable, ...]:
    units = [si_unit("torque", mech.drive.shaft(joint.to_shaft).motion) for joint in mech.loaded_joints()]
    items = ca.vertsplit(symbols.torques)
    return tuple(Variable(item.name(), unit, item) for item, unit in zip(items, units, strict=True))


def _inputs(mech: Mechanism, symbols: _Symbols) -> tuple[Variable, ...]:
    given = [Variable(name, _input_unit(mech.drive, name), item) for name, item in mech.inputs.items()]
    held = [item for item in ca.vertsplit(symbols.memory) if item.is_symbolic()]
    return (*given, *(Variable(HELD, _state_unit(mech, HELD), item) for item in held))


def _input_unit(drive: Drive, name: str) -> str:
    if name == TIME:
        return si_unit("time")
    measures = next(channel.measures for channel in drive.inputs if channel.name == name.rstrip("'"))
    order = len(name) - len(name.rstrip("'"))
    return signal_unit(drive, measures) + ("", "/s", "/s^2")[order]


def _parameters(drive: Drive, mech: Mechanism) -> tuple[Variable, ...]:
    units = {leaf.path: unit_of(leaf, drive) for leaf in drive_leaves(drive)}
    return tuple(Variable(name, units[name], item) for name, item in mech.parameters.items() if name in units)


def _as_late_as_recorded(mech: Mechanism) -> Mechanism:
    """Return a mechanism whose controller sees its channel with the delay of the channel."""
    controller = mech.drive.controller
    if controller is None or FEEDBACK_DELAY not in mech.parameters:
        return mech
    delay = mech.parameters[f"{controller.feedback}.delay"]
    return replace(mech, parameters={**mech.parameters, FEEDBACK_DELAY: delay})
