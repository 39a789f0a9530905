"""The two-mass telescope axis of the engine's benchmarks: data of the plant, and the problem that is fitted to them.

One chain of the Leighton telescope driven by a noisy measured torque: polyline friction on the motor, Coulomb and
viscous on the load, quantised encoders at both ends, 1 kHz.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from plant import (
    Plant,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
    steps_and_multisine,
)

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft, Transmission
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.registry import friction_laws
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

RATE, RATIO, MOTOR_INERTIA, LOAD_INERTIA = 1000.0, 15050.0, 0.002, 58355.5
MOTOR_STEP, LOAD_STEP, TORQUE_NOISE = 2.0 * np.pi / 2**14, 2.0 * np.pi / 2**26, 2.0e-3
DAMPING = 1.0e5
STIFFNESS = 8.97e7
LOAD_FRICTION = {"tau_c": 500.0, "viscous": 6.0e4}
MOTOR_FRICTION: dict[str, dict[str, Any]] = {
    "polyline": {"tau_c": 0.11, "slopes": (4.2e-3 - 0.0003, 4.2e-4), "breaks": (104.25,)},
    "lugre": {"tau_c": 0.08, "tau_s": 0.12, "omega_s": 4.0, "sigma0": 20.0, "sigma1": 0.05, "sigma2": 1.5e-3},
}
"""Friction of the motor shaft by law, SI."""
FITTED = {
    "polyline": ("tau_c", "slopes.0", "slopes.1", "breaks.0"),
    "lugre": ("tau_c", "tau_s", "omega_s", "sigma0", "sigma1", "sigma2"),
}
LOAD_FITTED = {
    "polyline": ("load.friction.tau_c", "load.friction.viscous", "motor-load.stiffness", "load.inertia"),
    "lugre": ("motor-load.stiffness", "load.inertia"),
}


@dataclass(frozen=True)
class AxisRun:
    """One simulated recording and how its torque is held between samples."""

    recording: Recording
    hold: Any


def make_plant(law: str) -> Plant:
    """Return the machine: exact friction, quantised encoders, a noisy torque signal."""
    values = dict(MOTOR_FRICTION[law])
    if "sigma2" in values:
        values["viscous"] = values.pop("sigma2")
    return Plant(
        shafts=(
            PlantShaft("motor", MOTOR_INERTIA, PlantFriction(law, **values)),  # pyright: ignore[reportArgumentType]
            PlantShaft("load", LOAD_INERTIA, PlantFriction("coulomb_viscous", **LOAD_FRICTION)),
        ),
        transmissions=(PlantTransmission("motor", "load", ratio=RATIO, stiffness=STIFFNESS, damping=DAMPING),),
        motors=(PlantMotor("drive", "motor", torque_constant=1.0),),
        sensors=(
            PlantSensor("motor_position", "motor.theta", period=1 / RATE, resolution=MOTOR_STEP),
            PlantSensor("load_position", "load.theta", period=1 / RATE, resolution=LOAD_STEP),
        ),
    )


@cache
def make_run(law: str, samples: int, seed: int) -> AxisRun:
    """Return a recording of reversing torque steps with a multisine; the torque is recorded with noise."""
    rng = np.random.default_rng(seed)
    seconds = samples / RATE
    torque = steps_and_multisine(np.array([0.25, 0.6, 1.2]), (0.3, 0.8), 0.08, (0.5, 40.0), seconds, rng)
    run = make_plant(law).simulate(seconds, {"drive.current": torque}, rng)
    channels = {name: Channel(name, stamps, values, "rad") for name, (stamps, values) in run.channels.items()}
    noisy = np.asarray(torque.value) + TORQUE_NOISE * rng.standard_normal(np.size(torque.value))
    recorded = Trajectory(np.asarray(torque.time), noisy, torque.hold)
    channels["torque"] = Channel("torque", np.asarray(recorded.time), np.asarray(recorded.value), "N m")
    return AxisRun(Recording(f"{law}{seed}", channels), torque.hold)


def truth(law: str) -> dict[str, float]:
    """Return the true values of the fitted parameters by name."""
    known: dict[str, float] = {
        "load.friction.tau_c": LOAD_FRICTION["tau_c"],
        "load.friction.viscous": LOAD_FRICTION["viscous"],
        "motor-load.stiffness": STIFFNESS,
        "load.inertia": LOAD_INERTIA,
    }
    for key, value in MOTOR_FRICTION[law].items():
        items = value if isinstance(value, tuple) else (value,)
        for k, item in enumerate(items):
            known[f"motor.friction.{key}" + (f".{k}" if isinstance(value, tuple) else "")] = float(item)
    names = [f"motor.friction.{name}" for name in FITTED[law]] + list(LOAD_FITTED[law])
    return {name: known[name] for name in names}


def make_problem(law: str, run: AxisRun, factors: dict[str, float], **options: Any) -> Problem:
    """Return the problem whose guesses are the truth times `factors`; bounds a factor 10 around the truth."""
    wanted = truth(law)

    def free(name: str, value: float) -> Any:
        if name not in wanted:
            return value
        return Free(value * factors.get(name, 1.0), value / 10.0, value * 10.0)

    fields: dict[str, Any] = {}
    for key, value in MOTOR_FRICTION[law].items():
        path = f"motor.friction.{key}"
        is_list = isinstance(value, tuple)
        fields[key] = tuple(free(f"{path}.{k}", v) for k, v in enumerate(value)) if is_list else free(path, value)
    load = {key: free(f"load.friction.{key}", value) for key, value in LOAD_FRICTION.items()}
    laws = friction_laws()
    drive = Drive(
        (
            Shaft("motor", MOTOR_INERTIA, FrictionElement(laws[law](**fields))),
            Shaft("load", free("load.inertia", LOAD_INERTIA), FrictionElement(laws["coulomb_viscous"](**load))),
        ),
        (Transmission("motor", "load", RATIO, stiffness=free("motor-load.stiffness", STIFFNESS), damping=DAMPING),),
        (Motor("drive", "motor"),),
        channels=(
            Sensor("torque", "drive.torque", role="input", hold=run.hold),
            Sensor("motor_position", "motor.theta", resolution=MOTOR_STEP),
            Sensor("load_position", "load.theta", resolution=LOAD_STEP),
        ),
    )
    noise = {"motor": TORQUE_NOISE / np.sqrt(RATE)}
    settings = EstimationOptions(**({"fit": "relaxed", "process_noise": noise} | options))
    return Problem(f"telescope axis, {law}", drive, (RecordingUse(run.recording),), estimation=settings)
