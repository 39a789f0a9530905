"""Drives, grids and requests on which the kernels of a sweep are tested."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.parts import (
    Channel,
    Cogging,
    Controller,
    Disturbance,
    Drive,
    Eccentricity,
    Gravity,
    Hysteresis,
    KinematicError,
    Motor,
    Shaft,
    TorqueRipple,
    Transmission,
)
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.drive.values import drive_leaves
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.modifiers import Ripple, WarmUp
from friction_ocp.friction.static import CoulombViscous, Stribeck
from friction_ocp.simulation.grid import InputSignal, build_grid
from friction_ocp.simulation.kernel import SweepRequest

TORQUE = Channel("torque", "motor.torque", "input")
STRIBECK = Stribeck(tau_c=0.1, tau_s=0.15, omega_s=2.0, viscous=0.02, delta=1.5)
MOTOR = Motor("motor", "motor")


def outputs(*signals: str) -> tuple[Channel, ...]:
    """Return output channels of these signals."""
    return tuple(Channel(signal, signal) for signal in signals)


def one_mass() -> Drive:
    """A mass with Stribeck friction and gravity."""
    shaft = Shaft("motor", 0.01, FrictionElement(STRIBECK), Gravity(0.2, 0.3))
    return Drive((shaft,), (), (MOTOR,), None, (TORQUE, *outputs("motor.theta", "motor.omega")))


def two_masses() -> Drive:
    """Two masses joined by a spring with backlash."""
    shafts = (
        Shaft("motor", 0.01, FrictionElement(CoulombViscous(0.1, 0.02))),
        Shaft("load", 0.2, FrictionElement(CoulombViscous(0.2, 0.1))),
    )
    joint = Transmission("motor", "load", 4.0, stiffness=50.0, damping=0.3, backlash=0.02)
    return Drive(shafts, (joint,), (MOTOR,), None, (TORQUE, *outputs("motor.theta", "load.theta", "load.alpha")))


def lugre() -> Drive:
    """A mass on a bristle."""
    law = LuGre(tau_c=0.1, tau_s=0.15, omega_s=1.0, sigma0=20.0, sigma1=0.1, sigma2=0.02)
    return Drive((Shaft("motor", 0.01, FrictionElement(law)),), (), (MOTOR,), None, (TORQUE, *outputs("motor.omega")))


def loaded_joint() -> Drive:
    """A geared pendulum whose friction grows with the torque through the rigid gear; one delayed sensor."""
    shafts = (
        Shaft("motor", 0.01, FrictionElement(STRIBECK, LoadDependence(0.1, 0.05))),
        Shaft("load", 0.1, FrictionElement(CoulombViscous(0.05, 0.02)), Gravity(1.0)),
    )
    delayed = Channel("angle", "load.theta", delay=2e-3)
    return Drive(
        shafts, (Transmission("motor", "load", 3.0),), (MOTOR,), None, (TORQUE, delayed, *outputs("load.alpha"))
    )


def sampled() -> Drive:
    """A cascade whose commands reach the motor 1.4 ticks late, with a winding and saturation."""
    controller = Controller(
        "cascade", "angle", kp=8.0, ki=3.0, kd=0.6, sample_time=7e-3, delay=9.8e-3, saturation=(-4.0, 4.0)
    )
    motor = Motor("motor", "motor", torque_constant=0.2, resistance=2.0, inductance=5e-3)
    reference = Channel("torque", "reference.theta", "input")
    shaft = Shaft("motor", 0.01, FrictionElement(CoulombViscous(0.05, 0.01)))
    return Drive((shaft,), (), (motor,), controller, (reference, Channel("angle", "motor.theta")))


def every_term() -> Drive:
    """A mass with every term that varies with angle, time and temperature."""
    period, warm_up = 0.4, WarmUp(0.01, -0.3, 0.2, 20.0)
    friction = FrictionElement(STRIBECK, ripple=Ripple(0.2, -0.1, period), warm_up=warm_up)
    shaft = Shaft("motor", 0.01, friction, disturbance=Disturbance(0.05, 0.02, 0.1))
    motor = Motor("motor", "motor", cogging=Cogging(0.02, 0.03, period), torque_ripple=TorqueRipple(0.1, 0.2, period))
    eccentric = Channel("angle", "motor.theta", delay=1e-3, eccentricity=Eccentricity(0.01, 0.02))
    warm = Channel("temperature", "temperature", "input")
    return Drive((shaft,), (), (motor,), None, (TORQUE, warm, eccentric, *outputs("motor.alpha")))


def every_flaw_of_a_joint() -> Drive:
    """Two masses on a spring that stiffens, with play, a loop and a kinematic error; a late motor that saturates."""
    shafts = (
        Shaft("motor", 0.01, FrictionElement(CoulombViscous(0.1, 0.02))),
        Shaft("load", 0.2, FrictionElement(CoulombViscous(0.2, 0.1), LoadDependence(0.1))),
    )
    joint = Transmission(
        *("motor", "load", 4.0, 50.0, 0.3, 0.02, 400.0),
        hysteresis=Hysteresis(0.4, 0.05),
        kinematic_error=KinematicError(0.01, 0.02, 0.5),
    )
    motor = Motor("motor", "motor", lag=0.01, saturation=0.5)
    return Drive(shafts, (joint,), (motor,), None, (TORQUE, *outputs("motor.theta", "load.omega", "motor.torque")))


def rippling_ratio() -> Drive:
    """A geared pendulum whose rigid ratio ripples and whose friction grows with the torque through the gear."""
    shafts = (
        Shaft("motor", 0.01, FrictionElement(STRIBECK, LoadDependence(0.1, 0.05))),
        Shaft("load", 0.1, FrictionElement(CoulombViscous(0.05, 0.02)), Gravity(1.0)),
    )
    joint = Transmission("motor", "load", 3.0, kinematic_error=KinematicError(0.01, 0.02, 0.8))
    return Drive(shafts, (joint,), (MOTOR,), None, (TORQUE, *outputs("load.theta", "load.omega")))


DRIVES = {
    "rippling ratio": rippling_ratio,
    "every flaw of a joint": every_flaw_of_a_joint,
    "every term": every_term,
    "one mass": one_mass,
    "two masses": two_masses,
    "lugre": lugre,
    "loaded joint": loaded_joint,
    "sampled controller": sampled,
}


@dataclass(frozen=True)
class Case:
    """A stepped drive, three segments of an irregular grid, and the numbers that are differentiated."""

    drive: Drive
    model: SteppedDrive = field(init=False)
    numbers: np.ndarray = field(init=False)
    active: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        model = stepped(self.drive)
        values = {leaf.path: leaf.value for leaf in drive_leaves(self.drive)}
        numbers = np.array([float(values[name]) for name in model.parameter_names])
        active = [k for k, name in enumerate(model.parameter_names) if numbers[k] != 0 and "gain" not in name]
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "numbers", numbers)
        object.__setattr__(self, "active", tuple(active))

    def request(self, rng: np.random.Generator, width: float = 0.2, derivatives: bool = True) -> SweepRequest:
        """Return a request with 60 samples at irregular times, one to three substeps each."""
        time = np.cumsum(rng.uniform(1e-3, 9e-3, 60))
        signal = InputSignal(time, 0.6 * np.sin(12.0 * time) + 0.1 * rng.standard_normal(60), False)
        given = {"temperature": InputSignal(time, 25.0 + 10.0 * time, False), TIME: InputSignal(time, time, False)}
        signals = [given.get(name, signal) for name in self.model.input_names]
        grid = build_grid(time, signals, self.drive.controller, 3.5e-3)
        first = np.array([0, 17, 41, grid.time.size - 1])
        x0 = 0.3 * rng.standard_normal((3, len(self.model.state_names)))
        x0[:, [k for k, name in enumerate(self.model.state_names) if name.endswith(".z")]] *= 0.01
        widths = np.full(len(self.model.mechanism.topology.roots) + 1, width)
        return SweepRequest(grid, first, x0, self.numbers, widths, derivatives, with_states=True)
