"""A current that is logged late: all that is seen of the drive is early against it, be it one channel or several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import CURRENT_NOISE, INERTIA, STEP, VISCOUS, axis, diagnosed, plain_drive
from plant import PlantSensor, Trajectory, steps_and_multisine

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

LATE, SECONDS, SPEED_NOISE = 7e-3, 4.0, 0.02
UNITS = {"current": "A", "position": "rad", "speed": "rad/s"}


def write(folder: Path, *outputs: str) -> Path:
    """Write three runs of one mass, whose drive passes its current to the logger 3.5 samples late, and the problem."""
    plant = axis()
    position, current = plant.sensors
    speed = PlantSensor("speed", "motor.omega", period=STEP, noise_std=SPEED_NOISE)
    plant = replace(plant, sensors=(position, replace(current, delay=LATE), speed))
    for k, name in enumerate("abc"):
        rng = np.random.default_rng(k)
        motion = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 20.0), SECONDS, rng)
        time = np.arange(0.0, SECONDS, STEP)
        drive = Trajectory(time, np.interp(time, np.asarray(motion.time), np.asarray(motion.value)), "linear")
        run = plant.simulate(SECONDS, {"motor.current": drive}, rng)
        channels = {key: Channel(key, *run.channels[key], UNITS[key]) for key in ("current", *outputs)}
        write_recording(Recording(name, channels), folder / f"{name}.h5")
    seen = {
        "position": {"measures": "motor.theta", "resolution": position.resolution},
        "speed": {"measures": "motor.omega", "noise_std": SPEED_NOISE},
    }
    driven = {"measures": "motor.current", "role": "input", "noise_std": CURRENT_NOISE}
    document = {
        "format": "friction-ocp-problem/1",
        "drive": plain_drive(VISCOUS),
        "channels": {"current": driven, **{name: seen[name] for name in outputs}},
        "recordings": {"train": ["a.h5", "b.h5"], "validation": ["c.h5"]},
        "diagnosis": {"effects": ["sensor_delay", "drive_lag", "sensor_gain", "quadratic_drag"]},
    }
    path = folder / "late.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("outputs", [pytest.param(("position", "speed"), marks=pytest.mark.slow), ("position",)])
def test_a_late_current_is_found_at_the_current(tmp_path: Path, outputs: tuple[str, ...]) -> None:
    """It is one delay, not one of every sensor that shows the future."""
    result = diagnosed(write(tmp_path, *outputs))
    assert [(item["effect"], item["component"]) for item in result["accepted"]] == [("sensor_delay", "current")]
    assert result["verdict"] == "explained" and not result["alias_sets"]
    augmented = yaml.safe_load((tmp_path / "out" / "augmented.yaml").read_text(encoding="utf-8"))
    assert augmented["channels"]["current"]["delay"]["guess"] == pytest.approx(LATE, abs=0.1 * STEP)
    assert augmented["drive"]["shafts"][0]["inertia"]["guess"] == pytest.approx(INERTIA, rel=5e-3)
