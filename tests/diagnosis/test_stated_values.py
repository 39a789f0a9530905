"""Stated values that the recordings contradict, on a drive of the plant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import INERTIA, TORQUE_CONSTANT, axis, write_case
from plant import PlantShaft, PlantTransmission

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis_document import diagnosis_document
from friction_ocp.problem_file.load import load_problem

GRAVITY = 0.2


@pytest.mark.parametrize(
    ("factor", "accepted"),
    [(1.4, (("inertia_error", "motor"),)), pytest.param(1.04, (), marks=pytest.mark.slow)],
)
def test_an_inertia_beyond_three_deviations_of_its_prior_is_named(
    factor: float, accepted: tuple[tuple[str, str], ...], tmp_path: Path
) -> None:
    """A handbook that is 40 % off by its own 5 % is contradicted, its value found; one that is 4 % off is not."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    stated = {"guess": factor * INERTIA, "prior_std": 0.05 * factor * INERTIA, "min": 1e-4, "max": 0.1}
    document["drive"]["shafts"][0]["inertia"] = stated
    document["diagnosis"]["effects"] = ["stribeck", "sensor_delay"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = diagnose(load_problem(path))
    assert found.accepted == accepted
    assert found.final.values["motor.inertia"] == pytest.approx(INERTIA, rel=0.01)
    document = diagnosis_document(found)
    assert document["verdict"] == ("explained" if accepted else "no_gap")
    assert [list(item["parameters"]) for item in document["accepted"]] == [["motor.inertia"]] * len(accepted)
    (only,) = document["rounds"]  # that nothing else is missing is no statement of its own beside a wrong value
    assert (only["probabilities"]["no_effect"] > 0.9) == (not accepted)
    assert {"stribeck", "sensor_delay"} <= {cause["effect"] for cause in only["causes"]}


def test_a_stated_value_may_be_named_as_a_diagnosis_names_it(tmp_path: Path) -> None:
    """An entry of `effects` is what an earlier diagnosis found: an inertia that is fitted about a wrong prior."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    stated = {"guess": 1.4 * INERTIA, "prior_std": 0.07 * INERTIA, "min": 1e-4, "max": 0.1}
    document["drive"]["shafts"][0]["inertia"] = stated
    document["diagnosis"]["effects"] = ["inertia_error at motor"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    assert diagnose(load_problem(path)).accepted == (("inertia_error", "motor"),)


def test_only_named_stated_values_are_taken_back(tmp_path: Path) -> None:
    """Where a problem names which stated values compete, a contradicted inertia that is none of them stays."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    stated = {"guess": 1.4 * INERTIA, "prior_std": 0.07 * INERTIA, "min": 1e-4, "max": 0.1}
    document["drive"]["shafts"][0]["inertia"] = stated
    document["diagnosis"]["effects"] = ["stribeck", "parameter_error"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    assert ("inertia_error", "motor") not in diagnose(load_problem(path)).accepted


def test_a_fixed_value_is_named_before_the_fitted_ones_that_gave_way_to_it(tmp_path: Path) -> None:
    """Half the true weight, stated as fixed, is as if motor constant and inertia were half of what they are."""
    plant = axis()
    shaft = replace(plant.shafts[0], gravity=(GRAVITY, 0.0))
    path = write_case(tmp_path, replace(plant, shafts=(shaft,)))
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    shaft = document["drive"]["shafts"][0]
    shaft["gravity"] = {"torque": 0.5 * GRAVITY}
    shaft["inertia"] = {"guess": INERTIA, "prior_std": 0.05 * INERTIA, "min": 1e-4, "max": 0.1}
    known = {"guess": TORQUE_CONSTANT, "prior_std": 0.05 * TORQUE_CONSTANT, "min": 0.03, "max": 3.0}
    document["drive"]["motor"]["torque_constant"] = known
    document["diagnosis"]["effects"] = ["stribeck", "inertia_error", "parameter_error"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = diagnose(load_problem(path))
    assert found.accepted == (("parameter_error", "motor"),)
    assert found.final.values["motor.gravity.torque"] == pytest.approx(GRAVITY, rel=0.15)
    tried = {rival.key for rival in found.rounds[-1].choice.rivals}
    assert tried == {("parameter_error", "motor"), ("inertia_error", "motor")}


@pytest.mark.slow
def test_an_inertia_may_be_stated_with_what_hangs_on_it(tmp_path: Path) -> None:
    """A fifth of the stated inertia hangs on a spring; the rest is no contradiction."""
    plant, moved, rate = axis(), 0.2 * INERTIA, 2.0 * np.pi * 15.0
    spring = PlantTransmission("motor", "hung", 1.0, moved * rate**2, 0.04 * moved * rate)
    shafts = (replace(plant.shafts[0], inertia=INERTIA - moved), PlantShaft("hung", moved))
    path = write_case(tmp_path, replace(plant, shafts=shafts, transmissions=(spring,)))
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    stated = {"guess": INERTIA, "prior_std": 0.02 * INERTIA, "min": 1e-4, "max": 0.1}
    document["drive"]["shafts"][0]["inertia"] = stated
    document["diagnosis"]["effects"] = ["stribeck", "structural_mode"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = diagnose(load_problem(path))
    assert found.accepted == (("structural_mode", "motor"),)
    assert found.final.values["motor.inertia"] < 0.9 * INERTIA
