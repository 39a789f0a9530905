"""What a diagnosis cannot tell because nothing was recorded slowly enough."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import axis, write_case
from scipy.optimize import brentq  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.blind_spots import CERTAIN, BlindSpot, blind_spots
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.options import Considered
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem

sys.path.insert(0, str(Path(__file__).parents[2] / "problems" / "benchmarks"))
import gaps


def found(fitted: FittedModel, *names: str) -> dict[str, BlindSpot]:
    """Return what the recordings of a fit hide, by component, as if it left noise alone."""
    spots = blind_spots(fitted, Excess(1.0, 1.0), clues_of(fitted), Considered(dict.fromkeys(names)))
    return {item.component: item for item in spots}


def test_a_curve_tells_the_speed_below_which_stribeck_friction_hides(tmp_path: Path) -> None:
    """The curve alone shows the motor's friction: what a straight line leaves of a rise over its points says it."""
    fitted = fit_base(prepare(load_problem(gaps.lto("high", tmp_path))))
    spot, term = found(fitted, "stribeck")["motor"], fitted.model.static[0]
    line = np.linalg.qr(np.column_stack([np.ones(term.speed.size), term.speed]) / term.std_error[:, None])[0]

    def beyond(speed: float) -> float:
        rise = spot.size / fitted.values.get("motor.torque_constant", 0.35) * np.exp(-((term.speed / speed) ** 2))
        column = rise / term.std_error
        return float(np.linalg.norm(column - line @ (line.T @ column))) - CERTAIN

    assert spot.size == pytest.approx(fitted.values["motor.friction.tau_c"])
    assert spot.below == pytest.approx(float(brentq(beyond, 0.1, 10.0)), rel=0.05)  # pyright: ignore[reportUnknownArgumentType]


def test_only_what_slow_motion_alone_shows_can_hide(tmp_path: Path) -> None:
    """An axis that reverses all the time hides little Stribeck friction, and a bend in its friction nowhere."""
    fitted = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    fastest = float(np.max(np.abs(clues_of(fitted).speeds("motor"))))
    spots = found(fitted, "stribeck", "polyline_break")
    assert [item.effect for item in spots.values()] in ([], ["stribeck"])
    assert all(item.below < 0.02 * fastest for item in spots.values())
