"""Beside a noisy current, which moves free runs more than anything else, effects are found by one-step predictions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import diagnosis_cases
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.diagnose import Diagnosis, diagnose
from friction_ocp.problem_file.load import load_problem

NOISY, LATE = 0.02, 0.0005


def diagnosed(folder: Path, monkeypatch: pytest.MonkeyPatch, **friction: float | str) -> Diagnosis:
    """Diagnose an axis with a late encoder and a noisy current."""
    monkeypatch.setattr(diagnosis_cases, "CURRENT_NOISE", NOISY)
    plant = axis(**friction)
    position, current = plant.sensors
    sensors = (replace(position, delay=LATE), replace(current, noise_std=NOISY))
    return diagnose(load_problem(write_case(folder, replace(plant, sensors=sensors))))


@pytest.mark.slow
def test_a_late_encoder_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = diagnosed(tmp_path, monkeypatch)
    assert found.accepted == (("sensor_delay", "position"),)
    assert found.verdict == "explained"
    assert found.final.values["position.delay"] == pytest.approx(LATE, rel=0.2)


@pytest.mark.slow
def test_a_late_encoder_and_drag_that_grows_with_the_square_of_speed_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = diagnosed(tmp_path, monkeypatch, law="quadratic", quadratic=5e-6)
    assert set(found.accepted) == {("sensor_delay", "position"), ("quadratic_drag", "motor")}
    assert not found.unexplained
