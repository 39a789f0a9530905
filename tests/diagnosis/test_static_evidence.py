"""Static points take part in a diagnosis: the Leighton telescope, whose motor follows a prescribed speed."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.blocks import blocks_of
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis.excess import excess
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem

sys.path.insert(0, str(Path(__file__).parents[2] / "problems" / "benchmarks"))
import gaps


def test_a_curve_that_the_model_cannot_bend_to_is_a_gap(tmp_path: Path) -> None:
    """The points are rows of their own, far beyond their standard errors, and tested by themselves."""
    fitted = fit_base(prepare(load_problem(gaps.lto("high", tmp_path))))
    rows = fitted.linear.rows
    (number,) = rows.static
    own = rows.recording == number
    term = fitted.model.static[0]
    assert np.allclose(rows.residual[own], term.residuals(fitted.model.space, fitted.theta)[0])
    assert excess(rows, blocks_of(rows)).p_value < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "effect", "place"),
    [("high", "polyline_break", "motor"), ("low", "polyline_break", "load"), ("quadratic", "quadratic_drag", "motor")],
)
def test_friction_that_the_curve_shows_is_found_where_it_is(kind: str, effect: str, place: str, tmp_path: Path) -> None:
    """The curve tells the law, start and stop tell the side."""
    found = diagnose(load_problem(gaps.lto(kind, tmp_path)))
    assert found.verdict == "explained"
    assert found.accepted == ((effect, place),)
