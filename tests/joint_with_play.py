"""A robot joint with free play of which the only encoder shows the motor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml
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

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

RATIO, TORQUE_CONSTANT, STEP, SECONDS = 100.0, 0.05, 1e-3, 5.0
ENCODER_STEP, CURRENT_NOISE = 2.0 * np.pi / 2**17, 0.01
TRUTH = {
    "motor.inertia": 1e-4,
    "motor.friction.tau_c": 0.02,
    "motor.friction.viscous": 1e-4,
    "load.inertia": 1.0,
    "load.friction.tau_c": 3.0,
    "load.friction.viscous": 0.5,
    "motor-load.stiffness": 2e4,
    "motor-load.damping": 10.0,
    "motor-load.backlash": 4e-4,
}
"""SI; the joint on the side of the load."""
UNITS = {"current": "A", "position": "rad"}


def joint() -> Plant:
    """Return the joint under a loop on a finer encoder, which is not recorded."""

    def friction(shaft: str) -> PlantFriction:
        stem = f"{shaft}.friction"
        return PlantFriction("coulomb_viscous", tau_c=TRUTH[f"{stem}.tau_c"], viscous=TRUTH[f"{stem}.viscous"])

    stiffness, damping, play = (TRUTH[f"motor-load.{name}"] for name in ("stiffness", "damping", "backlash"))
    behind = TRUTH["motor.inertia"] + TRUTH["load.inertia"] / RATIO**2
    return Plant(
        shafts=tuple(PlantShaft(name, TRUTH[f"{name}.inertia"], friction(name)) for name in ("motor", "load")),
        transmissions=(PlantTransmission("motor", "load", RATIO, stiffness, damping, play),),
        motors=(PlantMotor("motor", "motor", torque_constant=TORQUE_CONSTANT, controller="loop"),),
        controllers=(
            PlantController(
                "loop", "cascade", "fine", kp=15.0, ki=20.0, kd=200.0 * behind / TORQUE_CONSTANT, sample_time=STEP
            ),
        ),
        sensors=(
            PlantSensor("fine", "motor.theta", period=STEP, resolution=ENCODER_STEP / 4),
            PlantSensor("position", "motor.theta", period=STEP, resolution=ENCODER_STEP),
            PlantSensor("current", "motor.current", period=STEP, noise_std=CURRENT_NOISE),
        ),
    )


def record(name: str, seed: int) -> Recording:
    """Follow sines to and fro."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, STEP)
    tones = ((20.0, 0.21), (4.0, 0.83), (0.5, 2.9))
    waves = [size * np.sin(2.0 * np.pi * rate * time + rng.uniform(0.0, 6.0)) for size, rate in tones]
    wanted = np.sum(waves, axis=0)
    wanted = (wanted - wanted[0]) * (1.0 - np.exp(-2.0 * time))
    run = joint().simulate(SECONDS, {"reference.theta": Trajectory(time, wanted, "zero")}, rng)
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in UNITS.items()})


def write_joint(folder: Path, with_play: bool) -> Path:
    """Write three recordings and a problem, its guesses off by up to a third, with the play in the model or without."""

    def near(name: str, factor: float) -> dict[str, float]:
        guess = factor * TRUTH[name]
        return {"guess": guess, "min": 0.0 if name.endswith(("viscous", "damping")) else guess / 20, "max": 20 * guess}

    def shaft(name: str, inertia: float, coulomb: float, viscous: float) -> dict[str, Any]:
        stem = f"{name}.friction"
        dry, drag = near(f"{stem}.tau_c", coulomb), near(f"{stem}.viscous", viscous)
        law = {"law": "coulomb_viscous", "tau_c": dry, "viscous": drag}
        return {"name": name, "inertia": near(f"{name}.inertia", inertia), "friction": law}

    factors = {"stiffness": 1.05, "damping": 0.7} | ({"backlash": 0.7} if with_play else {})
    gear = {name: near(f"motor-load.{name}", factor) for name, factor in factors.items()}
    document = {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": [shaft("motor", 0.95, 0.9, 1.2), shaft("load", 1.04, 1.1, 0.9)],
            "transmissions": [{"ratio": RATIO, **gear}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero", "noise_std": CURRENT_NOISE},
            "position": {"measures": "motor.theta", "resolution": float(ENCODER_STEP)},
        },
        "recordings": {"train": ["a.h5", "b.h5"], "validation": ["c.h5"]},
        "diagnosis": {"effects": ["backlash", "stiffening", "sensor_gain", "sensor_delay", "stribeck"]},
    }
    for k, name in enumerate("abc"):
        write_recording(record(name, 40 + k), folder / f"{name}.h5")
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path
