"""The small quadratic program of a step, against its optimality conditions and against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, nnls

from friction_ocp.estimation.quadratic import bounded_step

SOLVER = 1e-7
"""Of scipy's solvers, relative to the gradient."""


def random_problem(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return a Jacobian with badly scaled columns, residuals and bounds around zero."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-2, 2, count)
    jacobian = rng.standard_normal((count + 5, count)) * scale
    bounds = rng.uniform(0.0, 2.0, (2, count)) / scale
    bounds[:, rng.random(count) < 0.3] = np.inf
    return jacobian, rng.standard_normal(count + 5), -bounds[0], bounds[1]


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 10**6), st.integers(1, 8))
def test_bounds_agree_with_scipy(seed: int, count: int) -> None:
    """With bounds alone the step has the cost of scipy's bounded least squares."""
    jacobian, residual, lower, upper = random_problem(seed, count)
    step = bounded_step(jacobian.T @ jacobian, jacobian.T @ residual, lower, upper, np.zeros((0, count)), np.zeros(0))
    reference = lsq_linear(jacobian, -residual, (lower, upper), method="bvls", tol=1e-14).x
    slack = 1e-9 * np.maximum(1.0, np.abs(step))
    assert np.all(step >= lower - slack) and np.all(step <= upper + slack)
    costs = [np.sum((jacobian @ x + residual) ** 2) for x in (step, reference)]
    assert costs[0] <= costs[1] * (1 + SOLVER) + 1e-12


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 10**6), st.integers(1, 8))
def test_a_step_to_a_bound_ends_on_it(seed: int, count: int) -> None:
    """To the last digit, not a rounding error beside it."""
    jacobian, residual, lower, upper = random_problem(seed, count)
    step = bounded_step(jacobian.T @ jacobian, jacobian.T @ residual, lower, upper, np.zeros((0, count)), np.zeros(0))
    for bound, away in ((lower, step - lower), (upper, upper - step)):
        way = np.where(np.isfinite(upper - lower), upper - lower, np.abs(bound))
        near = np.isfinite(bound) & (away < 1e-12 * way)
        assert np.all(step[near] == bound[near])


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 10**6), st.integers(2, 7), st.integers(1, 4))
def test_optimality_conditions_hold(seed: int, count: int, constraints: int) -> None:
    """The step is feasible, and its gradient is a positive combination of the normals of active constraints."""
    jacobian, residual, lower, upper = random_problem(seed, count)
    rng = np.random.default_rng(seed + 1)
    rows = rng.standard_normal((constraints, count)) * np.linalg.norm(jacobian, axis=0)
    inside = np.clip(rng.standard_normal(count), 0.9 * np.maximum(lower, -1e3), 0.9 * np.minimum(upper, 1e3))
    margins = rng.uniform(0.0, 1.0, constraints) - rows @ inside
    hessian, gradient = jacobian.T @ jacobian, jacobian.T @ residual
    step = bounded_step(hessian, gradient, lower, upper, rows, margins)
    size = 1.0 / np.sqrt(np.diag(hessian))
    normals = np.concatenate([np.diag(1.0 / size), -np.diag(1.0 / size), rows])
    slack = np.concatenate([(step - lower) / size, (upper - step) / size, margins + rows @ step])
    assert np.all(slack > -1e-7 * (1.0 + np.abs(margins).max()))
    active = normals[slack < 1e-6] * size
    slope = (hessian @ step + gradient) * size
    unexplained = nnls(active.T, slope)[1] if len(active) else np.linalg.norm(slope)
    assert unexplained < 1e-6 * (1.0 + np.linalg.norm(gradient * size))


def test_without_constraints_it_is_newton() -> None:
    """A free step solves H d = -g even for a nearly singular, badly scaled Hessian."""
    jacobian = np.array([[1e6, 1.0], [1e6, 1.0 + 1e-3]])
    residual = np.array([1.0, 2.0])
    hessian, gradient = jacobian.T @ jacobian, jacobian.T @ residual
    free = np.full(2, np.inf)
    step = bounded_step(hessian, gradient, -free, free, np.zeros((0, 2)), np.zeros(0))
    assert step == pytest.approx(-np.linalg.solve(jacobian, residual), rel=1e-3)
