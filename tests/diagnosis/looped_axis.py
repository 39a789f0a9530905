"""An axis under a speed loop whose tachometer is noisy, its recordings, and the problem that states the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from diagnosis_cases import CURRENT_NOISE, ENCODER_STEP, SECONDS, STEP, axis, write_case
from plant import Plant, PlantAmplifier, PlantController, PlantSensor, Trajectory, reversing_steps

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

TACHO_NOISE = 0.3
"""rad/s."""
GAINS = {"kp": 0.06, "ki": 0.6, "sample_time": STEP}
UNITS = {"wanted": "rad/s", "position": "rad", "speed": "rad/s", "current": "A"}
CHANNELS: dict[str, dict[str, Any]] = {
    "wanted": {"measures": "reference.omega", "role": "input", "hold": "zero"},
    "position": {"measures": "motor.theta", "resolution": float(ENCODER_STEP)},
    "speed": {"measures": "motor.omega", "noise_std": TACHO_NOISE},
    "current": {"measures": "motor.current", "noise_std": CURRENT_NOISE},
}


def looped(unbalance: float, feedback: str, lag: float, shown: str, dead_time: float = 0.0) -> Plant:
    """Return the axis under a speed loop that sees its tachometer with the noise that is logged, or without any.

    Its motor lags by `lag` s after `dead_time` s, and what is logged of it is `shown`, the command or the current.
    """
    plain = axis()
    amplifier = PlantAmplifier(delay=dead_time, time_constant=lag) if lag else None
    return replace(
        plain,
        shafts=(replace(plain.shafts[0], gravity=(unbalance, 0.3)),),
        motors=(replace(plain.motors[0], controller="loop", amplifier=amplifier),),
        controllers=(PlantController("loop", "pi_velocity", feedback, **GAINS),),
        sensors=(
            plain.sensors[0],
            replace(plain.sensors[1], measures=f"motor.{shown}"),
            PlantSensor("speed", "motor.omega", period=STEP, noise_std=TACHO_NOISE),
            PlantSensor("quiet", "motor.omega", period=STEP),
        ),
    )


def written(
    folder: Path,
    unbalance: float = 0.0,
    feedback: str = "speed",
    lag: float = 0.0,
    shown: str = "current",
    effects: Sequence[str] = ("unbalance", "stribeck", "sensor_delay"),
    dead_time: float = 0.0,
) -> Path:
    """Write three recordings and a problem whose model is right but for the unbalance and the lag."""
    path, time = write_case(folder, axis(), effects=list(effects)), np.arange(0, SECONDS, STEP)
    for k, name in enumerate("abc"):
        rng = np.random.default_rng(20 + k)
        steps = reversing_steps(np.array([2.0, 6.0, 15.0]), (0.2, 0.6), SECONDS, rng)
        wanted = np.interp(time, np.asarray(steps.time), np.asarray(steps.value))
        run = looped(unbalance, feedback, lag, shown, dead_time).simulate(
            SECONDS, {"reference.omega": Trajectory(time, wanted, "zero")}, rng
        )
        found = {key: Channel(key, *run.channels[key], UNITS[key]) for key in UNITS if key in run.channels}
        seen = found["position"].time
        found["wanted"] = Channel("wanted", seen, np.append(wanted, wanted[-1])[: seen.size], "rad/s")
        write_recording(Recording(name, found), folder / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["controller"] = {"type": "pi_velocity", "feedback": "speed", "output": "current", **GAINS}
    document["channels"] = CHANNELS
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path
