"""A servo as it was measured: models far from its recordings are compared on conditions that they have not seen."""

from __future__ import annotations

from pathlib import Path

import pytest

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.problem_file.load import load_problem

PROBLEM = Path(__file__).parents[2] / "problems" / "xl330" / "coulomb_viscous.yaml"


@pytest.mark.slow
def test_friction_that_grows_with_the_load_is_found_and_carries_over() -> None:
    """Nothing of the catalogue takes all; what comes nearer where it was fitted is worse at gains left out."""
    found = diagnose(load_problem(PROBLEM))
    assert found.accepted == (("load_dependence", "servo"),)
    assert found.closed.interval95[0] > 0.0
    assert found.left_over
