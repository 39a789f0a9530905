"""Make data/two_mass: a position-controlled two-mass axis, simulated by the plant of the tests.

python problems/two_mass/make_data.py [--seed 1]. The plant shares no code with the package: exact LuGre friction on the
motor, exact dry friction on the load, a sampled cascade controller fed by a fine encoder, a log that keeps
only 4096 steps a turn of it, noisy current and acceleration.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from plant import (  # noqa: E402
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
)

from friction_ocp.recording.hdf5 import write_recording  # noqa: E402
from friction_ocp.recording.recording import Channel, Recording  # noqa: E402

SAMPLE_TIME = 1e-3
LOOP_ENCODER_STEP, LOGGED_STEP = 2.0 * np.pi / 2**20, 2.0 * np.pi / 2**12
UNITS = {"current": "A", "motor_position": "rad", "load_acceleration": "rad/s^2", "reference": "rad"}
TRUTH = {
    "motor.inertia": 0.002,
    "motor.torque_constant": 0.35,
    "motor.friction.tau_c": 0.08,
    "motor.friction.tau_s": 0.12,
    "motor.friction.omega_s": 4.0,
    "motor.friction.sigma0": 20.0,
    "motor.friction.sigma1": 0.05,
    "motor.friction.sigma2": 1.5e-3,
    "load.friction.tau_c": 1.0,
    "load.friction.viscous": 0.5,
    "motor-load.stiffness": 2.0e4,
    "motor-load.damping": 20.0,
}
"""What the plant is made of, by the parameter names of joint.yaml, SI."""


def make_plant() -> Plant:
    """Return the axis."""
    friction = PlantFriction("lugre", tau_c=0.08, tau_s=0.12, omega_s=4.0, sigma0=20.0, sigma1=0.05, viscous=1.5e-3)
    return Plant(
        shafts=(
            PlantShaft("motor", TRUTH["motor.inertia"], friction),
            PlantShaft("load", 4.0, PlantFriction("coulomb_viscous", tau_c=1.0, viscous=0.5)),
        ),
        transmissions=(PlantTransmission("motor", "load", ratio=50.0, stiffness=2.0e4, damping=20.0),),
        motors=(PlantMotor("motor", "motor", torque_constant=TRUTH["motor.torque_constant"], controller="loop"),),
        controllers=(
            PlantController(
                "loop",
                "cascade",
                "loop_encoder",
                kp=20.0,
                ki=6.0,
                kd=0.3,
                sample_time=SAMPLE_TIME,
                saturation=(-8, 8),
            ),
        ),
        sensors=(
            PlantSensor("loop_encoder", "motor.theta", period=SAMPLE_TIME, resolution=LOOP_ENCODER_STEP),
            PlantSensor("motor_position", "motor.theta", period=SAMPLE_TIME, resolution=LOGGED_STEP),
            PlantSensor("current", "motor.current", period=SAMPLE_TIME, noise_std=0.01),
            PlantSensor("load_acceleration", "load.alpha", period=2 * SAMPLE_TIME, noise_std=0.02),
        ),
    )


def reference(kind: str, rng: np.random.Generator) -> Trajectory:
    """Return a reference angle at the motor: presliding, slow and fast reversals in one run."""
    time = np.arange(0.0, 8.0, SAMPLE_TIME)
    shift = rng.uniform(0.0, 0.3)
    if kind == "multisine":
        tones = ((0.02, 1.3), (0.8, 0.7), (4.0, 0.45), (18.0, 0.31))
        angle = sum(size * np.sin(2 * np.pi * f * (time - shift)) * (1 - np.exp(-time)) for size, f in tones)
        return Trajectory(time, np.asarray(angle), "zero")
    parts = ((0.0, 0.015, 1.0), (2.0, 1.0, 0.6), (4.0, 30.0, 0.4))
    angle = np.zeros_like(time)
    for begin, size, frequency in parts:
        local = np.clip(time - begin - 0.2 * shift, 0.0, None)
        angle += size * (1 - np.cos(2 * np.pi * frequency * local)) * (local > 0)
    return Trajectory(time, angle, "zero")


def record(name: str, kind: str, seed: int) -> Recording:
    """Simulate one run."""
    rng = np.random.default_rng(seed)
    wanted = reference(kind, rng)
    run = make_plant().simulate(8.0, {"reference.theta": wanted}, rng)
    logged = {key: content for key, content in run.channels.items() if key in UNITS}
    channels = {key: Channel(key, stamps, values, UNITS[key]) for key, (stamps, values) in logged.items()}
    channels["reference"] = Channel("reference", np.asarray(wanted.time), np.asarray(wanted.value), "rad")
    clocks = {"load_acceleration": "accelerometer", "reference": "reference"}
    channels = {
        key: Channel(key, item.time, item.values, item.unit, clocks.get(key, "time")) for key, item in channels.items()
    }
    return Recording(
        name,
        channels,
        title="Two-mass axis under position control, simulated",
        source=f"problems/two_mass/make_data.py, seed {seed}",
        licence="MIT",
    )


def main() -> None:
    """Write the three recordings."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args().seed
    folder = ROOT / "data" / "two_mass"
    folder.mkdir(parents=True, exist_ok=True)
    for k, (name, kind) in enumerate((("moves", "moves"), ("multisine", "multisine"), ("check", "moves"))):
        write_recording(record(name, kind, 10 * seed + k), folder / f"{name}.h5")


if __name__ == "__main__":
    main()
