"""Optional terms of parts with stops and reversals: the stepped drive against the plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant import (
    Plant,
    PlantAmplifier,
    PlantFriction,
    PlantLoop,
    PlantMotor,
    PlantRipple,
    PlantSaturation,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    PlantWarmUp,
    Trajectory,
    reversing_steps,
)
from twin import Twin, worst

STEP_ERROR = 4e-4
"""Relative error of steps of 1 ms with a dozen stops and a joint that vibrates at 49 rad/s."""
BRISTLE = 2e-3
"""The same of a bristle with rates frozen over a step, and of impacts within one."""

COULOMB = PlantFriction("coulomb_viscous", tau_c=(0.2, 0.25), viscous=0.02)
LOAD = PlantShaft("load", 0.5, PlantFriction("coulomb_viscous", tau_c=0.3, viscous=0.05))
JOINT = PlantTransmission("motor", "load", 5.0, 400.0, 0.5)
MOTOR = PlantMotor("drive", "motor", torque_constant=0.5)
SHAFT = PlantShaft("motor", 0.01, COULOMB)
RIPPLE = PlantRipple(0.7, 0.15, -0.2)
LUGRE = PlantFriction("lugre", 0.2, 0.3, 2.0, viscous=0.02, sigma0=200.0, sigma1=0.2)


def pair(shaft: PlantShaft = SHAFT, motor: PlantMotor = MOTOR, joint: PlantTransmission = JOINT) -> Plant:
    """Motor and load on a gear with a spring."""
    return Plant((shaft, LOAD), (joint,), (motor,))


PLANTS: dict[str, Plant] = {
    "cogging": pair(motor=replace(MOTOR, cogging=PlantRipple(0.3, 0.02, 0.03))),
    "torque ripple": pair(motor=replace(MOTOR, torque_ripple=RIPPLE)),
    "friction ripple": pair(replace(SHAFT, ripple=RIPPLE)),
    "friction ripple, lugre": pair(replace(SHAFT, friction=LUGRE, ripple=RIPPLE)),
    "disturbance": pair(replace(SHAFT, disturbance=PlantRipple(0.11, 0.05, 0.1))),
    "warm-up": pair(replace(SHAFT, warm_up=PlantWarmUp(0.8, -0.4, -0.4))),
    "warm-up by losses": pair(replace(SHAFT, warm_up=PlantWarmUp(0.8, -0.4, -0.6, power=2.0))),
    "lag": pair(motor=replace(MOTOR, amplifier=PlantAmplifier(time_constant=0.02))),
    "saturation": pair(motor=replace(MOTOR, saturation=PlantSaturation(1.0, "algebraic", 2.0))),
    "sharp saturation": pair(motor=replace(MOTOR, saturation=PlantSaturation(1.0, "algebraic", 4.0))),
    "cubic saturation": pair(motor=replace(MOTOR, saturation=PlantSaturation(3.0, "cubic"))),
    "stiffening": pair(joint=replace(JOINT, cubic=3e5)),
    "second stage": pair(joint=replace(JOINT, second_stage=(900.0, 0.003))),
    "hysteresis": pair(joint=replace(JOINT, loop=PlantLoop(((1.0, 0.003),), smooth=True))),
    "hysteresis of springs": pair(
        joint=replace(JOINT, loop=PlantLoop(((0.3, 0.003 * 10.0**0.5), (0.5, 0.003), (0.2, 0.003 / 10.0**0.5))))
    ),
    "kinematic error": pair(joint=replace(JOINT, kinematic_error=PlantRipple(0.7, 0.003, 0.004))),
    "backlash and all of these": pair(
        joint=replace(
            JOINT,
            cubic=3e5,
            backlash=0.004,
            loop=PlantLoop(((1.0, 0.003),), smooth=True),
            kinematic_error=PlantRipple(0.7, 0.003, 0.004),
        )
    ),
    "several together": pair(
        replace(SHAFT, ripple=RIPPLE, warm_up=PlantWarmUp(0.8, 0.3, 0.3)),
        replace(MOTOR, cogging=PlantRipple(0.3, 0.02, 0.03), torque_ripple=RIPPLE),
    ),
}


def reversals() -> Trajectory:
    """Current steps of three sizes and both signs, some below breakaway."""
    return reversing_steps(np.array([0.3, 0.6, 1.2]), (0.1, 0.3), 2.0, np.random.default_rng(0))


@pytest.mark.parametrize("name", PLANTS)
def test_terms_follow_the_plant(name: str) -> None:
    """Under reversing current steps both shafts move as in the plant, through stops and whole periods."""
    twin = Twin(PLANTS[name], {"drive.current": reversals()})
    truth, run = twin.run(2.0)
    tolerance = BRISTLE if "lugre" in name or "backlash" in name else STEP_ERROR
    assert worst(truth, run, "motor.theta", "motor.omega", "load.theta", "load.omega") < tolerance
    without = Twin(pair(), {"drive.current": reversals()}).run(2.0)[1]
    assert worst(truth, without, "motor.omega") > 20 * STEP_ERROR


def test_a_ripple_passed_within_a_few_steps_brakes_as_in_the_plant() -> None:
    """A fast motor on a voltage: torque constant and back-EMF ripple together, and drag goes with their square."""
    law = PlantFriction("coulomb_viscous", tau_c=0.01, viscous=1e-4)
    ripple = PlantRipple(0.7, 0.5, -0.2)
    motor = PlantMotor("drive", "motor", drive="voltage", torque_constant=0.1, resistance=2.0, torque_ripple=ripple)
    plant = Plant((PlantShaft("motor", 0.02, law),), (), (motor,))
    truth, run = Twin(plant, {"drive.voltage": 96.0}).run(1.0)
    assert np.max(np.abs(truth["motor.omega"])) * 1e-3 > 0.2 * ripple.period
    assert worst(truth, run, "motor.theta", "motor.omega") < STEP_ERROR


@pytest.mark.parametrize("signal", ["theta", "omega"])
def test_eccentric_sensors_read_as_in_the_plant(signal: str) -> None:
    """An encoder with a once-per-turn error reads the same over several turns in both directions."""
    sensor = PlantSensor(
        "seen", f"motor.{signal}", gain=2.0, offset=0.1, eccentricity=PlantRipple(2 * np.pi, 0.02, 0.03)
    )
    plant = replace(pair(), sensors=(sensor,))
    truth, run = Twin(plant, {"drive.current": reversals()}).run(2.0)
    assert worst(truth, run, "seen") < STEP_ERROR
