"""What a machine has is of another shape than the catalogue gives it: still one effect, and nothing is left."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, TORQUE_CONSTANT, axis, write_case
from plant import Plant, PlantRipple

from friction_ocp.cli import main

EXPONENT = 0.8
COSINES, SINES = (0.03, 0.0, 0.006), (0.0, -0.012, 0.0)


def cogging() -> Plant:
    """Return an axis whose cogging has overtones."""
    plain = axis()
    return replace(plain, motors=(replace(plain.motors[0], cogging=PlantRipple(3.1, COSINES, SINES)),))


def diagnosed(folder: Path, plant: Plant, effects: list[str]) -> dict[str, Any]:
    """Return the result document of a diagnosis with a narrow catalogue."""
    path = write_case(folder, plant)
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["diagnosis"]["effects"] = effects
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    assert main(["diagnose", str(path), "--out", str(folder / "out")]) == 0
    return json.loads((folder / "out" / "result.json").read_text(encoding="utf-8"))


def values_of(result: dict[str, Any]) -> dict[str, float]:
    """Return the parameters of the one effect that explains all, by the last part of their names."""
    (accepted,) = result["accepted"]
    assert result["verdict"] == "explained" and not result["alias_sets"]
    shaped = [item["accepted"] for item in result["rounds"] if item["reshaped"]]
    assert shaped == [{key: accepted[key] for key in ("effect", "component")}]
    return {name.rpartition(".")[2]: item["value"] for name, item in accepted["parameters"].items()}


def test_the_exponent_of_a_stribeck_curve_is_found(tmp_path: Path) -> None:
    """Friction that falls more pointedly than a bell is Stribeck friction all the same."""
    plant = axis(law="stribeck", tau_s=2.0 * COULOMB, omega_s=6.0, delta=EXPONENT)
    found = values_of(diagnosed(tmp_path, plant, ["stribeck"]))
    assert found["delta"] == pytest.approx(EXPONENT, rel=0.1)
    assert found["torque"] == pytest.approx(COULOMB, rel=0.1)
    assert "Given a more general shape: stribeck at motor" in (tmp_path / "out" / "report.html").read_text("utf-8")


@pytest.mark.slow
def test_overtones_belong_to_their_wave(tmp_path: Path) -> None:
    """Cogging with overtones is no second ripple."""
    found = values_of(diagnosed(tmp_path, cogging(), ["cogging", "torque_ripple", "position_ripple"]))
    sizes = [np.hypot(found[f"{order}cosine"], found[f"{order}sine"]) for order in ("", "second_", "third_")]
    assert sizes == pytest.approx(np.hypot(COSINES, SINES), rel=0.1)
    assert max(sizes) < TORQUE_CONSTANT
