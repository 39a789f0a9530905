"""A drive as symbolic equations of motion: one coordinate for each group of rigidly joined shafts.

The equations keep friction apart from all other torques, so that the differential-algebraic form and the
time-stepping form with exact sticking are both made from the same expressions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from friction_ocp.drive.control import has_integral, memory_names
from friction_ocp.drive.following import STATES, Follower
from friction_ocp.drive.inputs import TIME, input_symbols, moved_from_behind
from friction_ocp.drive.live_terms import live_terms
from friction_ocp.drive.loops import Loop
from friction_ocp.drive.parts import Drive, Motor, Shaft, Transmission
from friction_ocp.drive.topology import Topology, topology
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.friction.modifiers import Surroundings, WarmUp

WARMTH = ".friction.warmth"
"""How the states are called that say how far the friction of shafts has settled, after the name of the shaft."""
ROOT_STEPS = 2
"""Newton's steps from the mean ratio back through joints with kinematic errors."""


def _is_constant(bend: Any) -> bool:
    return isinstance(bend, float) and bend == 0.0


def symbol(name: str) -> ca.SX:
    """Return a scalar SX symbol."""
    return ca.SX.sym(name)


def deflection_names(shaft: Shaft) -> tuple[str, ...]:
    """Return the names of a shaft's bristle states."""
    return tuple(f"{shaft.name}.friction.{name}" for name in shaft.friction.law.deflections)


def column(items: list[Any]) -> ca.SX:
    """Stack scalars into an SX column; an empty list gives a (0, 1) column."""
    return ca.vertcat(*[ca.SX(item) for item in items]) if items else ca.SX(0, 1)


@dataclass(frozen=True)
class Motion:
    """Angles and speeds of the groups, and the states that belong to neither."""

    q: ca.SX
    """(groups,) angles."""
    v: ca.SX
    """(groups,) speeds."""
    extra: ca.SX
    """Continuous states: winding currents and controller integrals."""
    memory: ca.SX
    """What a sampled controller holds between ticks."""
    following: ca.SX | None = None
    """What follows the commands of motors late."""
    loops: ca.SX | None = None
    """Deflections of the loops of transmissions at the start of the step; None leaves loops out."""
    warmth: ca.SX | None = None
    """How far the friction of shafts that their losses warm has settled; None is as far as time alone says."""
    h: Any = None
    """Length of the step over which torques are averaged, s; None at an instant."""
    steady: ca.SX | None = None
    """(groups,) mean speeds over that step, by which nothing is linearised."""


@dataclass(frozen=True)
class Mechanism:
    """The symbolic drive: symbols, and the torques as functions of a `Motion`."""

    drive: Drive
    """Bound to `parameters`."""
    topology: Topology
    parameters: dict[str, ca.SX]
    inputs: dict[str, ca.SX]
    """Recorded input values by channel name; `<name>'` is the slope of an input that prescribes an angle."""
    prescribed: dict[int, str]
    """Groups whose motion is an input: group -> 'theta' or 'omega'."""

    @property
    def free_groups(self) -> tuple[int, ...]:
        """Groups whose speed is a state."""
        return tuple(g for g in range(len(self.topology.roots)) if g not in self.prescribed)

    @property
    def angle_groups(self) -> tuple[int, ...]:
        """Groups whose angle is a state."""
        return tuple(g for g in range(len(self.topology.roots)) if self.prescribed.get(g) != "theta")

    @property
    def bristles(self) -> tuple[Shaft, ...]:
        """Shafts whose friction law has a bristle."""
        return tuple(shaft for shaft in self.drive.shafts if shaft.friction.law.has_bristle)

    @property
    def bristle_names(self) -> tuple[str, ...]:
        """Names of the bristle states."""
        return tuple(name for shaft in self.bristles for name in deflection_names(shaft))

    def columns(self, names: Iterable[str]) -> list[int]:
        """Return the numbers of states, by their names."""
        return [self.state_names.index(name) for name in names]

    def deflections(self, bristle: ca.SX) -> dict[str, Any]:
        """Return the bristle states by shaft: (1,), or a column where a shaft has several."""
        counts = [len(shaft.friction.law.deflections) for shaft in self.bristles]
        pieces = ca.vertsplit(bristle, [sum(counts[:k]) for k in range(len(counts) + 1)]) if counts else []
        return {shaft.name: piece for shaft, piece in zip(self.bristles, pieces, strict=True)}

    @property
    def extra_names(self) -> tuple[str, ...]:
        """Names of the continuous states beside motion and bristles."""
        names = [f"{motor.name}.current" for motor in self.drive.motors if self.has_winding_state(motor)]
        controller = self.drive.controller
        if controller is not None and controller.sample_time is None and has_integral(controller):
            names.append("controller.integral")
        return tuple(names)

    @property
    def following(self) -> tuple[Motor, ...]:
        """Motors that follow their commands late."""
        return tuple(motor for motor in self.drive.motors if self._lateness(motor))

    @property
    def following_names(self) -> tuple[str, ...]:
        """Names of the states of what follows commands late."""
        late = ((motor.name, part) for motor in self.following for part in self._lateness(motor))
        return tuple(f"{name}.{state}" for name, part in late for state in STATES[part])

    def followers(self, states: ca.SX) -> dict[str, Follower]:
        """Return what follows commands late, by motor, in given states."""
        found: dict[str, Follower] = {}
        rest = ca.vertsplit(states) if states.numel() else []
        for motor in self.following:
            late = self._lateness(motor)
            count = sum(len(STATES[part]) for part in late)
            found[motor.name] = Follower(late.get("dead_time"), late.get("lag"), tuple(rest[:count]))
            rest = rest[count:]
        return found

    def _lateness(self, motor: Motor) -> dict[str, Any]:
        """Return the times that make what drives a motor late, without a dead time that makes all outputs late."""
        if not self.drive.driving_signal(motor):
            return {}
        dead = None if motor in self.drive.delaying else motor.dead_time
        return {name: time for name, time in (("dead_time", dead), ("lag", motor.lag)) if time is not None}

    @property
    def looping(self) -> tuple[Transmission, ...]:
        """Elastic transmissions whose twist has a loop."""
        return tuple(item for item in self.topology.elastic if item.hysteresis is not None)

    @property
    def loop_names(self) -> tuple[str, ...]:
        """Names of the deflections of loops."""
        parts = ((item.name, item.hysteresis) for item in self.looping)
        return tuple(f"{name}.hysteresis.{z}" for name, loop in parts if loop is not None for z in loop.deflections)

    def loops(self, deflections: ca.SX) -> dict[str, Loop]:
        """Return the loops by transmission, with the deflections that are states."""
        found: dict[str, Loop] = {}
        rest = ca.vertsplit(deflections) if deflections.numel() else []
        for item in self.looping:
            assert item.hysteresis is not None
            count = len(item.hysteresis.deflections)
            found[item.name], rest = Loop(item.hysteresis, tuple(rest[:count])), rest[count:]
        return found

    @property
    def warming(self) -> dict[str, WarmUp]:
        """By shaft, how its friction is warmed by its own losses, where it is."""
        parts = ((shaft.name, shaft.friction.warm_up) for shaft in self.drive.shafts)
        return {name: warm_up for name, warm_up in parts if warm_up is not None and warm_up.by_losses}

    @property
    def memory_names(self) -> tuple[str, ...]:
        """Names of the states of a sampled controller."""
        return () if self.drive.controller is None else memory_names(self.drive.controller)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of all states: angles, speeds, bristles, currents and integrals, followers, loops, warmth, memory."""
        roots = self.topology.roots
        return (
            *(f"{roots[g]}.theta" for g in self.angle_groups),
            *(f"{roots[g]}.omega" for g in self.free_groups),
            *self.bristle_names,
            *self.extra_names,
            *self.following_names,
            *self.loop_names,
            *(name + WARMTH for name in self.warming),
            *self.memory_names,
        )

    def loaded_joints(self) -> tuple[Transmission, ...]:
        """Rigid joints whose transmitted torque some friction depends on: the algebraic variables."""
        joints = {joint.name for shaft in self._loaded() for joint in self.load_joints(shaft)}
        return tuple(joint for joint in self.topology.rigid if joint.name in joints)

    def load_joints(self, shaft: Shaft) -> tuple[Transmission, ...]:
        """Return the transmissions that load a shaft: all on its output side, else all on its input side.

        None load a shaft that stands alone, which its motors load; raises FrictionOcpError where it has none.
        """
        drive = self.drive
        onward = [item for item in drive.transmissions if item.from_shaft == shaft.name]
        backward = [item for item in drive.transmissions if item.to_shaft == shaft.name]
        if not (onward or backward or self.motors_on(shaft)):
            what = "friction depends on the transmitted torque, but there is neither a transmission nor a motor"
            raise FrictionOcpError(Finding(f"{shaft.name}.friction.load", what, remedy="leave the load dependence out"))
        return tuple(onward or backward)

    def motors_on(self, shaft: Shaft) -> tuple[Motor, ...]:
        """Return the motors that drive a shaft."""
        return tuple(motor for motor in self.drive.motors if motor.shaft == shaft.name)

    def loading_motors(self) -> tuple[Motor, ...]:
        """Motors whose own torque loads the friction of their shaft: a gear between them is part of that shaft."""
        alone = [shaft for shaft in self._loaded() if not self.load_joints(shaft)]
        return tuple(motor for shaft in alone for motor in self.motors_on(shaft))

    def _loaded(self) -> list[Shaft]:
        return [shaft for shaft in self.drive.shafts if shaft.friction.load is not None]

    def shaft_angle(self, name: str, motion: Motion) -> Any:
        """Return the angle of a shaft."""
        return self._turned(name, motion)[0]

    def shaft_speed(self, name: str, motion: Motion, v: ca.SX | None = None) -> Any:
        """Return the speed of a shaft, for group speeds `v` in place of those of the motion where they are given."""
        speeds = motion.v if v is None else v
        return speeds[self.topology.group_of[name]] * self.speed_ratio(name, motion)

    def shaft_acceleration(self, name: str, motion: Motion, acceleration: ca.SX) -> Any:
        """Return the acceleration of a shaft for accelerations of the groups."""
        group = self.topology.group_of[name]
        _, ratio, bend = self._turned(name, motion)
        along = acceleration[group] * ratio
        return along if _is_constant(bend) else along + bend * motion.v[group] ** 2

    def speed_ratio(self, name: str, motion: Motion) -> Any:
        """Return the speed of a shaft over that of its group, which varies where a rigid joint has an error."""
        return self._turned(name, motion)[1]

    def root_motion(self, name: str, theta: Any, omega: Any) -> tuple[Any, Any]:
        """Return angle and speed of the first shaft of a group from those of another one."""
        group, constant = self.topology.group_of[name], self.topology.speed_ratio[name]
        q, ratio = theta / constant, constant
        for _ in range(ROOT_STEPS if self.has_varying_ratios(group) else 0):
            angles = [q if g == group else 0.0 for g in range(len(self.topology.roots))]
            none = ca.SX(0, 1)
            angle, ratio, _ = self._turned(name, Motion(column(angles), none, none, none))
            q = q - (angle - theta) / ratio
        return q, omega / ratio

    def has_varying_ratios(self, group: int) -> bool:
        """Whether the speeds of the shafts of a group have ratios that vary with the angle."""
        joints = [joint for name in self.topology.members(group) for joint, _ in self.topology.path[name]]
        return any(joint.kinematic_error is not None for joint in joints)

    def _turned(self, name: str, motion: Motion) -> tuple[Any, Any, Any]:
        """Return the angle of a shaft, its derivative by the angle of its group, and the derivative of that."""
        group, constant = self.topology.group_of[name], self.topology.speed_ratio[name]
        if all(joint.kinematic_error is None for joint, _ in self.topology.path[name]):
            return motion.q[group] * constant, constant, 0.0
        angle, ratio, bend = motion.q[group], ca.SX(1.0), ca.SX(0.0)
        for joint, forward in self.topology.path[name]:
            scale = 1.0 / joint.ratio if forward else joint.ratio
            slope, curve, error = scale, 0.0, 0.0
            if joint.kinematic_error is not None:
                passed = None if motion.steady is None else motion.h * motion.steady[group] * ratio
                error = joint.kinematic_error.value(angle)
                slope = scale + joint.kinematic_error.slope(angle, passed)
                curve = joint.kinematic_error.bend(angle, passed)
            angle, ratio, bend = scale * angle + error, slope * ratio, curve * ratio**2 + slope * bend
        return angle, ratio, bend

    def angle_passed(self, name: str, motion: Motion) -> tuple[Any, Any]:
        """Return the angle of a shaft and what it passes in the step over which torques are averaged."""
        passed = None if motion.steady is None else motion.h * self.shaft_speed(name, motion, motion.steady)
        return self.shaft_angle(name, motion), passed

    def surroundings(self, shaft: Shaft, motion: Motion) -> Surroundings:
        """Return what the friction of a shaft depends on beside speed and load."""
        theta, passed = self.angle_passed(shaft.name, motion)
        warm = list(self.warming)
        warmth = motion.warmth[warm.index(shaft.name)] if motion.warmth is not None and shaft.name in warm else None
        return Surroundings(theta, passed, self.inputs.get(TIME, 0.0), self.true_input("temperature"), warmth)

    def inertia(self, group: int, motion: Motion | None = None) -> Any:
        """Return the inertia of a group, referred to its first shaft; without a motion that of the mean ratios."""
        ratios = {
            name: self.topology.speed_ratio[name] if motion is None else self.speed_ratio(name, motion)
            for name in self.topology.members(group)
        }
        return sum(self.drive.shaft(name).inertia * ratio**2 for name, ratio in ratios.items())

    def inertial_torque(self, group: int, motion: Motion) -> Any:
        """Return the torque on a group that its speed makes as ratios vary: half the slope of its inertia, squared."""
        if not self.has_varying_ratios(group):
            return 0.0
        turned = {name: self._turned(name, motion) for name in self.topology.members(group)}
        half = sum(self.drive.shaft(name).inertia * ratio * bend for name, (_, ratio, bend) in turned.items())
        return half * motion.v[group] ** 2

    def true_input(self, measures: str) -> Any | None:
        """Return the true value behind the input channel that measures a signal; None where there is none."""
        for channel in self.drive.inputs:
            if channel.measures == measures:
                return (self.inputs[channel.name] - channel.offset) / channel.gain
        return None

    def has_winding_state(self, motor: Motor) -> bool:
        """Whether the current of a motor is a state: driven by voltage through an inductance."""
        return motor.inductance is not None and self.drive.driving_signal(motor) == "voltage"


FEEDBACK_DELAY = "controller.feedback_delay"
"""The delay with which the controller sees its channel: that of the channel, and all of it where the samples of its
recording are read earlier."""


def has_late_feedback(drive: Drive) -> bool:
    """Whether the controller sees its channel late."""
    controller = drive.controller
    return controller is not None and any(c.name == controller.feedback and c.delay != 0.0 for c in drive.channels)


def mechanism(drive: Drive) -> Mechanism:
    """Turn a drive into symbols; every number of its live terms becomes a parameter named by its path.

    Raises FrictionOcpError where friction depends on a temperature that is not an input, or rigid joints form a loop.
    """
    live = live_terms(drive)
    parameters = {leaf.path: symbol(leaf.path) for leaf in drive_leaves(live)}
    if has_late_feedback(live):
        parameters[FEEDBACK_DELAY] = symbol(FEEDBACK_DELAY)
    bound = bind_drive(live, parameters)
    structure = topology(bound)
    prescribed = {structure.group_of[channel.part]: channel.signal for channel in drive.prescribing}
    if findings := list(moved_from_behind(live, structure)):
        raise FrictionOcpError(findings)
    return Mechanism(bound, structure, parameters, input_symbols(live, structure), prescribed)
