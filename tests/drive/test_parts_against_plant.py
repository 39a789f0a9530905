"""Gravity, backlash, motors, enable, prescribed motion and branches: the stepped drive against the plant."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from plant import (
    Plant,
    PlantFriction,
    PlantMotor,
    PlantSaturation,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
    reversing_steps,
)
from twin import Bench, Twin, drive_of, worst

from friction_ocp.drive.parts import Channel

STEP_ERROR = 3e-4
"""Relative error of steps of 1 ms with stops and joints of up to 100 rad/s."""
WINDING = 1e-2
"""Share of a voltage step that a winding of 2.5 ms gets wrong in its first steps of 1 ms."""
IRON = 2e-3
"""The plant takes what saturation leaves from the current of its step before."""
BOUNCES = 2e-2
"""Steps of 1 ms find the instant of an impact only so well, and every bounce carries that on."""
ROUNDING = 1e-12

FRICTION = PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.001)
CURRENT = (PlantMotor("drive", "motor", torque_constant=0.5),)
ENABLE = Trajectory(np.array([0.0, 0.5, 0.8, 1.2, 1.203]), np.array([1.0, 0.0, 1.0, 0.0, 1.0]))


def reversals(size: float = 1.0) -> Trajectory:
    """Steps of three sizes and both signs."""
    return reversing_steps(size * np.array([0.2, 0.5, 1.0]), (0.1, 0.3), 2.0, np.random.default_rng(0))


def test_gravity_and_constant_torque_follow_the_plant() -> None:
    """An unbalanced shaft under a constant torque moves, hangs and sticks as in the plant."""
    shaft = PlantShaft("motor", 0.01, FRICTION, gravity=(0.3, 0.4), external_torque=0.02)
    truth, run = Twin(Plant((shaft,), (), CURRENT), {"drive.current": reversals()}).run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega") < STEP_ERROR


def test_a_pendulum_swings_with_its_own_period() -> None:
    """A frictionless pendulum of small swing follows its cosine, in the phase of its gravity."""
    plant = Plant((PlantShaft("arm", 0.5, gravity=(8.0, 0.4)),))
    run = Bench(drive_of(plant, {})).run(3.0, {}, {"arm.theta": -0.4 + 1e-4})
    small_swing = 1e-4 * 1e-4
    assert run["arm.theta"] == pytest.approx(-0.4 + 1e-4 * np.cos(4.0 * run.time), abs=small_swing)


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_backlash_follows_the_plant(damping: float) -> None:
    """Crossing its free play and bouncing off the flanks, the load is carried where the plant carries it."""
    load = PlantShaft("load", 0.2, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.05))
    joint = PlantTransmission("motor", "load", 5.0, 400.0, damping, 0.02)
    twin = Twin(Plant((PlantShaft("motor", 0.01, FRICTION), load), (joint,), CURRENT), {"drive.current": reversals()})
    truth, run = twin.run(2.0)
    assert worst(truth, run, "motor.theta", "load.theta") < BOUNCES
    finer = twin.bench.run(2.0, {"drive.current": reversals()}, step=5e-5)
    assert worst(truth, finer, "motor.theta", "load.theta") < 0.1 * BOUNCES


def test_backlash_carries_nothing_inside_the_gap() -> None:
    """Within the free play both shafts move at exactly constant speed; a contact only ever pushes."""
    joint = PlantTransmission("motor", "load", 5.0, 400.0, 4.0, 0.02)
    plant = Plant((PlantShaft("motor", 0.01), PlantShaft("load", 0.2)), (joint,))
    run = Bench(drive_of(plant, {})).run(1.0, {}, {"motor.omega": 1.0})
    twist = run["motor.theta"] / 5.0 - run["load.theta"]
    change = np.diff(run["load.omega"])
    inside = np.maximum(np.abs(twist[1:]), np.abs(twist[:-1])) < 0.01 - 1e-4
    assert np.sum(inside) > 50 and np.all(change[inside] == 0.0)
    assert np.all(change * (twist[1:] + twist[:-1]) >= 0.0) and np.any(change > 0) and np.any(change < 0)


@pytest.mark.parametrize("inductance", [0.0, 5e-3])
@pytest.mark.parametrize("with_enable", [False, True])
def test_a_voltage_motor_follows_the_plant(inductance: float, with_enable: bool) -> None:
    """Current, torque, speed and angle agree, with and without winding inductance, also while not enabled."""
    motor = PlantMotor("drive", "motor", "voltage", 0.1, 2.0, inductance, share=0.8)
    sensors = (PlantSensor("current", "drive.current"), PlantSensor("torque", "drive.torque"))
    inputs = {"drive.voltage": reversals(12.0)} | ({"drive.enable": ENABLE} if with_enable else {})
    plant = Plant((PlantShaft("motor", 1e-3, FRICTION),), (), (motor,), sensors=sensors)
    truth, run = Twin(plant, inputs).run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega") < STEP_ERROR
    assert worst(truth, run, "current", "torque") < (WINDING if inductance else STEP_ERROR)


@pytest.mark.parametrize("inductance", [0.0, 5e-3])
@pytest.mark.parametrize("iron", [PlantSaturation(2.0, "algebraic", 3.0), PlantSaturation(12.0, "cubic")])
def test_a_voltage_motor_that_saturates_follows_the_plant(inductance: float, iron: PlantSaturation) -> None:
    """Torque and back-EMF fall alike: what the winding takes beyond its losses is what the shaft gets."""
    motor = PlantMotor("drive", "motor", "voltage", 0.1, 2.0, inductance, saturation=iron)
    plant, inputs = Plant((PlantShaft("motor", 1e-3, FRICTION),), (), (motor,)), {"drive.voltage": reversals(12.0)}
    truth, run = Twin(plant, inputs).run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega") < IRON
    straight = dataclasses.replace(plant, motors=(dataclasses.replace(motor, saturation=None),))
    assert worst(truth, Twin(straight, inputs).run(2.0)[1], "motor.omega") > 20 * IRON


def test_a_disabled_motor_neither_drives_nor_draws() -> None:
    """Without enable a current-driven motor has no torque and no current, and the shaft coasts."""
    sensors = (PlantSensor("current", "drive.current"), PlantSensor("torque", "drive.torque"))
    plant = Plant((PlantShaft("motor", 0.01, FRICTION),), (), CURRENT, sensors=sensors)
    truth, run = Twin(plant, {"drive.current": reversals(), "drive.enable": ENABLE}).run(2.0)
    assert worst(truth, run, "motor.theta", "motor.omega", "current", "torque") < STEP_ERROR
    off = (run.time > 0.5005) & (run.time < 0.7995)
    assert np.all(run["current"][off] == 0.0) and np.all(run["torque"][off] == 0.0)


def test_a_torque_driven_motor_needs_no_constant() -> None:
    """A motor driven by torque turns the shaft by it, times its share, whatever its torque constant."""
    plant = Plant((PlantShaft("motor", 0.01),), (), (PlantMotor("drive", "motor", "torque", 0.5, share=0.7),))
    run = Bench(drive_of(plant, {"drive.torque": 0.0})).run(0.1, {"drive.torque": 0.2})
    assert run["motor.omega"] == pytest.approx(0.7 * 0.2 / 0.01 * run.time, rel=ROUNDING)


def test_a_current_command_is_the_current_where_none_is_an_input() -> None:
    """An input that measures `current_command` drives the motor, so that the current itself can be an output."""
    plant = Plant((PlantShaft("motor", 0.01),), (), CURRENT)
    drive = drive_of(plant, {"drive.current_command": 0.0})
    drive = dataclasses.replace(drive, channels=(*drive.channels, Channel("current", "drive.current")))
    run = Bench(drive).run(0.1, {"drive.current_command": 0.3})
    assert run["motor.omega"] == pytest.approx(0.5 * 0.3 / 0.01 * run.time, rel=ROUNDING)
    assert np.all(run["current"] == 0.3)


def driven_pair() -> Plant:
    """Two shafts on a spring, the first of which is driven from outside."""
    load = PlantShaft("load", 0.2, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.05))
    return Plant((PlantShaft("motor", 0.01, FRICTION), load), (PlantTransmission("motor", "load", 5.0, 400.0, 0.5),))


TIME = np.linspace(0.0, 2.0, 2001)


def test_a_prescribed_speed_follows_the_plant() -> None:
    """A shaft whose speed is an input has no state but its angle, and drags the load as in the plant."""
    speed = Trajectory(TIME, 10.0 * np.sin(2 * np.pi * TIME), "linear")
    twin = Twin(driven_pair(), {"motor.omega": speed})
    assert twin.bench.stepped.state_names == ("motor.theta", "load.theta", "load.omega")
    truth, run = twin.run(2.0)
    assert worst(truth, run, "motor.theta", "load.theta", "load.omega") < STEP_ERROR


def test_a_prescribed_angle_is_its_integral() -> None:
    """Driving the angle, with its slope as a further input, moves the load as driving the speed does."""
    speed = Trajectory(TIME, 10.0 * np.sin(2 * np.pi * TIME), "linear")
    angle = Trajectory(TIME, 5.0 / np.pi * (1.0 - np.cos(2 * np.pi * TIME)), "linear")
    by_speed = Bench(drive_of(driven_pair(), {"motor.omega": speed})).run(2.0, {"motor.omega": speed})
    bench = Bench(drive_of(driven_pair(), {"motor.theta": angle}))
    assert bench.stepped.input_names == ("motor.theta", "motor.theta'")
    by_angle = bench.run(2.0, {"motor.theta": angle, "motor.theta'": speed})
    chord = 1e-5
    """A sine of 1 Hz joined by chords of 1 ms."""
    assert worst(by_speed, by_angle, "load.theta", "load.omega") < 10 * chord


def branches(stiffness: float) -> Plant:
    """Two motors of opposite sense on one bull gear."""
    damping = 2.0 if np.isfinite(stiffness) else 0.0
    return Plant(
        (
            PlantShaft("a", 0.01, FRICTION),
            PlantShaft("b", 0.02, FRICTION),
            PlantShaft("gear", 1.0, PlantFriction("coulomb", tau_c=(0.4, 0.5))),
        ),
        (
            PlantTransmission("a", "gear", 10.0, stiffness, damping),
            PlantTransmission("b", "gear", -20.0, stiffness, damping),
        ),
        (PlantMotor("a", "a", torque_constant=0.5, share=0.7), PlantMotor("brake", "b", "torque")),
    )


@pytest.mark.parametrize("stiffness", [np.inf, 2e3], ids=["rigid", "elastic"])
def test_two_motors_on_one_gear_follow_the_plant(stiffness: float) -> None:
    """Branches with opposite ratios, a shared command and a motor named like its shaft move as in the plant."""
    twin = Twin(branches(stiffness), {"a.current": reversals(), "brake.torque": reversals(-0.1)})
    truth, run = twin.run(2.0)
    names = [f"{shaft}.{signal}" for shaft in ("a", "b", "gear") for signal in ("theta", "omega")]
    assert worst(truth, run, *names) < STEP_ERROR


def test_rigid_branches_add_their_inertias() -> None:
    """Frictionless, two geared motors accelerate the gear by their torques over the inertia they reflect."""
    frictionless = dataclasses.replace(
        branches(np.inf),
        shafts=tuple(dataclasses.replace(s, friction=PlantFriction()) for s in branches(np.inf).shafts),
    )
    bench = Bench(drive_of(frictionless, {"a.current": 0.0, "brake.torque": 0.0}))
    run = bench.run(0.1, {"a.current": 1.0, "brake.torque": -0.1})
    alpha = (10 * 0.7 * 0.5 + 20 * 0.1) / (1.0 + 100 * 0.01 + 400 * 0.02)
    assert run["gear.omega"] == pytest.approx(alpha * run.time, rel=ROUNDING)
    assert run["b.omega"] == pytest.approx(-20.0 * alpha * run.time, rel=ROUNDING)
