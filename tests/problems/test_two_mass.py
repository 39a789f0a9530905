"""The two-mass axis's problem against the plant that made its recordings."""

from __future__ import annotations

import pytest
from lto_cases import REPOSITORY, script

from friction_ocp import identify, load_problem

TRUTH: dict[str, float] = script("two_mass", "make_data").TRUTH
INTERVALS = 4.0


@pytest.mark.slow
def test_static_and_dynamic_friction_are_found_from_three_kinds_of_trace() -> None:
    """Every number within its own error; those that are determined to 3 %."""
    estimate = identify(load_problem(REPOSITORY / "problems" / "two_mass" / "joint.yaml"))
    assert estimate.converged, estimate.message
    for item in estimate.parameters:
        assert abs(item.value - TRUTH[item.name]) < INTERVALS * item.std_error, item.name
        if item.verdict.word == "ok":
            assert item.value == pytest.approx(TRUTH[item.name], rel=0.03), item.name
