"""A loop whose tachometer is noisy: what it makes of the noise moves the machine, and is no gap of the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import STEP, diagnosed
from looped_axis import CHANNELS, written

from friction_ocp import simulate
from friction_ocp.diagnosis.loop import driven_as_recorded, opened
from friction_ocp.drive.control import noise_gain
from friction_ocp.drive.parts import Controller
from friction_ocp.problem_file.load import load_problem

UNBALANCE = 0.05
"""N m."""


@pytest.mark.slow
def test_the_noise_of_a_loop_is_no_gap(tmp_path: Path) -> None:
    """A model that is right explains the recordings; the file that is written is driven as the diagnosis was."""
    result = diagnosed(written(tmp_path))
    assert result["verdict"] == "no_gap"
    assert any(line.startswith("current: as recorded") for line in result["assumptions"])
    base = load_problem(tmp_path / "out" / "base.yaml")
    assert base.drive.controller is None
    assert [item.name for item in base.drive.inputs] == ["current"]


@pytest.mark.slow
def test_what_a_noisy_loop_hides_is_found(tmp_path: Path) -> None:
    """An unbalance that the loop makes up for shows in the current that it asks for."""
    result = diagnosed(written(tmp_path, UNBALANCE))
    (accepted,) = result["accepted"]
    assert accepted["effect"] == "unbalance"
    assert accepted["parameters"]["motor.gravity.torque"]["value"] == pytest.approx(UNBALANCE, rel=0.1)
    again = simulate(load_problem(tmp_path / "out" / "augmented.yaml"))
    for name, (errors, _) in again.validation_errors.items():
        assert errors.noise_ratio == pytest.approx(result["gap"]["after"][name]["noise_ratio"], rel=0.02)


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


def test_a_loop_that_sees_finer_than_what_is_logged_stays_closed(tmp_path: Path) -> None:
    """Its command, less noisy than the loop would make it of what is logged, tells."""
    assert driven_as_recorded(load_problem(written(tmp_path, feedback="quiet"))) is None


@pytest.mark.parametrize("step", [None, STEP])
def test_noise_of_a_command(step: float | None) -> None:
    """That of an angle counts twice where it is differentiated, that of a speed once."""
    gains = Controller("pd", "position", kp=3.0, kd=0.01, sample_time=step)
    assert noise_gain(gains, False, STEP) == pytest.approx(np.hypot(3.0 + 0.01 / STEP, 0.01 / STEP))
    inner = Controller("cascade", "position", kp=20.0, ki=5.0, kd=0.1, sample_time=step, derivative="two_tap_mean")
    assert noise_gain(inner, False, STEP) == pytest.approx(0.1 * np.hypot(20.0 + 0.5 / STEP, 0.5 / STEP))
    assert noise_gain(Controller("pi_velocity", "speed", kp=0.06, ki=0.6, sample_time=step), True, STEP) == 0.06


def test_a_controller_that_differs_by_recording_stays(tmp_path: Path) -> None:
    """Without it what the file sets of it would be set of nothing."""
    path = written(tmp_path)
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["recordings"]["train"] = [{"file": "a.h5", "set": {"controller.kp": 0.06}}, "b.h5"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    assert driven_as_recorded(load_problem(path)) is None


def test_a_loop_that_was_opened_is_told(tmp_path: Path) -> None:
    """By one sentence."""
    stated = load_problem(written(tmp_path))
    driven = driven_as_recorded(stated)
    assert driven is not None and driven.drive.controller is None
    assert [item.name for item in driven.drive.inputs] == ["current"]
    assert opened(stated, stated) == [] and len(opened(stated, driven)) == 1
