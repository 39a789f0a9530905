"""A drive as what simulators of mechanisms know: joints with armature, damping, friction loss, springs and actuators.

What they cannot express is named, one `Loss` a term.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import scipy.optimize as _optimize  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.drive.mechanism import mechanism
from friction_ocp.drive.parts import Drive, Motion, Motor, Shaft, Transmission
from friction_ocp.drive.topology import Topology, topology
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.friction.static import Coulomb, CoulombViscous, NoFriction, Viscous
from friction_ocp.parameters import is_off
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.targets.fitted import Fitted, both_ways

optimize: Any = _optimize  # its own types are incomplete

CURVE_POINTS = 200


@dataclass(frozen=True)
class Loss:
    """A term of the drive that the target cannot express, and what stands in its place."""

    term: str
    instead: str

    def __str__(self) -> str:
        return f"{self.term}: {self.instead}"


@dataclass(frozen=True)
class Joint:
    """One coordinate: a body that turns or slides, with everything that is rigidly geared to it."""

    name: str
    """That of the shaft whose angle is the coordinate."""
    group: int
    speed: float
    """Speed of the coordinate over that of the group's first shaft."""
    motion: Motion
    inertia: float
    armature: float
    """Inertia of the other shafts of the group, reflected; 0 where it is all the inertia that there is."""
    damping: float
    friction: float
    """Coulomb friction."""
    gravity: tuple[float, float] | None
    """Torque at 90 deg and phase."""
    constant: float
    """Torque that does not change."""


@dataclass(frozen=True)
class Spring:
    """An elastic transmission: its twist is the sum of `coefficients` times coordinates."""

    name: str
    coefficients: tuple[tuple[str, float], ...]
    stiffness: float
    damping: float
    play: float


@dataclass(frozen=True)
class Actuator:
    """A motor: torque on a coordinate = gear (gain command + bias speed of the coordinate times gear)."""

    name: str
    joint: str
    gear: float
    """Speed of the motor's shaft over that of the coordinate."""
    gain: float
    bias: float
    """N m s/rad at the motor's shaft: what the back-EMF takes."""
    command: str
    """torque, current or voltage."""
    lag: float


@dataclass(frozen=True)
class JointDrive:
    """A drive as joints, springs and actuators, and what is lost."""

    joints: tuple[Joint, ...]
    springs: tuple[Spring, ...]
    actuators: tuple[Actuator, ...]
    losses: tuple[Loss, ...]


def joint_drive(fitted: Fitted, elastic: bool = True) -> JointDrive:
    """Return a fitted drive as joints; without `elastic` its springs become rigid, which is a loss of its own."""
    drive, losses = fitted.drive, list[Loss]()
    if not elastic:
        drive, losses = _rigid(drive)
    mech = mechanism(fitted.model.problem.drive)
    if mech.prescribed:
        what = "a shaft is moved by an input channel"
        raise FrictionOcpError(Finding(str(fitted.source), what, "drives whose motors are driven"))
    structure = topology(drive)
    top = {name: item.top for name, item in fitted.model.speeds.items()}
    joints = tuple(_joint(drive, structure, group, top, losses) for group in range(len(structure.roots)))
    springs = tuple(_spring(item, structure, joints) for item in structure.elastic)
    signals = {motor.name: mech.drive.driving_signal(motor) for motor in drive.motors}
    actuators = tuple(
        _actuator(motor, str(signals[motor.name]), structure, joints, losses)
        for motor in drive.motors
        if signals[motor.name]
    )
    late = [item for item in fitted.model.problem.drive.motors if not is_off(item.dead_time)]
    losses += [Loss(f"{item.name}.dead_time", "left out") for item in late]
    if drive.controller is not None:
        losses.append(Loss("controller", "left out: the actuators take its output as their command"))
    losses += [loss for item in drive.transmissions for loss in _transmission_losses(item)]
    return JointDrive(joints, springs, actuators, tuple(losses))


def _rigid(drive: Drive) -> tuple[Drive, list[Loss]]:
    losses = [
        Loss(f"{item.name}.stiffness = {float(item.stiffness):.4g}", "the shafts turn as one")
        for item in drive.transmissions
        if not item.rigid
    ]
    stiff = tuple(
        replace(item, stiffness=None, damping=0.0, backlash=None, stiffening=None, second_stage=None, hysteresis=None)
        for item in drive.transmissions
    )
    return replace(drive, transmissions=stiff), losses


def _joint(drive: Drive, structure: Topology, group: int, top: dict[str, float], losses: list[Loss]) -> Joint:
    shafts = [drive.shaft(name) for name in structure.members(group)]
    chosen = next((shaft for shaft in reversed(shafts) if shaft.gravity is not None), shafts[-1])
    scale = float(structure.speed_ratio[chosen.name])
    ratio = {shaft.name: float(structure.speed_ratio[shaft.name]) / scale for shaft in shafts}
    friction = damping = constant = 0.0
    for shaft in shafts:
        level, slope = _coulomb_viscous(shaft, top.get(shaft.name, 0.0), losses)
        friction += level * abs(ratio[shaft.name])
        damping += slope * ratio[shaft.name] ** 2
        if shaft.external_torque is not None:
            constant += float(shaft.external_torque.constant) * ratio[shaft.name]
    losses += [loss for shaft in shafts for loss in _shaft_losses(shaft, chosen)]
    gravity = None
    if chosen.gravity is not None and chosen.motion == "rotary":
        gravity = (float(chosen.gravity.torque), float(chosen.gravity.phase))
    own = float(chosen.inertia)
    reflected = sum(float(shaft.inertia) * ratio[shaft.name] ** 2 for shaft in shafts if shaft is not chosen)
    return Joint(
        name=chosen.name,
        group=group,
        speed=scale,
        motion=chosen.motion,
        inertia=own or reflected,  # no program takes a body without inertia
        armature=reflected if own else 0.0,
        damping=damping,
        friction=friction,
        gravity=gravity,
        constant=constant,
    )


def _coulomb_viscous(shaft: Shaft, top: float, losses: list[Loss]) -> tuple[float, float]:
    """Return Coulomb and viscous friction of a shaft: its own, or those nearest to its curve up to its top speed."""
    law = shaft.friction.law
    if isinstance(law, NoFriction):
        return 0.0, 0.0
    positive, negative = law.along("positive"), law.along("negative")
    speed = np.linspace(0.0, top or 1.0, CURVE_POINTS)[1:]
    curves = [np.array([float(side.magnitude(one)) for one in speed]) for side in (positive, negative)]
    mean = 0.5 * (curves[0] + curves[1])
    exact = isinstance(law, (Coulomb, Viscous, CoulombViscous))
    level, slope = (max(float(number), 0.0) for number in _line(speed, mean))
    if exact:
        level, slope = (float(np.mean(both_ways(getattr(law, key, 0.0)))) for key in ("tau_c", "viscous"))
    where, line = f"{shaft.name}.friction", f"{level:.4g} + {slope:.4g} |speed|"
    if not exact:
        losses.append(Loss(f"{where}.law = {law.name}", f"{line}, the nearest line up to {speed[-1]:.3g}"))
    if not np.allclose(*curves, rtol=1e-9):
        losses.append(Loss(f"{where} by direction", f"{line}, the mean of both directions"))
    return level, slope


def _line(speed: FloatArray, torque: FloatArray) -> tuple[float, float]:
    """Return the line without negative numbers that is nearest to a curve."""
    columns = np.column_stack([np.ones_like(speed), speed / speed[-1]])
    solution: FloatArray = optimize.nnls(columns, np.maximum(torque, 0.0))[0]
    least = 1e-9 * float(np.max(solution, initial=0.0))  # what rounding leaves of a level or of a line through zero
    level, rise = (float(number) if number > least else 0.0 for number in solution)
    return level, rise / float(speed[-1])


def _shaft_losses(shaft: Shaft, chosen: Shaft) -> Iterator[Loss]:
    for key in ("load", "ripple", "warm_up"):
        term = getattr(shaft.friction, key)
        if term is not None:
            known = {item.name: getattr(term, item.name) for item in fields(term)}
            numbers = ", ".join(f"{key} = {_shown(value)}" for key, value in known.items() if value is not None)
            yield Loss(f"{shaft.name}.friction.{key} ({numbers})", "left out")
    if shaft.disturbance is not None:
        yield Loss(f"{shaft.name}.disturbance", "left out")
    if shaft.gravity is not None and (shaft is not chosen or shaft.motion == "linear"):
        yield Loss(f"{shaft.name}.gravity", f"left out: the coordinate is that of {chosen.name}")


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _transmission_losses(item: Transmission) -> Iterator[Loss]:
    for key in ("stiffening", "second_stage", "hysteresis", "kinematic_error"):
        if getattr(item, key) is not None:
            yield Loss(f"{item.name}.{key}", "left out")
    if item.backlash is not None and float(item.damping or 0.0) > 0.0:
        yield Loss(f"{item.name}.damping", "acts within the free play too")


def _spring(item: Transmission, structure: Topology, joints: tuple[Joint, ...]) -> Spring:
    parts: list[tuple[str, float]] = []
    for name, factor in ((item.from_shaft, 1.0 / float(item.ratio)), (item.to_shaft, -1.0)):
        joint = joints[structure.group_of[name]]
        parts.append((joint.name, factor * float(structure.speed_ratio[name]) / joint.speed))
    return Spring(item.name, tuple(parts), float(item.stiffness), float(item.damping), float(item.backlash or 0.0))


def _actuator(
    motor: Motor, command: str, structure: Topology, joints: tuple[Joint, ...], losses: list[Loss]
) -> Actuator:
    joint = joints[structure.group_of[motor.shaft]]
    gear = float(structure.speed_ratio[motor.shaft]) / joint.speed
    constant = float(motor.torque_constant)
    gain, bias = {"torque": (1.0, 0.0), "current": (constant, 0.0)}.get(command, (0.0, 0.0))
    if command == "voltage":
        gain, bias = constant / float(motor.resistance), -(constant**2) / float(motor.resistance)
        if motor.inductance is not None:
            seconds = float(motor.inductance) / float(motor.resistance)
            losses.append(Loss(f"{motor.name}.inductance", f"left out: the current follows within {seconds:.3g} s"))
    for key in ("cogging", "torque_ripple", "saturation"):
        if getattr(motor, key) is not None:
            losses.append(Loss(f"{motor.name}.{key}", "left out"))
    if float(motor.share) != 1.0:
        losses.append(Loss(f"{motor.name}.share", f"left out: it takes {float(motor.share):.4g} x what was recorded"))
    return Actuator(motor.name, joint.name, gear, gain, bias, command, float(motor.lag or 0.0))
