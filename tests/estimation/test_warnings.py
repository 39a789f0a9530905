"""What stands above an answer is said once, in numbers that can be read."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.identifiability import Verdict
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.score import Errors
from friction_ocp.estimation.warnings import warnings_of


@dataclass(frozen=True)
class _Parameter:
    name: str
    value: float
    unit: str
    verdict: Verdict


def _warned(*parameters: _Parameter) -> tuple[str, ...]:
    ended = Solution(Point(np.zeros(len(parameters)), ()), 1.0, 3, True, "the step is small")
    unknown: Any = SimpleNamespace(kind="gauss_newton")
    unscored: Any = SimpleNamespace(train_errors={}, validation_errors={})
    return warnings_of(ended, parameters, unknown, {}, unscored)


def _traded(name: str, value: float, unit: str, *others: str) -> _Parameter:
    return _Parameter(name, value, unit, Verdict("traded", others))


def test_parameters_that_trade_with_one_another_are_one_warning() -> None:
    """A group is named once, with all its values; a pure number has no unit."""
    (text,) = _warned(
        _traded("tau_s", 0.0046, "N m", "omega_s", "load"),
        _traded("omega_s", 2.375, "rad/s", "tau_s", "load"),
        _traded("load", 0.3013, "1", "tau_s", "omega_s"),
    )
    assert text.startswith("tau_s = 0.0046 N m, omega_s = 2.375 rad/s, load = 0.3013 are traded with one another: ")


def test_different_groups_are_different_warnings() -> None:
    """Two pairs are two warnings, and a parameter whose partners do not point back names them."""
    texts = _warned(
        _traded("a", 1.0, "s", "b"),
        _traded("b", 2.0, "s", "a"),
        _traded("c", 3.0, "s", "known"),
    )
    assert [text.split(":")[0] for text in texts] == [
        "a = 1 s, b = 2 s are traded with one another",
        "c = 3 s is traded with known",
    ]


@pytest.mark.parametrize(("drifts", "told"), [({}, True), ({"position": 0.1}, False)])
def test_a_free_run_that_is_far_off_says_what_to_do(drifts: dict[str, float], told: bool) -> None:
    """Once, below its channels; where noise of torques or inputs is stated already there is nothing more to state."""
    ended = Solution(Point(np.zeros(0), ()), 1.0, 3, True, "the step is small")
    far = Errors(1e-3, 8e-4, 0.1, 0.1, 2907.0)
    unknown: Any = SimpleNamespace(kind="gauss_newton")
    scored: Any = SimpleNamespace(train_errors={"position": (far, {}), "angle": (far, {})}, validation_errors={})
    texts = warnings_of(ended, (), unknown, {}, scored, drifts)
    assert texts[:1] == (f"position: the error of the free run is {2893 if drifts else 2907} times the noise floor.",)
    assert [text.startswith("diagnose says what the model lacks.") for text in texts] == [
        False,
        False,
        *([True] * told),
    ]
