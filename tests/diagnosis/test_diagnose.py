"""Diagnosis from end to end on drives of the plant whose model lacks something, or nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import COULOMB, axis, record, write_case

from friction_ocp.cli import main
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors
from friction_ocp.diagnosis.straying import strays_as_far
from friction_ocp.estimation.estimate import simulate
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording

RISE, STRIBECK_SPEED = 0.05, 6.0
STRIBECK = {"law": "stribeck", "tau_s": 0.1 + RISE, "omega_s": STRIBECK_SPEED}


@pytest.fixture(scope="module")
def stribeck(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Return the output folder and the result document of a drive that lacks Stribeck friction."""
    folder = tmp_path_factory.mktemp("stribeck")
    path = write_case(folder, axis(**STRIBECK))
    assert main(["diagnose", str(path), "--out", str(folder / "out")]) == 0
    return folder / "out", json.loads((folder / "out" / "result.json").read_text(encoding="utf-8"))


def test_what_is_missing_is_found_and_measured(stribeck: tuple[Path, dict[str, Any]]) -> None:
    """Stribeck friction that the model lacks is named, its size and speed within a tenth."""
    result = stribeck[1]
    assert result["verdict"] == "explained"
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("stribeck", "motor")
    values = {name.rpartition(".")[2]: item["value"] for name, item in accepted["parameters"].items()}
    assert values["torque"] == pytest.approx(RISE, rel=0.1)
    assert values["omega_s"] == pytest.approx(STRIBECK_SPEED, rel=0.1)


def test_the_document_holds_what_it_promises(stribeck: tuple[Path, dict[str, Any]]) -> None:
    """Probabilities of a round sum to 1, the gap closes on validation, a parameter that stood in is named."""
    result = stribeck[1]
    for item in result["rounds"]:
        total = sum(item["probabilities"].values()) + sum(cause["probability"] for cause in item["causes"])
        assert total == pytest.approx(1.0)
    assert result["gap"]["evaluated_on"] == ["c.h5"]
    low, high = result["gap"]["shrink"]["interval95"]
    assert 0.8 < low <= result["gap"]["shrink"]["overall"] <= high <= 1.0
    assert "motor.friction.viscous" in [item["name"] for item in result["biased_parameters"]]
    assert result["remainder"]["significant"] is False


def test_the_augmented_problem_is_a_problem(stribeck: tuple[Path, dict[str, Any]]) -> None:
    """augmented.yaml loads and simulates as closely as the diagnosis says."""
    folder, result = stribeck
    problem = load_problem(folder / "augmented.yaml")
    assert problem.drive.shaft("motor").friction.law.magnitude
    assert main(["simulate", str(folder / "augmented.yaml"), "--out", str(folder / "simulated")]) == 0
    simulated = json.loads((folder / "simulated" / "result.json").read_text(encoding="utf-8"))
    ratio = simulated["fit"]["validation"]["position"]["noise_ratio"]
    assert ratio == pytest.approx(result["gap"]["after"]["position"]["noise_ratio"], rel=0.05)


def test_the_base_problem_is_the_fit_without(stribeck: tuple[Path, dict[str, Any]]) -> None:
    """base.yaml simulates as the diagnosis found the model before."""
    folder, result = stribeck
    simulation = simulate(load_problem(folder / "base.yaml"))
    ratio = simulation.validation_errors["position"][0].noise_ratio
    assert ratio == pytest.approx(result["gap"]["before"]["position"]["noise_ratio"], rel=0.05)


def test_files_for_people(stribeck: tuple[Path, dict[str, Any]]) -> None:
    """The page says the verdict, and every figure is there twice."""
    folder, _ = stribeck
    assert "The model lacked stribeck at motor" in (folder / "report.html").read_text(encoding="utf-8")
    assert (folder / "result.h5").exists()
    for name in ("gap-map", "shape", "ranking-1", "before-after-c"):
        assert (folder / "figures" / f"{name}.png").exists() and (folder / "figures" / f"{name}.svg").exists()


def test_the_shape_is_drawn_with_what_was_added(stribeck: tuple[Path, dict[str, Any]]) -> None:
    """Friction that the model lacks near standstill: what the effect takes of it lies in the band of its mean."""
    _, result = stribeck
    found = result["where"]["shape"]
    torque, taken, low, high = (np.array(found[name]) for name in ("torque", "taken", "lower", "upper"))
    assert found["component"] == "motor" and np.sqrt(np.mean(torque**2)) > 0.01 * COULOMB
    assert np.sqrt(np.mean((torque - taken) ** 2)) < 0.2 * np.sqrt(np.mean(torque**2))
    assert np.mean((taken > low) & (taken < high)) > 0.5
    assert result["where"]["joint"] is None


def test_a_model_that_lacks_nothing_has_no_gap(tmp_path: Path) -> None:
    """Nothing is found where nothing is missing."""
    path = write_case(tmp_path, axis())
    assert main(["diagnose", str(path), "--out", str(tmp_path / "out"), "--workers", "1"]) == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "no_gap"
    assert result["accepted"] == [] and result["biased_parameters"] == []


@pytest.mark.slow
def test_what_does_not_carry_over_explains_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the recording left out is of a drive without the effect, adding it shrinks no gap there.

    How far noise sets free runs apart is looked at once.
    """
    path = write_case(tmp_path, axis(**STRIBECK))
    write_recording(record(axis(), "c", 12), tmp_path / "c.h5")
    asked = list[FreeErrors]()

    def counted(fitted: FittedModel, errors: FreeErrors, *rest: Any) -> bool:
        asked.append(errors)
        return strays_as_far(fitted, errors, *rest)

    monkeypatch.setattr("friction_ocp.diagnosis.diagnose.strays_as_far", counted)
    found = diagnose(load_problem(path))
    assert len(asked) == 1
    assert [key[0] for key in found.accepted] == ["stribeck"]
    assert not found.left_over
    assert not found.carries_over
    assert found.verdict == "unknown_effect"
