"""What channels record: gain, offset and delay of every signal, against the plant and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission, Trajectory
from twin import Bench, Run, Twin, drive_of

from friction_ocp.drive.parts import Channel, Drive, Eccentricity, Motor, Shaft

SHAFT = PlantShaft("motor", 0.01, PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.01))
LOAD = PlantShaft("load", 0.2, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.05))
JOINT = PlantTransmission("motor", "load", 5.0, 400.0, 0.5)
DELAY = 3e-3
SENSORS = (
    PlantSensor("angle", "motor.theta", gain=2.0, offset=0.5, delay=DELAY),
    PlantSensor("speed", "load.omega", gain=-1.5, offset=0.5, delay=DELAY),
    PlantSensor("motor_acceleration", "motor.alpha", gain=0.9, offset=0.5),
    PlantSensor("load_acceleration", "load.alpha", gain=0.9, offset=-0.5),
    PlantSensor("torque", "drive.torque", gain=3.0, offset=0.1),
)


@pytest.fixture(scope="module")
def pair() -> tuple[Run, Run]:
    """Truth and run of two masses under a current of 3 Hz, sensed every 1 ms."""
    time = np.linspace(0.0, 2.0, 2001)
    current = Trajectory(time, np.sin(2 * np.pi * 3 * time), "linear")
    motor = PlantMotor("drive", "motor", torque_constant=0.5)
    return Twin(Plant((SHAFT, LOAD), (JOINT,), (motor,), sensors=SENSORS), {"drive.current": current}).run(2.0)


STEP_ERROR = 3e-4
TAYLOR = {"angle": 3e-4, "speed": 2e-2}
"""A delay of 3 ms is undone to second order in angles and to first in speeds, here against 49 rad/s and stops."""


@pytest.mark.parametrize("name", [sensor.name for sensor in SENSORS])
def test_channels_record_what_the_plant_records(name: str, pair: tuple[Run, Run]) -> None:
    """Every kind of signal passes through gain x true(t - delay) + offset as in the plant."""
    truth, run = pair
    away_from_jumps = 0.99
    error = np.quantile(np.abs(run[name] - truth[name]), away_from_jumps)
    assert error < TAYLOR.get(name, STEP_ERROR) * np.max(np.abs(truth[name]))


def test_an_acceleration_is_that_of_the_instant() -> None:
    """An accelerometer shows the acceleration at the sample, not the mean of the step that follows it."""
    plant = Plant((PlantShaft("motor", 0.01),), (), (PlantMotor("drive", "motor", "torque"),))
    plant = Plant(plant.shafts, (), plant.motors, sensors=(PlantSensor("alpha", "motor.alpha"),))
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "linear")
    run = Bench(drive_of(plant, {"drive.torque": ramp})).run(1.0, {"drive.torque": ramp})
    assert run["alpha"] == pytest.approx(100.0 * run.time, abs=1e-9)
    swing = Plant((PlantShaft("arm", 0.5, gravity=(200.0, 0.0)),), sensors=(PlantSensor("alpha", "arm.alpha"),))
    run = Bench(drive_of(swing, {})).run(1.0, {}, {"arm.theta": 1e-3})
    instant = 20.0 * 1e-3 * 1e-2
    """Frequency times the share of the step over which the acceleration is taken."""
    assert run["alpha"] == pytest.approx(-400.0 * run["arm.theta"], abs=instant * 0.4)


def test_a_resting_shaft_shows_no_acceleration() -> None:
    """While it sticks a shaft's acceleration is exactly 0, whatever the torque below breakaway."""
    plant = Plant(
        (SHAFT,), (), (PlantMotor("drive", "motor", "torque"),), sensors=(PlantSensor("alpha", "motor.alpha"),)
    )
    run = Bench(drive_of(plant, {"drive.torque": 0.04})).run(0.1, {"drive.torque": 0.04})
    assert np.all(run["alpha"] == 0.0) and np.all(run["motor.theta"] == 0.0)


def test_inputs_pass_through_the_same_formula_backwards() -> None:
    """A recorded current with gain and offset drives the motor by (recorded - offset) / gain."""
    current = Channel("current", "drive.current", "input", gain=2.0, offset=0.3)
    drive = Drive(
        (Shaft("axis", 0.01),), (), (Motor("drive", "axis", 0.5),), None, (current, Channel("w", "axis.omega"))
    )
    run = Bench(drive).run(0.1, {"current": 1.3})
    rounding = 1e-12
    assert run["w"] == pytest.approx(0.5 * 0.5 / 0.01 * run.time, rel=rounding)


ECCENTRICITY = Eccentricity(0.02, -0.03)


@pytest.mark.parametrize("signal", ["theta", "omega", "alpha"])
def test_an_eccentric_sensor_shows_the_error_of_its_angle(signal: str) -> None:
    """Angle, speed and acceleration are those of theta + c (cos theta - 1) + s sin theta, a delay included."""
    delay = 0.0 if signal == "alpha" else 2e-3
    channel = Channel("seen", f"axis.{signal}", gain=2.0, offset=0.5, delay=delay, eccentricity=ECCENTRICITY)
    torque = Channel("torque", "drive.torque", "input")
    drive = Drive((Shaft("axis", 0.01),), (), (Motor("drive", "axis"),), None, (torque, channel))
    run = Bench(drive).run(1.0, {"torque": 0.1}, {"axis.omega": 3.0})
    alpha, time = 10.0, run.time - delay
    omega, theta = 3.0 + alpha * time, 3.0 * time + 0.5 * alpha * time**2
    slope, bend = 1 - 0.02 * np.sin(theta) - 0.03 * np.cos(theta), -0.02 * np.cos(theta) + 0.03 * np.sin(theta)
    seen = {
        "theta": theta + 0.02 * (np.cos(theta) - 1) - 0.03 * np.sin(theta),
        "omega": slope * omega,
        "alpha": slope * alpha + bend * omega**2,
    }
    rounding, third_order = 1e-9, 13.0**2 * delay**2
    assert run["seen"] == pytest.approx(2.0 * seen[signal] + 0.5, abs=rounding + third_order)


def test_a_start_sees_through_an_eccentric_sensor() -> None:
    """The state suggested by an eccentric encoder is the true motion, to third order in the error."""
    channel = Channel("seen", "axis.theta", gain=2.0, eccentricity=ECCENTRICITY)
    bench = Bench(Drive((Shaft("axis", 0.01),), channels=(channel,)))
    theta, omega = 0.7, 3.0
    seen = theta + 0.02 * (np.cos(theta) - 1) - 0.03 * np.sin(theta)
    slope = 1 - 0.02 * np.sin(theta) - 0.03 * np.cos(theta)
    state = np.asarray(bench.stepped.start([2 * seen], [2 * slope * omega], [0.0], [], bench.numbers)).ravel()
    third_order = 0.04**3
    assert state == pytest.approx([theta, omega], abs=third_order)
