"""Small drives of the plant with something that their model lacks."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory, steps_and_multisine

from friction_ocp.cli import main
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

SECONDS, STEP = 4.0, 2e-3
TORQUE_CONSTANT, INERTIA, COULOMB, VISCOUS = 0.35, 0.002, 0.1, 1.5e-3
ENCODER_STEP, CURRENT_NOISE = 2.0 * np.pi / 2**14, 0.005
OFF = 1.04
"""Factor by which the guesses of a problem are off."""


def axis(**friction: Any) -> Plant:
    """Return one mass; friction beyond Coulomb and viscous is what a model lacks."""
    plain: dict[str, Any] = {"law": "coulomb_viscous", "tau_c": COULOMB, "viscous": VISCOUS}
    law = PlantFriction(**(plain | friction))
    return Plant(
        shafts=(PlantShaft("motor", INERTIA, law),),
        motors=(PlantMotor("motor", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(
            PlantSensor("position", "motor.theta", period=STEP, resolution=ENCODER_STEP),
            PlantSensor("current", "motor.current", period=STEP, noise_std=CURRENT_NOISE),
        ),
    )


def record(plant: Plant, name: str, seed: int) -> Recording:
    """Run a plant on a current that goes slow and fast, both ways."""
    rng = np.random.default_rng(seed)
    steps = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 20.0), SECONDS, rng)
    time = np.arange(0.0, SECONDS, STEP)
    current = Trajectory(time, np.interp(time, np.asarray(steps.time), np.asarray(steps.value)), "zero")
    run = plant.simulate(SECONDS, {"motor.current": current}, rng)
    units = {"position": "rad", "load_position": "rad", "current": "A"}
    return Recording(name, {key: Channel(key, *run.channels[key], units[key]) for key in units if key in run.channels})


def plain_drive(viscous: float) -> dict[str, Any]:
    """Return the drive section of a model with Coulomb and viscous friction alone, its guesses a little off."""
    friction = {
        "law": "coulomb_viscous",
        "tau_c": {"guess": OFF * COULOMB, "min": 0, "max": 2},
        "viscous": {"guess": OFF * viscous, "min": 0, "max": 0.1},
    }
    inertia = {"guess": OFF * INERTIA, "min": 1e-4, "max": 0.1}
    return {
        "motor": {"torque_constant": TORQUE_CONSTANT},
        "shafts": [{"name": "motor", "inertia": inertia, "friction": friction}],
    }


EFFECTS = ("stribeck", "quadratic_drag", "asymmetry", "unbalance", "sensor_delay")
"""That compete in a problem unless another catalogue is asked for."""


def write_problem(folder: Path, make: Callable[[str, int], Recording], document: dict[str, Any], seed: int = 1) -> Path:
    """Write recordings a and b to train, c to validate, each of a seed of its own, and the problem that has them."""
    for k, name in enumerate("abc"):
        write_recording(make(name, 10 * seed + k), folder / f"{name}.h5")
    whole = {**document, "recordings": {"train": ["a.h5", "b.h5"], "validation": ["c.h5"]}}
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(whole, sort_keys=False), encoding="utf-8")
    return path


def write_case(folder: Path, plant: Plant, seed: int = 1, effects: Sequence[str] = EFFECTS) -> Path:
    """Write three recordings and a problem whose model has Coulomb and viscous friction alone."""
    document = {
        "format": "friction-ocp-problem/1",
        "drive": plain_drive(VISCOUS),
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero", "noise_std": CURRENT_NOISE},
            "position": {"measures": "motor.theta", "resolution": plant.sensors[0].resolution},
        },
        "diagnosis": {"effects": list(effects)},
    }
    return write_problem(folder, lambda name, number: record(plant, name, number), document, seed)


def diagnosed(path: Path) -> dict[str, Any]:
    """Return the result document of a diagnosis by command, its folder `out` beside the problem.

    Tests run side by side already: workers would spend more time on starting than on what they save.
    """
    assert main(["diagnose", str(path), "--out", str(path.parent / "out"), "--workers", "1"]) == 0
    return json.loads((path.parent / "out" / "result.json").read_text(encoding="utf-8"))


def with_stribeck(path: Path, tau_s: float, omega_s: float) -> Path:
    """Give the model of a problem Stribeck friction whose guesses are off."""
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["friction"] = {
        "law": "stribeck",
        "tau_c": {"guess": OFF * COULOMB, "min": 0, "max": 2},
        "tau_s": {"guess": OFF * tau_s, "min": 0, "max": 2},
        "omega_s": {"guess": OFF * omega_s, "min": 0.1, "max": 40},
        "viscous": {"guess": OFF * VISCOUS, "min": 0, "max": 0.1},
    }
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path
