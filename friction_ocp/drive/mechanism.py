"""A drive as symbolic equations of motion: one coordinate for each group of rigidly joined shafts.

The equations keep friction apart from all other torques, so that the differential-algebraic form and the
time-stepping form with exact sticking are both made from the same expressions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from friction_ocp.drive.control import ControlSignals, command, has_integral, integral_rate, memory_names, saturate
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.drive.topology import Topology, topology
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.friction.smoothing import soft_threshold, where


def symbol(name: str) -> ca.SX:
    """Return a scalar SX symbol."""
    return ca.SX.sym(name)


def deflection_names(shaft: Shaft) -> tuple[str, ...]:
    """Return the names of a shaft's bristle states: z, or z1, z2, ... where there are several."""
    count = shaft.friction.law.bristle_count
    return tuple(f"{shaft.name}.friction.z{k + 1 if count > 1 else ''}" for k in range(count))


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

    def deflections(self, bristle: ca.SX) -> dict[str, Any]:
        """Return the bristle states by shaft: (1,), or a column where a shaft has several."""
        counts = [shaft.friction.law.bristle_count for shaft in self.bristles]
        pieces = ca.vertsplit(bristle, [sum(counts[:k]) for k in range(len(counts) + 1)]) if counts else []
        return {shaft.name: piece for shaft, piece in zip(self.bristles, pieces, strict=True)}

    @property
    def extra_names(self) -> tuple[str, ...]:
        """Names of the continuous states beside motion and bristles."""
        names = [f"{motor.name}.current" for motor in self.drive.motors if self._has_winding_state(motor)]
        controller = self.drive.controller
        if controller is not None and controller.sample_time is None and has_integral(controller):
            names.append("controller.integral")
        return tuple(names)

    @property
    def memory_names(self) -> tuple[str, ...]:
        """Names of the states of a sampled controller."""
        return () if self.drive.controller is None else memory_names(self.drive.controller)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of all states in order: angles, speeds, bristles, continuous states, controller memory."""
        roots = self.topology.roots
        return (
            *(f"{roots[g]}.theta" for g in self.angle_groups),
            *(f"{roots[g]}.omega" for g in self.free_groups),
            *self.bristle_names,
            *self.extra_names,
            *self.memory_names,
        )

    def loaded_joints(self) -> tuple[Transmission, ...]:
        """Rigid joints whose transmitted torque some friction depends on: the algebraic variables."""
        joints = {self.load_joint(shaft).name for shaft in self.drive.shafts if shaft.friction.load is not None}
        return tuple(joint for joint in self.topology.rigid if joint.name in joints)

    def load_joint(self, shaft: Shaft) -> Transmission:
        """Return the transmission that loads a shaft: its output side, else its input side."""
        drive = self.drive
        onward = [item for item in drive.transmissions if item.from_shaft == shaft.name]
        backward = [item for item in drive.transmissions if item.to_shaft == shaft.name]
        if not onward + backward:
            what = "friction depends on the transmitted torque, but no transmission ends here"
            raise FrictionOcpError(Finding(f"{shaft.name}.friction.load", what, remedy="leave the load dependence out"))
        return (onward + backward)[0]

    def shaft_angle(self, name: str, motion: Motion) -> Any:
        """Return the angle of a shaft."""
        return motion.q[self.topology.group_of[name]] * self.topology.speed_ratio[name]

    def shaft_speed(self, name: str, v: ca.SX) -> Any:
        """Return the speed of a shaft for group speeds `v`."""
        return v[self.topology.group_of[name]] * self.topology.speed_ratio[name]

    def inertia(self, group: int) -> Any:
        """Return the inertia of a group, referred to its first shaft."""
        return sum(
            self.drive.shaft(name).inertia * self.topology.speed_ratio[name] ** 2
            for name in self.topology.members(group)
        )

    def true_input(self, measures: str) -> Any | None:
        """Return the true value behind the input channel that measures a signal; None where there is none."""
        for channel in self.drive.inputs:
            if channel.measures == measures:
                return (self.inputs[channel.name] - channel.offset) / channel.gain
        return None

    def elastic_torque(self, item: Transmission, motion: Motion, corner: Any) -> Any:
        """Return the torque that an elastic transmission exerts on its output shaft.

        Backlash is a dead zone of the twist whose corners are rounded by `corner` times the free play; the
        damper acts while the flanks touch.
        """
        twist = self.shaft_angle(item.from_shaft, motion) / item.ratio - self.shaft_angle(item.to_shaft, motion)
        rate = self.shaft_speed(item.from_shaft, motion.v) / item.ratio - self.shaft_speed(item.to_shaft, motion.v)
        if not isinstance(item.backlash, ca.SX) and item.backlash == 0.0:
            return item.stiffness * twist + item.damping * rate
        half = 0.5 * item.backlash
        inside = symbol("twist")
        wound = soft_threshold(inside, half, half, corner * half)
        contact = ca.substitute(ca.jacobian(wound, inside), inside, twist)
        wound = ca.substitute(wound, inside, twist)
        torque = item.stiffness * wound + item.damping * rate * contact
        return where(wound >= 0, ca.fmax(torque, 0.0), ca.fmin(torque, 0.0))

    def applied_torques(self, motion: Motion, corner: Any) -> dict[str, Any]:
        """Return the torque on every shaft other than friction and torque through rigid joints."""
        torques: dict[str, Any] = {}
        for shaft in self.drive.shafts:
            torque: Any = ca.SX(0.0)
            if shaft.gravity is not None:
                angle = self.shaft_angle(shaft.name, motion) + shaft.gravity.phase
                torque = torque - shaft.gravity.torque * ca.sin(ca.SX(angle))
            if shaft.external_torque is not None:
                torque = torque + shaft.external_torque.constant
            torques[shaft.name] = torque
        for item in self.topology.elastic:
            exerted = self.elastic_torque(item, motion, corner)
            torques[item.to_shaft] = torques[item.to_shaft] + exerted
            torques[item.from_shaft] = torques[item.from_shaft] - exerted / item.ratio
        for motor in self.drive.motors:
            torques[motor.shaft] = torques[motor.shaft] + self.motor_torque(motor, motion)
        return torques

    def motor_torque(self, motor: Motor, motion: Motion) -> Any:
        """Return the torque of a motor on its shaft, 0 while it is not enabled."""
        torque = self.true_input(f"{motor.name}.torque")
        torque = self._commanded(motor, "torque", motion) if torque is None else motor.share * torque
        if torque is not None:
            return self._enabled(motor, torque)
        current = self.motor_current(motor, motion)
        return 0.0 if current is None else motor.torque_constant * current

    def _enabled(self, motor: Motor, value: Any) -> Any:
        enable = self.true_input(f"{motor.name}.enable")
        return value if enable is None else where(enable > 0.5, value, 0.0)

    def motor_current(self, motor: Motor, motion: Motion) -> Any | None:
        """Return the winding current, 0 while the motor is not enabled; None for a motor driven by torque."""
        current = self._current(motor, motion)
        return None if current is None else self._enabled(motor, current)

    def _current(self, motor: Motor, motion: Motion) -> Any | None:
        if self._has_winding_state(motor):
            return motion.extra[self.extra_names.index(f"{motor.name}.current")]
        for signal in ("current", "current_command"):
            current = self.true_input(f"{motor.name}.{signal}")
            if current is not None:
                return motor.share * current
        commanded = self._commanded(motor, "current", motion)
        if commanded is not None:
            return commanded
        voltage = self.motor_voltage(motor, motion)
        if voltage is None:
            return None
        return (voltage - motor.torque_constant * self.shaft_speed(motor.shaft, motion.v)) / motor.resistance

    def motor_voltage(self, motor: Motor, motion: Motion) -> Any | None:
        """Return the terminal voltage; a duty controller scales the supply voltage."""
        voltage = self.true_input(f"{motor.name}.voltage")
        if voltage is not None:
            return motor.share * voltage
        commanded = self._commanded(motor, "voltage", motion)
        controller = self.drive.controller
        if commanded is None or controller is None or controller.type != "duty":
            return commanded
        supply = self.true_input(f"{motor.name}.supply_voltage")
        return commanded if supply is None else commanded * supply

    def _has_winding_state(self, motor: Motor) -> bool:
        if motor.inductance is None:
            return False
        controller = self.drive.controller
        by_input = any(channel.measures == f"{motor.name}.voltage" for channel in self.drive.inputs)
        return by_input or (controller is not None and controller.output == "voltage")

    def _commanded(self, motor: Motor, output: str, motion: Motion) -> Any | None:
        controller = self.drive.controller
        if controller is None or controller.output != output:
            return None
        if controller.sample_time is not None:
            return motor.share * motion.memory[self.memory_names.index("controller.held")]
        integral = motion.extra[self.extra_names.index("controller.integral")] if has_integral(controller) else 0.0
        return motor.share * saturate(controller, command(controller, self.seen(motion), integral))

    def seen(self, motion: Motion) -> ControlSignals:
        """Return what the controller sees through its feedback channel."""
        controller = self.drive.controller
        assert controller is not None
        channel = next(item for item in self.drive.channels if item.name == controller.feedback)
        theta = self.shaft_angle(channel.part, motion) * channel.gain + channel.offset
        omega = self.shaft_speed(channel.part, motion.v) * channel.gain
        angle, speed = self.true_input("reference.theta"), self.true_input("reference.omega")
        wanted = (0.0 if angle is None else angle, 0.0 if speed is None else speed)
        if channel.signal == "omega":
            return ControlSignals(*wanted, 0.0, omega + channel.offset, measures_speed=True)
        return ControlSignals(*wanted, theta, omega)

    def extra_rates(self, motion: Motion) -> ca.SX:
        """Return the time derivatives of the continuous states beside motion and bristles."""
        rates: list[Any] = []
        for motor in self.drive.motors:
            if self._has_winding_state(motor):
                current = motion.extra[self.extra_names.index(f"{motor.name}.current")]
                emf = motor.torque_constant * self.shaft_speed(motor.shaft, motion.v)
                driving = self._enabled(motor, self.motor_voltage(motor, motion) - emf)
                rates.append((driving - motor.resistance * current) / motor.inductance)
        if "controller.integral" in self.extra_names:
            controller = self.drive.controller
            assert controller is not None
            integral = motion.extra[self.extra_names.index("controller.integral")]
            rates.append(integral_rate(controller, self.seen(motion), integral))
        return column(rates)

    def cut(self, extra: ca.SX) -> ca.SX:
        """Return the continuous states without the winding currents of motors that are not enabled."""
        kept = list(ca.vertsplit(extra))
        for motor in self.drive.motors:
            if self._has_winding_state(motor):
                k = self.extra_names.index(f"{motor.name}.current")
                kept[k] = self._enabled(motor, kept[k])
        return column(kept)


def mechanism(drive: Drive) -> Mechanism:
    """Turn a drive into symbols; every number of the drive becomes a parameter named by its path."""
    parameters = {leaf.path: symbol(leaf.path) for leaf in drive_leaves(drive) if _is_live(drive, leaf.path)}
    bound = bind_drive(drive, parameters)
    structure = topology(bound)
    prescribed = {
        structure.group_of[channel.part]: channel.signal
        for channel in drive.inputs
        if channel.part in structure.group_of and channel.signal in ("theta", "omega")
    }
    inputs: dict[str, ca.SX] = {}
    for channel in drive.inputs:
        inputs[channel.name] = symbol(channel.name)
        if _needs_slope(channel, structure):
            inputs[f"{channel.name}'"] = symbol(f"{channel.name}'")
    return Mechanism(bound, structure, parameters, inputs, prescribed)


def _needs_slope(channel: Channel, structure: Topology) -> bool:
    return channel.part in structure.group_of and channel.signal == "theta"


def _is_live(drive: Drive, path: str) -> bool:
    """Zero backlash stays a plain number, so that a transmission without play has no dead zone at all."""
    return path not in [f"{item.name}.backlash" for item in drive.transmissions if item.backlash == 0.0]
