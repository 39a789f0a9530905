"""A pendulum that a loop swings against its weight, seen by an encoder and a noisy current."""

from __future__ import annotations

from typing import Any

import numpy as np
from plant import Plant, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory

from friction_ocp.recording.recording import Channel, Recording

STEP, RESOLUTION = 1e-3, 2.0 * np.pi / 2**17
TORQUE_CONSTANT = 0.5
TRUTH = {
    "arm.inertia": 0.01,
    "arm.friction.tau_c": 0.2,
    "arm.friction.viscous": 5e-3,
    "arm.gravity.torque": 1.5,
}


def record(name: str, noise: float, seconds: float, seed: int, feedback: str = "fine") -> Recording:
    """Swing the pendulum; `noise` is that of the current, A. The loop sees finer than is recorded, or the "angle"."""
    inertia, coulomb, viscous, weight = TRUTH.values()
    friction = PlantFriction("coulomb_viscous", tau_c=coulomb, viscous=viscous)
    plant = Plant(
        shafts=(PlantShaft("arm", inertia, friction, gravity=(weight, 0.0)),),
        motors=(PlantMotor("motor", "arm", torque_constant=TORQUE_CONSTANT, controller="loop"),),
        controllers=(PlantController("loop", "cascade", feedback, kp=20.0, ki=4.0, kd=0.6, sample_time=STEP),),
        sensors=(
            PlantSensor("fine", "arm.theta", period=STEP, resolution=RESOLUTION / 16),
            PlantSensor("angle", "arm.theta", period=STEP, resolution=RESOLUTION),
            PlantSensor("current", "motor.current", period=STEP, noise_std=noise),
        ),
    )
    time = np.arange(0.0, seconds, STEP)
    wanted = 1.2 * np.sin(np.pi * time) * (1.0 - np.exp(-time / 0.3)) + 0.4 * np.sin(1.8 * np.pi * time)
    reference = {"reference.theta": Trajectory(time, wanted, "linear")}
    run = plant.simulate(seconds, reference, np.random.default_rng(seed))
    units = {"current": "A", "angle": "rad"}
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in units.items()})


def document(inertia: float = 0.012) -> dict[str, Any]:
    """Return the problem of the pendulum without its recordings, `inertia` the guess."""
    friction = {
        "law": "coulomb_viscous",
        "tau_c": {"guess": 0.25, "min": 0, "max": 2},
        "viscous": {"guess": 4e-3, "min": 0, "max": 0.1},
    }
    arm = {
        "name": "arm",
        "inertia": {"guess": inertia, "min": 1e-3, "max": 0.1},
        "gravity": {"torque": {"guess": 1.65, "min": 0, "max": 20}},
        "friction": friction,
    }
    return {
        "format": "friction-ocp-problem/1",
        "drive": {"motor": {"torque_constant": TORQUE_CONSTANT}, "shafts": [arm]},
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero"},
            "angle": {"measures": "arm.theta", "resolution": float(RESOLUTION)},
        },
    }
