"""Play of which a spring 25 times too soft makes the best that a model without any can: its own flanks are far away."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import diagnosed, write_problem
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission, Trajectory

from friction_ocp.recording.recording import Channel, Recording

RATIO, STIFFNESS, DAMPING, PLAY = 20.0, 1350.0, 5.0, 0.0105
"""A robot's joint: N m/rad, N m s/rad and rad on the side of the arm."""
TORQUE_CONSTANT, CURRENT_NOISE = 0.35, 0.004
MOTOR_STEP, LOAD_STEP = 2e-4, 1e-4
SECONDS, STEP = 5.0, 1e-3
UNITS = {"current": "A", "position": "rad", "load_position": "rad"}


def joint() -> Plant:
    """Return motor and arm, each with an encoder that sees far less than the play."""
    return Plant(
        shafts=(
            PlantShaft("motor", 1.05e-4, PlantFriction("coulomb_viscous", tau_c=0.02, viscous=2e-4)),
            PlantShaft("arm", 0.006, PlantFriction("coulomb_viscous", tau_c=0.4, viscous=0.1)),
        ),
        transmissions=(PlantTransmission("motor", "arm", RATIO, STIFFNESS, DAMPING, PLAY),),
        motors=(PlantMotor("motor", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(
            PlantSensor("position", "motor.theta", period=STEP, resolution=MOTOR_STEP),
            PlantSensor("load_position", "arm.theta", period=STEP, resolution=LOAD_STEP),
            PlantSensor("current", "motor.current", period=STEP, noise_std=CURRENT_NOISE),
        ),
    )


def record(name: str, seed: int) -> Recording:
    """Drive the motor with a current of a few slow sines and steps."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, STEP)
    rates, phases = rng.uniform(0.15, 2.5, 5), rng.uniform(0.0, 2.0 * np.pi, 5)
    sines = np.sum(np.sin(2.0 * np.pi * np.outer(rates, time) + phases[:, None]) / (1.0 + rates[:, None]), axis=0)
    torque = 0.15 * sines / np.max(np.abs(sines)) + 0.045 * np.sign(np.sin(0.8 * np.pi * time + seed))
    current = torque * np.minimum(1.0, time / 0.2) / TORQUE_CONSTANT
    run = joint().simulate(SECONDS, {"motor.current": Trajectory(time, current, "zero")}, rng)
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in UNITS.items()})


def document() -> dict[str, Any]:
    """Return a problem whose model has no play, and whose spring nobody knows."""

    def shaft(name: str, inertia: float, coulomb: float, viscous: float) -> dict[str, Any]:
        friction = {"tau_c": {"guess": coulomb, "min": 0}, "viscous": {"guess": viscous, "min": 0}}
        rotor = {"guess": inertia, "min": 0.1 * inertia}
        return {"name": name, "inertia": rotor, "friction": {"law": "coulomb_viscous", **friction}}

    spring = {"ratio": RATIO, "stiffness": {"guess": 45.0, "min": 1}, "damping": {"guess": 0.05, "min": 0}}
    return {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": [shaft("motor", 1.1e-4, 0.02, 2e-4), shaft("arm", 0.01, 0.4, 0.1)],
            "transmissions": [spring],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero", "noise_std": CURRENT_NOISE},
            "position": {"measures": "motor.theta", "resolution": MOTOR_STEP},
            "load_position": {"measures": "arm.theta", "resolution": LOAD_STEP},
        },
        "diagnosis": {"effects": ["backlash", "transmission_hysteresis", "parameter_error", "sensor_delay"]},
    }


@pytest.mark.slow
def test_play_that_hides_behind_a_soft_spring_is_found(tmp_path: Path) -> None:
    """Neither a loop of the gear nor a torque constant that is off is taken for it, and the flanks come out hard."""
    result = diagnosed(write_problem(tmp_path, record, document()))
    (accepted,) = result["accepted"]
    assert result["verdict"] == "explained"
    assert (accepted["effect"], accepted["component"]) == ("backlash", "motor-arm")
    assert accepted["parameters"]["motor-arm.backlash"]["value"] == pytest.approx(PLAY, rel=0.02)
    (spring,) = [item for item in result["biased_parameters"] if item["name"] == "motor-arm.stiffness"]
    assert spring["after"] == pytest.approx(STIFFNESS, rel=0.1) and spring["before"] < 0.1 * STIFFNESS
    joint = result["where"]["joint"]
    twist, needed, before, after = (np.array(joint[name]) for name in ("at", "needed", "before", "after"))
    inside, flanks = np.abs(twist) < 0.35 * PLAY, np.abs(twist) > 0.53 * PLAY
    assert joint["component"] == "motor-arm" and joint["unit"] == "N m" and np.sum(inside) > 5 and np.sum(flanks) > 1
    assert np.max(np.abs(after[inside])) < 0.01 and np.max(np.abs(needed[inside])) < 0.02
    assert np.mean(before[inside] / twist[inside]) == pytest.approx(spring["before"], rel=0.3)
    assert needed[flanks] == pytest.approx(after[flanks], rel=0.1)
