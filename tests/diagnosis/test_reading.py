"""Inputs that a machine held between its samples, and whose file says otherwise."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.diagnose import Diagnosis, diagnose
from friction_ocp.diagnosis_document import diagnosis_document
from friction_ocp.problem_file.load import load_problem


def found(folder: Path, **friction: object) -> Diagnosis:
    """Diagnose an axis whose current was held, with a file that joins its samples by lines."""
    path = write_case(folder, axis(**friction))
    path.write_text(path.read_text(encoding="utf-8").replace("hold: zero", "hold: linear"), encoding="utf-8")
    return diagnose(load_problem(path))


def test_a_held_input_is_no_delay(tmp_path: Path) -> None:
    """A model that lacks nothing has no gap; that its input is held is said beside what is assumed."""
    seen = found(tmp_path)
    assert seen.verdict == "no_gap"
    assert any(text.startswith("current: is held") for text in diagnosis_document(seen)["assumptions"])


@pytest.mark.slow
def test_an_effect_is_found_beside_it(tmp_path: Path) -> None:
    """What the drive has is named, and no delay with it."""
    assert found(tmp_path, law="stribeck", tau_s=0.15, omega_s=6.0).accepted == (("stribeck", "motor"),)
