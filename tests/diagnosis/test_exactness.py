"""What a free period costs that came out as it did."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis.exactness import exactness
from friction_ocp.diagnosis.fitted_model import FittedModel

AMPLITUDE, PERIOD, STEP = 0.5, 0.31, 0.01
LOW, HIGH = 0.1, 1.0


def fitted(seconds: float, names: tuple[str, ...], low: float = LOW) -> FittedModel:
    """Return what a fit of a wave in time to samples with noise of one leaves."""
    time = np.arange(0.0, seconds, STEP) - seconds / 2.0
    angle = 2.0 * np.pi * time / PERIOD
    columns = [np.cos(angle), np.sin(angle), AMPLITUDE * np.sin(angle) * angle / PERIOD]
    space = SimpleNamespace(names=names, lower=np.array([-9.0, -9.0, low]), upper=np.array([9.0, 9.0, HIGH]))
    linear = SimpleNamespace(rows=SimpleNamespace(jacobian=np.column_stack(columns)))
    parts = SimpleNamespace(model=SimpleNamespace(space=space), theta=np.array([AMPLITUDE, 0.0, PERIOD]), linear=linear)
    return cast(Any, parts)


NAMES = ("axis.disturbance.cosine", "axis.disturbance.sine", "axis.disturbance.period")


@pytest.mark.parametrize("seconds", [20.0, 80.0])
def test_the_error_of_a_period_is_that_of_a_line_in_a_spectrum(seconds: float) -> None:
    """The variance of an angular frequency is 24 / (a^2 n^3) per sample squared (Rife and Boorstyn 1974)."""
    count = seconds / STEP
    relative = np.sqrt(24.0 / (AMPLITUDE**2 * count**3)) / (2.0 * np.pi * STEP / PERIOD)
    expected = np.log(np.log(HIGH / LOW) / (np.sqrt(2.0 * np.pi) * relative))
    assert exactness(fitted(seconds, NAMES)) == pytest.approx(expected, abs=0.02)


def test_what_is_no_period_or_has_no_range_costs_nothing() -> None:
    """Amplitudes pay the price of a parameter alone, and so does what may be as short as it likes."""
    assert exactness(fitted(20.0, (*NAMES[:2], "axis.disturbance.other"))) == 0.0
    assert exactness(fitted(20.0, NAMES, low=0.0)) == 0.0
