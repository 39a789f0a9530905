"""The solver of `identify` on the certified regressions of NIST: six digits, or no answer."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from certified_regressions import DIGITS, FOLDER, FORMULAS, Certified, read

from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.program import Point

ROUNDING = 1e-9
"""Certified sums of squares have eleven digits."""
LEAST = {1: 24, 2: 26}
"""Sets to be solved of 27, by start."""


@cache
def ends(start: int) -> tuple[tuple[Certified, Solution], ...]:
    cases = (read(name) for name in FORMULAS)
    return tuple((case, case.solve(start)) for case in cases)


def test_every_data_set_has_its_formula() -> None:
    """27 files, 27 models."""
    assert {path.stem for path in FOLDER.glob("*.dat")} == set(FORMULAS)
    assert len(FORMULAS) == 27


@pytest.mark.parametrize("name", sorted(set(FORMULAS) - {"Lanczos1"}))
def test_the_formula_has_the_certified_sum_of_squares(name: str) -> None:
    """At the certified parameters model and data give the certified sum (Lanczos1 leaves only rounding: 1e-25)."""
    case = read(name)
    found = 2.0 * case.program(1).linearise(Point(case.answer, ())).objective
    assert found == pytest.approx(case.residual_sum, rel=ROUNDING)


@pytest.mark.parametrize("start", [1, 2])
def test_nearly_all_are_solved_to_six_digits(start: int) -> None:
    """Start 1 is far, start 2 near the answer."""
    solved = [case.name for case, end in ends(start) if end.converged and case.digits(end.point.theta) >= DIGITS]
    assert len(solved) >= LEAST[start]


@pytest.mark.parametrize("start", [1, 2])
def test_no_wrong_answer_is_called_converged(start: int) -> None:
    """What is not solved says so."""
    wrong = [case.name for case, end in ends(start) if end.converged and case.digits(end.point.theta) < DIGITS]
    assert wrong == []


def test_digits_are_those_of_the_worst_parameter() -> None:
    """One part in 10^3 beside exact ones is three digits."""
    case = read("Misra1a")
    off = case.answer * np.array([1.0, 1.001])
    assert case.digits(off) == pytest.approx(3.0, abs=1e-6)
    assert case.digits(case.answer) == 11.0
