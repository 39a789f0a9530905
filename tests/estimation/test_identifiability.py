"""Verdicts: what the data tell, what they tell only together, and what they do not tell."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from regressions import regression, space

from friction_ocp.estimation.identifiability import CONDITION_INDEX, MATERIAL, Verdict, verdicts
from friction_ocp.estimation.uncertainty import uncertainty

OK = Verdict("ok")
ROWS = 400


def independent(columns: int) -> np.ndarray:
    """Return orthogonal regressors of unit norm."""
    noise = np.random.default_rng(1).standard_normal((ROWS, columns))
    return np.linalg.qr(noise)[0]


def judge(
    x: np.ndarray,
    theta: np.ndarray,
    lower: np.ndarray | float = -100.0,
    upper: np.ndarray | float = 100.0,
    prior_std: np.ndarray | float = np.inf,
    white: bool = True,
) -> tuple[Verdict, ...]:
    """Return the verdicts on a regression."""
    bounds = space(theta, lower, upper, prior_std)
    return verdicts(
        bounds, theta, uncertainty(bounds, theta, regression(x, np.zeros(ROWS), prior_std=prior_std), True, "squares")
    )


def test_independent_parameters_are_ok() -> None:
    """Nothing is said against what the data tell."""
    assert judge(100 * independent(3), np.ones(3)) == (OK, OK, OK)


def test_parameters_that_only_appear_as_a_sum_are_traded() -> None:
    """Each names the other, and a third one is left alone."""
    x = 100 * independent(3)
    x[:, 1] = x[:, 0]
    assert judge(x, np.ones(3)) == (Verdict("traded", ("b",)), Verdict("traded", ("a",)), OK)


def test_three_parameters_can_trade_in_one_combination() -> None:
    """Of a + b and c nothing else is known: all three name the other two."""
    x = 100 * independent(4)
    x[:, 2] = x[:, 0] + x[:, 1]
    assert [verdict.traded_with for verdict in judge(x, np.ones(4))] == [("b", "c"), ("a", "c"), ("a", "b"), ()]


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_near_dependency_is_harmful_from_belsleys_threshold(factor: float) -> None:
    """Two unit regressors at an angle have the condition index sqrt((1 + cos) / (1 - cos)); 30 is the threshold."""
    index = factor * CONDITION_INDEX
    cosine = (index**2 - 1) / (index**2 + 1)
    x = 30 * independent(2)
    x[:, 1] = cosine * x[:, 0] + np.sqrt(1 - cosine**2) * x[:, 1]
    word = "traded" if factor > 1 else "ok"
    assert [verdict.word for verdict in judge(x, np.ones(2))] == [word, word]


def test_a_dependency_that_leaves_the_parameters_known_is_not_mentioned() -> None:
    """Below one per cent of error there is nothing to trade."""
    x = independent(2)
    x[:, 1] = x[:, 0] + 0.01 * x[:, 1]
    strong = 2.0 / (0.01 * MATERIAL)
    assert judge(strong * x, np.ones(2)) == (OK, OK)
    assert [verdict.word for verdict in judge(0.1 * strong * x, np.ones(2))] == ["traded", "traded"]


def test_what_no_residual_depends_on_is_not_identifiable() -> None:
    """Finite or infinite bounds, with or without a prior: the data do not see it."""
    x = 100 * independent(3)
    x[:, 1] = 0.0
    assert judge(x, np.ones(3))[1].word == "not_identifiable"
    assert judge(x, np.ones(3), -np.inf, np.inf)[1].word == "not_identifiable"
    assert judge(x, np.ones(3), prior_std=np.array([np.inf, 0.1, np.inf]))[1].word == "not_identifiable"


def test_a_parameter_known_to_half_of_its_bounds_is_not_identifiable() -> None:
    """Data that exclude nothing of what the bounds allow tell nothing; tighter data tell something."""
    x, theta = independent(2), np.array([0.5, 0.5])
    weak, strong = (judge(scale * x, theta, 0.0, 1.0)[0].word for scale in (0.5, 20.0))
    assert (weak, strong) == ("not_identifiable", "ok")


def test_an_interval_over_all_of_the_bounds_is_not_identifiable() -> None:
    """Alone a parameter may be known, but not beside the others: where nothing is excluded then, nothing is told.

    Two regressors of unit norm at an angle of cosine c leave sqrt(1 - c^2) of what tells each alone.
    """
    x = independent(2)
    cosine = 0.99
    x[:, 1] = cosine * x[:, 0] + np.sqrt(1 - cosine**2) * x[:, 1]
    theta, std_error = np.array([0.5, 0.5]), 0.5 / 1.96
    strength = 1.0 / (std_error * np.sqrt(1 - cosine**2))
    words = {factor: [item.word for item in judge(factor * strength * x, theta, 0.0, 1.0)] for factor in (0.98, 1.02)}
    assert words == {0.98: ["not_identifiable"] * 2, 1.02: ["ok"] * 2}
    assert judge(0.98 * strength * x, theta, 0.0, np.inf) == (OK, OK)


def test_a_bound_comes_first() -> None:
    """A parameter at its bound is judged so, and does not count among the partners of others."""
    x = 100 * independent(3)
    x[:, 1] = x[:, 0]
    assert judge(x, np.array([0.0, 1.0, 1.0]), lower=0.0) == (Verdict("at_bound"), OK, OK)


@given(st.lists(st.floats(-6, 6), min_size=4, max_size=4))
def test_verdicts_do_not_depend_on_units(exponents: list[float]) -> None:
    """Writing a parameter in other units changes its number, bounds and regressor, and no verdict."""
    unit = 10.0 ** np.array(exponents)
    x = 100 * independent(4)
    x[:, 1] = x[:, 0] + 1e-4 * x[:, 1]
    x[:, 3] *= 1e-6
    plain = judge(x, np.ones(4), -50.0, 50.0)
    assert judge(x / unit, unit, -50.0 * unit, 50.0 * unit) == plain
    assert [verdict.word for verdict in plain] == ["traded", "traded", "ok", "not_identifiable"]
