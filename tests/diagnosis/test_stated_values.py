"""Stated values that the recordings contradict, on a drive of the plant."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from diagnosis_cases import INERTIA, axis, write_case

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis_document import diagnosis_document
from friction_ocp.problem_file.load import load_problem


@pytest.mark.parametrize(("factor", "accepted"), [(1.4, (("inertia_error", "motor"),)), (1.04, ())])
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
