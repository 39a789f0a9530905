"""The gaps of a base fit are those of the model that it ends with, not of one that it came through, nor absurd ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import diagnosed
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission, Trajectory

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

STEP, SECONDS, TORQUE_CONSTANT = 2e-3, 3.0, 0.35
MOTOR_INERTIA = 2e-3
UNITS = {"current": "A", "position": "rad", "speed": "rad/s", "vibration": "rad/s^2", "load_position": "rad"}


def current(k: int) -> Trajectory:
    """Return A: reversals with a slow and a fast sine, through which the load sticks and slips."""
    time = np.arange(0.0, 2.0 * SECONDS, STEP)
    slow, fast = np.sin(2 * np.pi * 0.7 * time + k), np.sin(2 * np.pi * 5.1 * time)
    return Trajectory(time, 0.9 * slow + 0.6 * np.sign(np.sin(2 * np.pi * 0.31 * time + k)) + 0.45 * fast, "zero")


def written(
    folder: Path, plant: Plant, seconds: float, currents: Callable[[int], Trajectory], changes: dict[str, Any]
) -> Path:
    """Write three runs of a plant of a motor and a load, and a problem of these, `changes` made; return its path."""
    for k, name in enumerate("abc"):
        run = plant.simulate(seconds, {"motor.current": currents(k)}, np.random.default_rng(k))
        channels = {key: Channel(key, *run.channels[key], UNITS[key]) for key in run.channels}
        write_recording(Recording(name, channels), folder / f"{name}.h5")

    def friction(tau_c: float, viscous: float) -> dict[str, object]:
        numbers = {"tau_c": {"guess": tau_c, "min": 0}, "viscous": {"guess": viscous, "min": 0}}
        return {"law": "coulomb_viscous", **numbers}

    axis = {"name": "axis", "inertia": {"guess": 2.1e-3, "min": 1e-4}, "friction": friction(0.11, 1.4e-3)}
    load = {"name": "load", "inertia": {"guess": 0.052, "min": 1e-3}, "friction": friction(0.45, 0.02)}
    joint = {"ratio": 5.0, "stiffness": {"guess": 780.0, "min": 1}, "damping": {"guess": 0.3, "min": 0}}
    document = {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": [axis | changes.get("axis", {}), load | changes.get("load", {})],
            "transmissions": [joint | changes.get("joint", {})],
        },
        "channels": changes["channels"],
        "recordings": {"train": ["a.h5", "b.h5"], "validation": ["c.h5"]},
    }
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(document | changes.get("more", {}), sort_keys=False), encoding="utf-8")
    return path


def write(folder: Path) -> Path:
    """Write runs of a motor and a load with Stribeck friction, seen by an encoder here and an accelerometer there."""
    motor = PlantShaft("axis", MOTOR_INERTIA, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3))
    load = PlantShaft("load", 0.05, PlantFriction("stribeck", tau_c=0.5, tau_s=0.8, omega_s=0.6, viscous=0.02))
    sensors = (
        PlantSensor("current", "motor.current", STEP, noise_std=5e-3),
        PlantSensor("position", "axis.theta", STEP, resolution=4e-4),
        PlantSensor("vibration", "load.alpha", STEP, noise_std=0.5),
    )
    drive = PlantMotor("motor", "axis", torque_constant=TORQUE_CONSTANT)
    plant = Plant((motor, load), (PlantTransmission("axis", "load", 5.0, 800.0, 0.3),), (drive,), sensors=sensors)
    channels = {
        "current": {"measures": "motor.current", "role": "input", "hold": "zero"},
        "position": {"measures": "axis.theta"},
        "vibration": {"measures": "load.alpha", "gain": {"guess": 0.9, "min": 0.1, "max": 10}},
    }
    named = {"diagnosis": {"effects": ["stribeck", "quadratic_drag", "asymmetry"]}}
    return written(folder, plant, SECONDS, current, {"channels": channels, "more": named})


@pytest.mark.slow
def test_a_rough_fit_with_a_light_rotor_leaves_no_wide_gaps(tmp_path: Path) -> None:
    """Loosely joined segments take the rotor for twenty times as light, which torque noise would move as far."""
    fitted = fit_base(prepare(load_problem(write(tmp_path))))
    assert fitted.values["axis.inertia"] == pytest.approx(MOTOR_INERTIA, rel=0.1)
    assert fitted.cost == pytest.approx(fitted.objective, rel=0.1)


@pytest.mark.slow
def test_what_such_gaps_would_hide_is_found(tmp_path: Path) -> None:
    """Friction of the load that falls with speed, be it that the motor's could."""
    result = diagnosed(write(tmp_path))
    named = [*result["accepted"], *(item for rivals in result["alias_sets"] for item in rivals)]
    rivals = {(item["effect"], item["component"]) for item in named}
    assert ("stribeck", "load") in rivals and {effect for effect, _ in rivals} == {"stribeck"}
    assert result["gap"]["shrink"]["overall"] > 0.99


LATE_STEP, LATE = 8e-3, 0.02
STATED = 0.1
"""Standard deviation of the stated inertia of the rotor, as a share of it."""


def swings(k: int) -> Trajectory:
    """Return A: three sines of no common period."""
    time, rng = np.arange(0.0, 24.0, LATE_STEP), np.random.default_rng(100 + k)
    waves = [np.sin(2 * np.pi * f * time + rng.uniform(0.0, 6.0)) for f in (0.3, 0.8, 1.9)]
    return Trajectory(time, 0.93 * np.sum(waves, axis=0), "linear")


def write_late(folder: Path) -> Path:
    """Write runs of a motor and a load that hangs on a soft gear, with a noisy current and a speed that is late."""
    motor = PlantShaft("axis", MOTOR_INERTIA, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3))
    dry = PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.02)
    load = PlantShaft("load", 0.05, dry, gravity=(1.0, 0.0))
    sensors = (
        PlantSensor("current", "motor.current", LATE_STEP, noise_std=0.2),
        PlantSensor("position", "axis.theta", LATE_STEP, resolution=1e-4),
        PlantSensor("speed", "axis.omega", LATE_STEP, noise_std=0.02, delay=LATE),
    )
    drive = PlantMotor("motor", "axis", torque_constant=TORQUE_CONSTANT)
    plant = Plant((motor, load), (PlantTransmission("axis", "load", 5.0, 300.0, 0.1),), (drive,), sensors=sensors)
    channels = {
        "current": {"measures": "motor.current", "role": "input"},
        "position": {"measures": "axis.theta", "resolution": 1e-4},
        "speed": {"measures": "axis.omega", "noise_std": 0.02},
    }
    changes: dict[str, Any] = {
        "axis": {"inertia": {"guess": MOTOR_INERTIA, "prior_std": STATED * MOTOR_INERTIA}},
        "load": {"gravity": {"torque": {"guess": 0.9, "min": 0, "max": 5}}},
        "joint": {"stiffness": {"guess": 280.0, "min": 10, "max": 5000}},
        "channels": channels,
    }
    return written(folder, plant, 12.0, swings, changes)


@pytest.mark.slow
def test_gaps_are_not_laid_for_a_rotor_that_is_far_from_what_is_stated(tmp_path: Path) -> None:
    """A late speed makes the rotor as light as torque noise needs to explain it: its gaps would explain all else."""
    fitted = fit_base(prepare(load_problem(write_late(tmp_path))))
    laid = fitted.footing.numbers["a"]["axis.inertia"]
    assert MOTOR_INERTIA / (1.0 + 5.0 * STATED) <= laid <= MOTOR_INERTIA * (1.0 + 5.0 * STATED)


@pytest.mark.slow
def test_what_gaps_for_a_light_rotor_would_hide_is_found(tmp_path: Path) -> None:
    """The speed is late, by as much as is found, and nothing else; before, a wrong inertia explained all."""
    (only,) = diagnosed(write_late(tmp_path))["accepted"]
    assert (only["effect"], only["component"]) == ("sensor_delay", "speed")
    (delay,) = only["parameters"].values()
    assert delay["value"] == pytest.approx(LATE, rel=0.1)
