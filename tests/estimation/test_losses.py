"""Weights and curvatures are the derivatives of the losses that they belong to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from friction_ocp.simulation.losses import Absolute, AbstractLoss, Huber, Squares, StudentT

LOSSES = [Squares(), Absolute(0.3), Absolute(3.0), Huber(), Huber(0.5), StudentT(), StudentT(1.5)]
STEP, TRUNCATION = 1e-5, 1e-6
every_loss = pytest.mark.parametrize("loss", LOSSES, ids=repr)
sizes = st.floats(-30, 30)


def slope(function: object, at: float) -> float:
    """Return a central difference."""
    ahead, behind = (float(function(np.array([at + step]))[0]) for step in (STEP, -STEP))  # type: ignore[operator]
    return (ahead - behind) / (2 * STEP)


@every_loss
@given(r=sizes)
def test_the_weight_is_the_slope_over_the_residual(loss: AbstractLoss, r: float) -> None:
    """weight(r) r = rho'(r), away from the knee of Huber's loss."""
    if isinstance(loss, Huber):
        assume(abs(abs(r) - loss.knee) > 2 * STEP)
    assert float(loss.weight(np.array([r]))[0]) * r == pytest.approx(
        slope(loss.cost, r), abs=TRUNCATION, rel=TRUNCATION
    )


@every_loss
@given(r=sizes)
def test_the_curvature_is_the_second_derivative(loss: AbstractLoss, r: float) -> None:
    """curvature(r) = rho''(r), away from the knee of Huber's loss."""
    if isinstance(loss, Huber):
        assume(abs(abs(r) - loss.knee) > 2 * STEP)
    by_slope = slope(lambda x: loss.weight(x) * x, r)
    assert float(loss.curvature(np.array([r]))[0]) == pytest.approx(by_slope, abs=TRUNCATION, rel=TRUNCATION)


@every_loss
@given(r=sizes)
def test_losses_are_even_and_smallest_at_zero(loss: AbstractLoss, r: float) -> None:
    """rho(-r) = rho(r) >= rho(0) = 0, and no residual is pushed away from zero."""
    here, there, zero = loss.cost(np.array([r, -r, 0.0]))
    assert here == there >= zero == 0.0
    assert float(loss.weight(np.array([r]))[0]) > 0.0


def test_the_absolute_loss_tends_to_the_size() -> None:
    """Its rounding lowers it by no more than itself."""
    r = np.linspace(-5, 5, 101)
    for rounding in (1.0, 0.1, 0.001):
        loss = Absolute(rounding)
        assert np.all(np.abs(loss.cost(r) - np.abs(r)) <= rounding)


@given(st.floats(0.1, 5), st.floats(5, 1e6))
def test_an_outlier_pulls_no_harder_than_the_knee(knee: float, outlier: float) -> None:
    """Huber's loss bounds the influence of one sample."""
    assert float(Huber(knee).weight(np.array([outlier]))[0]) * outlier == pytest.approx(knee)
