"""Free play of a gear whose flanks twist far less than they are apart: no soft spring and no loop stands in for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import diagnosed, write_problem
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
)

from friction_ocp.recording.recording import Channel, Recording

RATIO, STIFFNESS, DAMPING, PLAY = 1200.0, 6e7, 1.2e5, 4e-4
"""A telescope axis: N m/rad, N m s/rad and rad on the side of the sky."""
MOTOR_STEP, LOAD_STEP, CURRENT_NOISE = 2.0 * np.pi / 8192, 5e-7, 0.02
SECONDS, STEP = 8.0, 2e-3
UNITS = {"current": "A", "motor_position": "rad", "load_position": "rad"}


def telescope() -> Plant:
    """Return the axis under a loop that sees its motor finely."""
    return Plant(
        shafts=(
            PlantShaft("motor", 0.02, PlantFriction("coulomb_viscous", tau_c=0.4, viscous=2e-3)),
            PlantShaft("load", 9000.0, PlantFriction("coulomb_viscous", tau_c=300.0, viscous=2e3)),
        ),
        transmissions=(PlantTransmission("motor", "load", RATIO, STIFFNESS, DAMPING, PLAY),),
        motors=(PlantMotor("motor", "motor", torque_constant=1.1, controller="loop"),),
        controllers=(PlantController("loop", "cascade", "fine", kp=3.0, ki=20.0, kd=1.5, sample_time=1e-3),),
        sensors=(
            PlantSensor("fine", "motor.theta", period=1e-3, resolution=MOTOR_STEP / 16),
            PlantSensor("motor_position", "motor.theta", period=STEP, resolution=MOTOR_STEP),
            PlantSensor("load_position", "load.theta", period=STEP, resolution=LOAD_STEP),
            PlantSensor("current", "motor.current", period=1e-3, noise_std=CURRENT_NOISE),
        ),
    )


def record(name: str, seed: int) -> Recording:
    """Track slow sines across the sky."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, 1e-3)
    tones = ((0.012, 0.11), (0.003, 0.43), (6e-4, 1.3))
    wanted = sum(size * np.sin(2.0 * np.pi * rate * time) * (1.0 - np.exp(-time)) for size, rate in tones)
    wanted = np.asarray(wanted) * rng.uniform(0.8, 1.2) * RATIO
    run = telescope().simulate(SECONDS, {"reference.theta": Trajectory(time, wanted, "zero")}, rng)
    clocks = {"current": "driver"}
    found = {key: Channel(key, *run.channels[key], UNITS[key], clocks.get(key, "time")) for key in UNITS}
    return Recording(name, found)


def document() -> dict[str, Any]:
    """Return a problem whose model has no play; its numbers are those of a handbook, a little off."""

    def friction(coulomb: float, viscous: float) -> dict[str, object]:
        return {"law": "coulomb_viscous", "tau_c": near(coulomb, 0.0), "viscous": near(viscous, 0.0)}

    def near(value: float, least: float | None = None) -> dict[str, float]:
        return {"guess": value, "min": value / 20 if least is None else least, "max": 20 * value}

    return {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": 1.1},
            "shafts": [
                {"name": "motor", "inertia": near(0.019), "friction": friction(0.36, 2.4e-3)},
                {"name": "load", "inertia": near(9400.0), "friction": friction(360.0, 1.6e3)},
            ],
            "transmissions": [{"ratio": RATIO, "stiffness": near(1.05 * STIFFNESS), "damping": near(0.7 * DAMPING, 0)}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero"},
            "motor_position": {"measures": "motor.theta", "resolution": float(MOTOR_STEP)},
            "load_position": {"measures": "load.theta", "resolution": LOAD_STEP},
        },
        "diagnosis": {"effects": ["backlash", "transmission_hysteresis", "stiffening", "sensor_delay"]},
    }


@pytest.mark.slow
def test_play_is_found_where_no_small_play_predicts_it(tmp_path: Path) -> None:
    """The base model's spring has gone soft; the play comes out to a hundredth, and the spring hard again."""
    result = diagnosed(write_problem(tmp_path, record, document()))
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("backlash", "motor-load")
    assert accepted["parameters"]["motor-load.backlash"]["value"] == pytest.approx(PLAY, rel=0.01)
    (spring,) = [item for item in result["biased_parameters"] if item["name"] == "motor-load.stiffness"]
    assert spring["after"] == pytest.approx(STIFFNESS, rel=0.02) and spring["before"] < 0.5 * STIFFNESS
