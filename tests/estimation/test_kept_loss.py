"""The absolute loss kept as it is: steps against linear programming, slopes against differences, ends against GN."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from friction_ocp.estimation.composite import Rows, best_step, linearised, solve_composite, tried
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.kept_loss import fit_kept
from friction_ocp.estimation.model import Model, prepare_fit
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases, silent
from friction_ocp.estimation.rounds import windowed
from friction_ocp.estimation.stages import free_run, mean_error
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.losses import Absolute

PROBLEM = Path(__file__).parents[2] / "problems" / "xl330" / "coulomb_viscous.yaml"


@pytest.fixture(scope="module")
def model() -> Model:
    return prepare_fit(load_problem(PROBLEM))


@pytest.fixture
def program(model: Model) -> Program:
    return free_run(model, model.train, 0.02 * model.speed_scale, Absolute(0.3), None)


def start(program: Program) -> Point:
    return suggested_point(program, program.space.guess)


@pytest.mark.parametrize("bound", [np.inf, 0.4])
def test_a_step_is_the_least_absolute_deviation(model: Model, bound: float) -> None:
    """Without damping the step solves the linear program of least absolute deviations, within bounds or not."""
    rng = np.random.default_rng(3)
    slope = rng.standard_normal((400, 3))
    errors = slope @ np.array([1.0, -0.5, 0.2]) + rng.laplace(size=400)
    nothing = np.zeros(3)
    rows = Rows(errors, slope, 0.0, np.zeros((3, 3)), nothing)
    space: ParameterSpace = replace(model.space, lower=np.full(3, -bound), upper=np.full(3, bound), constraints=None)
    step, cost = best_step(space, nothing, rows, Absolute(1e-6), nothing)
    above = np.concatenate([np.zeros(3), np.ones(800)])
    exact = linprog(
        above,
        A_eq=np.hstack([slope, np.eye(400), -np.eye(400)]),
        b_eq=-errors,
        bounds=[(-bound, bound)] * 3 + [(0, None)] * 800,
    )
    assert cost == pytest.approx(exact.fun, rel=1e-4)
    assert step == pytest.approx(exact.x[:3], abs=5e-3)


def test_slopes_are_those_of_the_residuals(program: Program) -> None:
    """Central differences of the residuals by every parameter."""
    at = start(program)
    trial = tried(program, at)
    rows = linearised(program, trial)
    for k, size in enumerate(1e-6 * np.maximum(np.abs(at.theta), 1e-2)):
        step = size * np.eye(at.theta.size)[k]
        ahead, behind = (tried(program, Point(at.theta + sign * step, at.nodes)).errors for sign in (1, -1))
        slope = (ahead - behind) / (2 * size)
        assert np.median(np.abs(rows.slope[:, k] - slope)) < 1e-4 * np.max(np.abs(slope))
    assert trial.objective == pytest.approx(program.objective(at))


def test_a_trial_saves_a_simulation_and_changes_nothing(program: Program) -> None:
    """Derivatives after a trial are bit for bit those of a simulation that knows nothing of it."""
    at = start(program)
    known = program.differentiate(at, program.simulate_trial(at))
    for (result, _), alone in zip(known, program.simulate_all(at, derivatives=True), strict=True):
        assert np.array_equal(result.y, alone.y)
        assert result.dy is not None and alone.dy is not None
        assert np.array_equal(result.dy, alone.dy)


def test_fits_from_other_guesses_are_the_same_to_the_last_digit(model: Model) -> None:
    """A start three times as far: the way of a kept loss begins at the same point of a grid."""
    other = replace(model, space=model.space.moved(model.space.clip(3.0 * model.space.guess)))
    ends = [fit_kept(item, windowed(None), Phases(silent, 4)).solution for item in (model, other)]
    assert np.array_equal(ends[0].point.theta, ends[1].point.theta)
    assert ends[0].objective == ends[1].objective


def test_it_ends_no_higher_than_reweighting_and_in_fewer_steps(program: Program) -> None:
    """A sharp loss of the free run of a real servo; both start where nearly squares end."""
    before = solve_gauss_newton(program, start(program)).point
    sharp = replace(program, loss=Absolute(0.002 * mean_error(program, before)))
    ours = solve_composite(sharp, before)
    theirs = solve_gauss_newton(sharp, before, Tolerances(max_iterations=100))
    assert ours.converged
    assert ours.objective <= theirs.objective * (1.0 + 1e-6)
    assert ours.iterations < 0.7 * theirs.iterations
