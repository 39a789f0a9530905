"""A loop whose tachometer is noisy: what it makes of the noise moves the machine, and is no gap of the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import CURRENT_NOISE, ENCODER_STEP, SECONDS, STEP, axis, diagnosed, write_case
from plant import Plant, PlantController, PlantSensor, Trajectory, reversing_steps

from friction_ocp.diagnosis.loop import driven_as_recorded, in_its_loop, opened
from friction_ocp.parameters import Free
from friction_ocp.problem_file.load import load_problem
from friction_ocp.problem_file.write import write_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

TACHO_NOISE, UNBALANCE = 0.3, 0.05
"""rad/s, N m."""
GAINS = {"kp": 0.06, "ki": 0.6, "sample_time": STEP}
UNITS = {"wanted": "rad/s", "position": "rad", "speed": "rad/s", "current": "A"}
CHANNELS: dict[str, dict[str, Any]] = {
    "wanted": {"measures": "reference.omega", "role": "input", "hold": "zero"},
    "position": {"measures": "motor.theta", "resolution": float(ENCODER_STEP)},
    "speed": {"measures": "motor.omega", "noise_std": TACHO_NOISE},
    "current": {"measures": "motor.current", "noise_std": CURRENT_NOISE},
}


def looped(unbalance: float) -> Plant:
    """Return the axis under a speed loop that sees its tachometer with the noise that is logged."""
    plain = axis()
    return replace(
        plain,
        shafts=(replace(plain.shafts[0], gravity=(unbalance, 0.3)),),
        motors=(replace(plain.motors[0], controller="loop"),),
        controllers=(PlantController("loop", "pi_velocity", "speed", **GAINS),),
        sensors=(*plain.sensors, PlantSensor("speed", "motor.omega", period=STEP, noise_std=TACHO_NOISE)),
    )


def written(folder: Path, unbalance: float = 0.0) -> Path:
    """Write three recordings and a problem whose model is right but for the unbalance."""
    path, time = (
        write_case(folder, axis(), effects=["unbalance", "stribeck", "sensor_delay"]),
        np.arange(0, SECONDS, STEP),
    )
    for k, name in enumerate("abc"):
        rng = np.random.default_rng(20 + k)
        steps = reversing_steps(np.array([2.0, 6.0, 15.0]), (0.2, 0.6), SECONDS, rng)
        wanted = np.interp(time, np.asarray(steps.time), np.asarray(steps.value))
        run = looped(unbalance).simulate(SECONDS, {"reference.omega": Trajectory(time, wanted, "zero")}, rng)
        found = {key: Channel(key, *run.channels[key], UNITS[key]) for key in UNITS if key in run.channels}
        seen = found["position"].time
        found["wanted"] = Channel("wanted", seen, np.append(wanted, wanted[-1])[: seen.size], "rad/s")
        write_recording(Recording(name, found), folder / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["controller"] = {"type": "pi_velocity", "feedback": "speed", "output": "current", **GAINS}
    document["channels"] = CHANNELS
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def test_the_noise_of_a_loop_is_no_gap(tmp_path: Path) -> None:
    """A model that is right explains the recordings; the file that is written keeps its loop and loads."""
    result = diagnosed(written(tmp_path))
    assert result["verdict"] == "no_gap"
    assert any(line.startswith("current: as recorded") for line in result["assumptions"])
    base = load_problem(tmp_path / "out" / "base.yaml")
    assert base.drive.controller is not None
    assert [item.name for item in base.drive.inputs] == ["wanted"]


def test_what_a_noisy_loop_hides_is_found(tmp_path: Path) -> None:
    """An unbalance that the loop makes up for shows in the current that it asks for."""
    result = diagnosed(written(tmp_path, UNBALANCE))
    (accepted,) = result["accepted"]
    assert accepted["effect"] == "unbalance"
    assert accepted["parameters"]["motor.gravity.torque"]["value"] == pytest.approx(UNBALANCE, rel=0.1)


@pytest.mark.parametrize(
    ("channel", "change"),
    [("speed", {"noise_std": None, "resolution": 0.01}), ("current", {"measures": "motor.torque"})],
)
def test_a_loop_stays_closed(tmp_path: Path, channel: str, change: dict[str, Any]) -> None:
    """Where it may see finer than what is logged, or where its command is not."""
    path = written(tmp_path)
    assert driven_as_recorded(load_problem(path)) is not None
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    spoilt = {**CHANNELS[channel], **change}
    document["channels"][channel] = {key: value for key, value in spoilt.items() if value is not None}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    assert driven_as_recorded(load_problem(path)) is None


def test_a_loop_is_closed_again(tmp_path: Path) -> None:
    """With the roles that its channels had, and what else was found of them."""
    stated = load_problem(written(tmp_path))
    driven = driven_as_recorded(stated)
    assert driven is not None and driven.drive.controller is None
    assert [item.name for item in driven.drive.inputs] == ["current"]
    found = replace(driven.drive, channels=tuple(replace(item, offset=0.1) for item in driven.drive.channels))
    closed = in_its_loop(found, {}, stated, driven)
    assert closed.controller == stated.drive.controller
    assert [(item.name, item.role) for item in closed.channels] == [(it.name, it.role) for it in stated.drive.channels]
    assert [item.offset for item in closed.channels] == [0.0, 0.1, 0.1, 0.1]
    assert opened(stated, stated) == [] and len(opened(stated, driven)) == 1


def test_a_loop_that_was_not_opened_keeps_how_its_set_points_are_read(tmp_path: Path) -> None:
    """What another reading of the inputs has found is written as it was found."""
    stated = load_problem(written(tmp_path))
    turned = replace(stated.drive, channels=tuple(replace(item, hold="linear") for item in stated.drive.channels))
    assert in_its_loop(turned, {}, stated, replace(stated, drive=turned)) is turned


@pytest.mark.parametrize("sample_time", [STEP, None])
def test_a_dead_time_in_a_loop_is_written_as_the_loop_has_it(tmp_path: Path, sample_time: float | None) -> None:
    """The motor of a file with a controller has none: the controller is late, or the motor lags more."""
    path = written(tmp_path)
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    if sample_time is None:
        del document["controller"]["sample_time"]
        path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    stated = load_problem(path)
    driven = driven_as_recorded(stated)
    assert driven is not None
    (motor,) = driven.drive.motors
    late = replace(motor, lag=Free(1e-3, 1e-5, 1.0), dead_time=Free(1e-3, 0.0, 1.0))
    values = {"motor.lag": 2e-3, "motor.dead_time": 3e-3}
    closed = in_its_loop(replace(driven.drive, motors=(late,)), values, stated, driven)
    (motor,), controller = closed.motors, closed.controller
    assert controller is not None and motor.dead_time == 0.0
    assert controller.delay == (0.0 if sample_time is None else pytest.approx(3e-3))
    assert motor.lag == (pytest.approx(5e-3) if sample_time is None else late.lag)
    again = tmp_path / "again.yaml"
    again.write_text(write_problem(path, closed, values, tmp_path), encoding="utf-8")
    assert load_problem(again).drive.controller is not None
