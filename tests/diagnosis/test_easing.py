"""A refit from afar: wide gaps lead from a model without bristles to the bristles of the ARIES telescope."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.screen import screen
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem

sys.path.insert(0, str(Path(__file__).parents[2] / "problems" / "benchmarks"))
import gaps


@pytest.mark.slow
def test_bristles_are_found_from_far_away(tmp_path: Path) -> None:
    """Nothing but noise is left of an axis whose base model lacks its bristles altogether."""
    base = fit_base(prepare(load_problem(gaps.aries_axis("presliding", tmp_path))))
    seen = screen(base, effects()["presliding"], "axis", clues_of(base))
    assert seen is not None
    assert innovations(base).significant(0.01)
    assert not innovations(completed(quick_refit(base, seen))).significant(0.01)
