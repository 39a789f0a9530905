"""The statistics go on from where identify ends: with its integrator steps and its torque noise."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from runs import HERE, right_problem
from stiff_axis import stiff_problem
from test_clocks import clocked, foreign

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.model import prepare_fit
from friction_ocp.estimation.problem import Problem
from friction_ocp.statistics.answer import answer
from friction_ocp.statistics.multistart import multistart
from friction_ocp.statistics.optimum import Optimum


@pytest.fixture(scope="module")
def fine() -> Problem:
    """A stiff bristle seen by a fine encoder."""
    return stiff_problem(1e-4)


def test_statistics_take_the_steps_of_identify(fine: Problem) -> None:
    """Answer and estimate agree, and both were found with steps shorter than the first."""
    first, expected, found = prepare_fit(fine).max_step, identify(fine), answer(fine, HERE)
    assert expected.simulation.max_step < first
    assert found.workshop.model.max_step == expected.simulation.max_step
    assert found.estimate.simulation.max_step == expected.simulation.max_step
    moved = [found.estimate.values[item.name] - item.value for item in expected.parameters]
    assert np.all(np.abs(moved) <= [0.1 * item.std_error for item in expected.parameters])


def test_starts_are_compared_with_the_same_steps(fine: Problem) -> None:
    """All ends of a multi-start have the integrator steps of the best."""
    found = multistart(fine, 3, HERE)
    steps = {end.optimum.max_step for end in found.ends if end.optimum is not None}
    assert steps == {found.estimate.simulation.max_step}


def test_torque_noise_goes_with_the_optimum() -> None:
    """The optimum remembers the level that identify found, through a file, and weights its gaps with it."""
    problem = right_problem(estimated_noise=("motor",))
    problem = replace(problem, estimation=replace(problem.estimation, fit="relaxed"))
    model, fitted = settled(prepare_fit(problem))
    kept = Optimum.read(json.loads(json.dumps(Optimum.of(model, fitted).document(), allow_nan=False)))
    again = kept.settled(prepare_fit(problem))
    assert again.process_noise == pytest.approx(dict(model.process_noise))
    program = kept.fitted(again).program
    assert program.objective(kept.solution.point) == pytest.approx(fitted.solution.objective)


def test_moved_stamps_go_with_the_optimum() -> None:
    """The optimum remembers where identify moved the stamps of a clock, through a file, and goes on from there."""
    problem = clocked(foreign(1, 0.008, 2e-3))
    model, fitted = settled(prepare_fit(problem))
    kept = Optimum.read(json.loads(json.dumps(Optimum.of(model, fitted).document(), allow_nan=False)))
    assert kept.moves["run1"]["logger"] != (0.0, 0.0)
    again = kept.settled(prepare_fit(problem))
    assert kept.fitted(again).program.objective(kept.solution.point) == pytest.approx(fitted.solution.objective)
