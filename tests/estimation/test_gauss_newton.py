"""Gauss-Newton on programs with known answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest
from smooth_programs import ToySpace, offset_rosenbrock, rosenbrock, toy

from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.program import Blocks, Linearisation, Point

TIGHT = Tolerances(decrease=1e-12, negligible=0.0)


def test_finds_the_end_of_a_bent_valley() -> None:
    """Rosenbrock's valley is followed to its end."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    solution = solve_gauss_newton(program, program.start, TIGHT)
    assert solution.converged
    assert solution.point.theta == pytest.approx([1.0, 1.0], abs=1e-5)


def test_stops_at_a_bound() -> None:
    """With theta <= 0.5 the minimum lies on the bound, where theta1 = theta0^2."""
    program: Any = toy(offset_rosenbrock, (-1.2, 1.0), -2.0, 0.5)
    solution = solve_gauss_newton(program, program.start, TIGHT)
    assert solution.converged
    assert solution.point.theta == pytest.approx([0.5, 0.25], abs=1e-5)


def test_starts_inside_the_bounds() -> None:
    """A start outside is moved to the nearest bound first."""
    program: Any = toy(rosenbrock, (5.0, 5.0), -2.0, 2.0)
    seen: list[np.ndarray] = []
    solve_gauss_newton(program, program.start, watch=lambda k, f, point: seen.append(point.theta))
    assert all(np.all(np.abs(theta) <= 2.0) for theta in seen)


def test_keeps_a_constraint() -> None:
    """On theta0 + theta1 <= 1 the answer solves theta0 + theta0^2 = 1 up to the pull of the first residual."""
    program: Any = toy(rosenbrock, (-1.2, 1.0), constraint=lambda theta: 1 - theta[0] - theta[1])
    solution = solve_gauss_newton(program, program.start, TIGHT)
    assert solution.converged
    assert np.sum(solution.point.theta) == pytest.approx(1.0, abs=1e-8)
    assert solution.point.theta[0] == pytest.approx(0.618, abs=2e-3)


def test_objective_never_rises() -> None:
    """Every accepted step decreases the objective."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    objectives: list[float] = []
    solve_gauss_newton(program, program.start, watch=lambda k, f, point: objectives.append(f))
    assert np.all(np.diff(objectives) < 0)


def test_iteration_limit_is_not_convergence() -> None:
    """A solver that was cut short says so."""
    program: Any = toy(rosenbrock, (-1.2, 1.0))
    solution = solve_gauss_newton(program, program.start, Tolerances(max_iterations=2))
    assert not solution.converged
    assert "iteration limit" in solution.message


def test_breakdown_at_the_start_is_reported() -> None:
    """Where the first evaluation is not finite there is no answer."""
    program: Any = toy(lambda theta: ca.log(theta), (-1.0,))
    solution = solve_gauss_newton(program, program.start)
    assert not solution.converged
    assert "breaks down" in solution.message


def test_a_parameter_that_loses_its_influence_is_no_answer() -> None:
    """1 + exp(-theta0) has no minimum: the iterates run until nothing depends on theta0, and that is said."""
    program: Any = toy(lambda theta: ca.vertcat(1 + ca.exp(-theta[0]), theta[1] - 2), (0.0, 1.0))
    solution = solve_gauss_newton(program, program.start, TIGHT)
    assert not solution.converged
    assert "nothing depends on theta0 any more" in solution.message


def test_a_parameter_that_never_had_influence_does_not_spoil_the_others() -> None:
    """What nothing depends on from the start keeps its guess."""
    program: Any = toy(lambda theta: theta[1] - 2 + 0 * theta[0], (5.0, 1.0))
    solution = solve_gauss_newton(program, program.start, TIGHT)
    assert solution.converged
    assert solution.point.theta == pytest.approx([5.0, 2.0])


def test_residuals_of_rounding_errors_are_an_answer() -> None:
    """Where nothing but rounding is left no step decreases the objective, whatever the model predicts."""
    x = np.linspace(0.0, 2.0, 30)
    exact = 0.3 * np.exp(-x) + 0.7 * np.exp(-2.5 * x)
    program: Any = toy(
        lambda b: b[0] * ca.exp(-b[1] * x) + b[2] * ca.exp(-b[3] * x) - ca.DM(exact), (0.4, 0.8, 0.8, 3.0)
    )
    solution = solve_gauss_newton(program, program.start, Tolerances(decrease=0.0, negligible=0.0, progress=0.0))
    assert solution.converged
    assert solution.point.theta == pytest.approx([0.3, 1.0, 0.7, 2.5], rel=1e-8)


@dataclass(frozen=True)
class Kinked:
    """Two parameters seen in their difference, one of them pulled far, beside a node that rests at a kink."""

    space: ToySpace
    segments: tuple[()] = ()

    def objective(self, point: Point) -> float:
        """Return the cost of a point."""
        return self.linearise(point).objective

    def linearise(self, point: Point) -> Linearisation:
        """Return objective, gradient and Gauss-Newton Hessian; the slope at the kink is that of its right side."""
        node, (first, second) = float(point.nodes[0][0, 0]), point.theta
        residuals = np.array([1e3 * (first - second), 0.1 * (first - 10.0)])
        by_theta = np.array([[1e3, -1e3], [0.1, 0.0]])
        kink, slope = 30.0 * (1.0 + abs(node)), 30.0 if node >= 0.0 else -30.0
        blocks = Blocks(
            node_node=np.full((1, 1, 1), slope**2),
            node_gradient=np.full((1, 1), slope * kink),
            node_theta=np.zeros((1, 1, 2)),
            node_next=np.zeros((0, 1, 1)),
        )
        cost = 0.5 * float(residuals @ residuals) + 0.5 * kink**2
        return Linearisation(cost, by_theta.T @ by_theta, by_theta.T @ residuals, (blocks,))


def test_a_node_at_a_kink_does_not_hold_parameters_that_are_traded_for_one_another() -> None:
    """Every damped step of the node alone is uphill by more than parameters gain that damping lets creep."""
    program: Any = Kinked(ToySpace(np.zeros(2), np.full(2, -100.0), np.full(2, 100.0)))
    solution = solve_gauss_newton(program, Point(np.zeros(2), (np.zeros((1, 1)),)))
    assert solution.point.theta == pytest.approx([10.0, 10.0], abs=0.3)  # what USUAL leaves
    assert solution.objective == pytest.approx(450.0, rel=1e-6)
