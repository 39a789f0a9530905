"""Arithmetic of friction: the soft threshold, rounded jumps, and the means of a decay."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.friction.smoothing import decay_means, power, smooth_abs, smooth_sign, soft_threshold

ROUNDING = 4e-16
values = st.floats(-1e3, 1e3).map(lambda value: value if abs(value) > 1e-100 else 0.0)
levels = st.floats(0.0, 1e2)


@given(values, levels, levels)
def test_soft_threshold_solves_the_inclusion(value: float, upper: float, lower: float) -> None:
    """v + F(v) = value, with F = upper for v > 0, -lower for v < 0, and anything between while v is exactly 0."""
    v = float(soft_threshold(value, upper, lower))
    wanted = value - upper if value > upper else value + lower if value < -lower else 0.0
    assert v == pytest.approx(wanted, abs=ROUNDING * (abs(value) + upper + lower))
    if -lower < value < upper:
        assert v == 0.0


@given(values, levels, st.floats(1e-6, 10.0))
def test_a_rounded_soft_threshold_is_odd_and_close(value: float, level: float, width: float) -> None:
    """With equal levels the rounded threshold is odd, and nowhere farther than the width from the exact one."""
    v = float(soft_threshold(value, level, level, width))
    assert float(soft_threshold(-value, level, level, width)) == pytest.approx(-v, abs=ROUNDING * (abs(value) + level))
    assert abs(v - float(soft_threshold(value, level, level))) <= width


@given(values, values, levels, st.floats(0.0, 10.0))
def test_soft_threshold_is_monotone_and_never_amplifies(
    first: float, second: float, level: float, width: float
) -> None:
    """A larger value gives a larger result, by no more than the difference."""
    low, high = sorted((first, second))
    grown = float(soft_threshold(high, level, level, width)) - float(soft_threshold(low, level, level, width))
    rounding = 1e-12
    assert -rounding <= grown <= high - low + rounding


@given(st.floats(-1.0, 1.0))
def test_the_dead_zone_of_a_backlash_is_the_same_function(twist: float) -> None:
    """Within half the free play either way nothing is wound up; beyond it, what exceeds it."""
    wanted = np.sign(twist) * max(abs(twist) - 0.25, 0.0)
    assert float(soft_threshold(twist, 0.25, 0.25)) == pytest.approx(wanted, abs=ROUNDING)


@pytest.mark.parametrize("width", [0.0, 0.1])
@pytest.mark.parametrize("value", [0.0, 0.5, -0.5, 2.0])
def test_derivatives_are_finite_everywhere(value: float, width: float) -> None:
    """Threshold, sign, size and power have finite derivatives, at their corners and at zero too."""
    x = ca.SX.sym("x")
    terms = [soft_threshold(x, 0.5, 0.5, width), smooth_abs(x, width), smooth_sign(x, 0.1), power(x, 0.5)]
    slopes = ca.Function("slopes", [x], [ca.jacobian(ca.vertcat(*terms), x)])
    assert np.all(np.isfinite(np.asarray(slopes(value))))


@given(st.one_of(st.just(0.0), st.floats(1e-9, 1e6)))
def test_decay_means_are_the_integrals_of_an_exponential(decay: float) -> None:
    """They are the means over the unit step of exp(-decay s) and of (1 - exp(-decay s)) / decay."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    edges = np.concatenate(([0.0], np.geomspace(1e-7, 1.0, 30)))
    s = 0.5 * (edges[:-1, None] + edges[1:, None] + np.diff(edges)[:, None] * nodes)
    weight = 0.5 * np.diff(edges)[:, None] * weights
    first, second = decay_means(decay)
    added = s if decay == 0.0 else -np.expm1(-decay * s) / decay
    truncation = 1e-9
    assert float(first) == pytest.approx(float(np.sum(weight * np.exp(-decay * s))), rel=truncation)
    assert float(second) == pytest.approx(float(np.sum(weight * added)), rel=truncation)


def test_decay_means_have_finite_derivatives_at_rest() -> None:
    """A bristle at standstill forgets nothing, and the derivative by its rate is finite there."""
    decay = ca.SX.sym("decay")
    slope = ca.Function("slope", [decay], [ca.jacobian(ca.vertcat(*decay_means(decay)), decay)])
    assert np.asarray(slope(0.0)).ravel() == pytest.approx([-0.5, -1.0 / 6.0], rel=1e-12)
