"""Fits that begin elsewhere: from parameters changed a little, and from the guesses where a fit is astray."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.bench import Bench, Seat, bettered, open_bench
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.crew import Crew, held_out_costs
from friction_ocp.diagnosis.easing import FAR
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.refit import nudged_along, untold_ways
from friction_ocp.diagnosis.rival import Rival
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import with_drive
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point
from friction_ocp.execution.executor import InProcess
from friction_ocp.execution.plain import restored
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

HERE = Execution(InProcess())
UNBALANCE = 0.03
"""N m."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Return the bench of a model that lacks nothing."""
    return open_bench(load_problem(write_case(tmp_path_factory.mktemp("better"), axis())), HERE)


def moved(bench: Bench, factor: float) -> Bench:
    """Return the bench at parameters that no fit has led to."""
    fitted = bench.current
    program = fitted.linear.program
    point = solve_nodes(program, Point(factor * fitted.theta, fitted.linear.point.nodes))
    return bench.at(FittedModel(fitted.model, fitted.footing, linear_program(program, point)))


@pytest.mark.slow
def test_a_fit_that_is_not_the_best_is_bettered(bench: Bench) -> None:
    """From beside the optimum it is found; the optimum itself stays as it is."""
    beside = moved(bench, 1.01)
    assert beside.current.objective > bench.current.objective + 10.0 * UNIMPORTANT
    assert bettered(beside, HERE).current.objective == pytest.approx(bench.current.objective, abs=UNIMPORTANT)
    assert bettered(bench, HERE) is bench


def test_parameters_change_together_where_recordings_tell_little(bench: Bench) -> None:
    """The first way costs least and every other one more, both directions of each are tried; it leads to the optimum.

    A parameter pressed against its bound stays there.
    """
    fitted = bench.current
    ways = untold_ways(fitted)
    assert ways.shape == 2 * (fitted.theta.size,)
    assert np.max(np.abs(ways), axis=1) == pytest.approx(1.0)
    units = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    told = np.linalg.norm(fitted.linear.rows.jacobian @ (units * fitted.theta).T, axis=0)
    assert np.all(np.diff(told) > 0.0) and told[-1] > 10.0 * told[0]

    beside = moved(bench, 1.01).current
    for turn in range(2):
        assert nudged_along(beside, turn).objective == pytest.approx(fitted.objective, abs=UNIMPORTANT)

    theta = np.where(np.arange(fitted.theta.size) == 0, fitted.model.space.lower, fitted.theta)
    point = solve_nodes(fitted.linear.program, Point(theta, fitted.linear.point.nodes))
    pressed = replace(fitted, linear=linear_program(fitted.linear.program, point))
    pressed.linear.rows.pressed[0] = True
    assert untold_ways(pressed).shape == (theta.size - 1, theta.size) and not np.any(untold_ways(pressed)[:, 0])


def test_a_fit_that_is_astray_is_left_to_the_guesses(bench: Bench) -> None:
    """Where much is missed no better end is looked for; candidates begin at the guesses, with additions as they are."""
    far = moved(bench, 2.0)
    assert far.current.missed > FAR and far.current.astray and not bench.current.astray
    assert bettered(far, HERE) is far

    added = effects()["unbalance"].addition(bench.problem.drive, "motor", clues_of(bench.current)).drive
    model = with_drive(bench.base.model, added)
    known = {"motor.gravity.torque": 0.012, "motor.gravity.phase": 0.4}
    theta = model.space.with_known({name: 1.3 * value for name, value in bench.current.values.items()} | known)
    program = bench.base.footing.training(model)
    at = suggested_point(program, theta)
    seat = Seat.of(FittedModel(model, bench.base.footing, linear_program(program, at)))
    begun = replace(bench, seat=Seat(added, seat.point)).unfitted
    assert begun is not None
    space = bench.base.model.space
    assert begun.values == pytest.approx(dict(zip(space.names, space.guess, strict=True)) | known)


def test_a_refit_that_came_to_rest_on_the_way_begins_at_other_sizes(tmp_path: Path) -> None:
    """The better end counts; an end that is the best one stays."""
    plant = axis()
    plant = replace(plant, shafts=(replace(plant.shafts[0], gravity=(UNBALANCE, 0.4)),))
    bench = open_bench(load_problem(write_case(tmp_path, plant)), HERE)
    crew = Crew(bench, HERE, 1, lambda what, share: None)
    item = crew.screened([("unbalance", "motor")])[0]
    model = with_drive(bench.current.model, item.augmentation.drive)
    theta = model.space.with_known(bench.current.values | item.starts[0].added(item.augmentation.off, 0.2))
    program = bench.current.footing.training(model)
    at = solve_nodes(program, suggested_point(program, theta))
    resting = FittedModel(model, bench.current.footing, linear_program(program, at))
    without = restored(held_out_costs(bench))
    known = Rival.of(item, resting, np.zeros(bench.current.blocks.count))
    (better,) = crew.retried([known], without, {item.key: 0.0})
    assert better.standing.values["motor.gravity.torque"] == pytest.approx(UNBALANCE, rel=0.02)
    assert better.standing.cost < known.standing.cost - 10.0 * UNIMPORTANT and np.sum(better.gains) > 0.0
    assert crew.retried([better], without, {item.key: 0.0})[0].standing.cost <= better.standing.cost
