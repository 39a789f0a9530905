"""A model of which every number is known: a simulation that somebody else wrote down."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from diagnosis_cases import COULOMB, INERTIA, TORQUE_CONSTANT, VISCOUS, axis, diagnosed, write_case
from plant import Plant

EFFECTS = ("friction", "stribeck", "quadratic_drag", "inertia_error", "sensor_delay")


def known(folder: Path, plant: Plant, inertia: float = INERTIA, rubs: bool = True) -> Path:
    """Write a case whose problem states all numbers, with friction or without."""
    path = write_case(folder, plant, effects=EFFECTS)
    document: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    friction = {"law": "coulomb_viscous", "tau_c": COULOMB, "viscous": VISCOUS}
    shaft = {"name": "motor", "inertia": inertia, **({"friction": friction} if rubs else {})}
    document["drive"] = {"motor": {"torque_constant": TORQUE_CONSTANT}, "shafts": [shaft]}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def test_a_model_that_is_right_has_no_gap(tmp_path: Path) -> None:
    """Nothing is fitted, and nothing is missing."""
    result = diagnosed(known(tmp_path, axis()))
    assert result["verdict"] == "no_gap" and not result["accepted"]


@pytest.mark.parametrize(
    ("plant", "inertia", "effect"),
    [
        pytest.param(axis(law="stribeck", tau_s=1.6 * COULOMB, omega_s=3.0), INERTIA, "stribeck", id="stribeck"),
        pytest.param(axis(), 1.3 * INERTIA, "inertia_error", id="inertia", marks=pytest.mark.slow),
    ],
)
def test_what_is_wrong_with_it_is_found(tmp_path: Path, plant: Plant, inertia: float, effect: str) -> None:
    """Be it an effect that it lacks, or a number."""
    result = diagnosed(known(tmp_path, plant, inertia))
    assert [(item["effect"], item["component"]) for item in result["accepted"]] == [(effect, "motor")]
    assert result["verdict"] == "explained"


@pytest.mark.slow
def test_a_model_without_friction_is_given_some(tmp_path: Path) -> None:
    """As simulations of robots often are; and what that friction does beside, once it is there."""
    result = diagnosed(known(tmp_path, axis(law="stribeck", tau_s=1.6 * COULOMB, omega_s=3.0), rubs=False))
    assert {item["effect"] for item in result["accepted"]} == {"friction", "stribeck"}
    assert result["verdict"] == "explained"
    augmented = yaml.safe_load((tmp_path / "out" / "augmented.yaml").read_text(encoding="utf-8"))
    friction = augmented["drive"]["shafts"][0]["friction"]
    found = {key: friction[key]["guess"] for key in ("tau_c", "viscous")}
    assert found == pytest.approx({"tau_c": COULOMB, "viscous": VISCOUS}, rel=0.03)
