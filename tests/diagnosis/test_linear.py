"""The linearised program against the solver's own normal equations and against a simulation."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import VISCOUS, axis, write_case

from friction_ocp.diagnosis import linear
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.blocks import blocks_of, score
from friction_ocp.diagnosis.excess import excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import held_out, told
from friction_ocp.diagnosis.linear import _banded_factors, linear_program
from friction_ocp.diagnosis.own_noise import gap_prices, with_own_noise
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.segments import Segments
from friction_ocp.execution.effort import effort
from friction_ocp.problem_file.load import load_problem


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> FittedModel:
    """Return the base model of a drive that lacks nothing, fitted."""
    return fit_base(prepare(load_problem(write_case(tmp_path_factory.mktemp("axis"), axis()))))


def test_rows_give_the_normal_equations_of_the_solver(fitted: FittedModel) -> None:
    """J'J and J'r of the rows are Hessian and gradient with the nodes eliminated."""
    linear = fitted.linear
    reduced = reduce_system(linear.program.linearise(linear.point), 0.0)
    rows = linear.rows
    scale = np.sqrt(np.diag(reduced.hessian))
    assert np.allclose(
        rows.jacobian.T @ rows.jacobian / np.outer(scale, scale), reduced.hessian / np.outer(scale, scale), atol=1e-6
    )
    gradient = rows.jacobian.T @ rows.residual
    assert np.allclose(gradient / scale, reduced.gradient / scale, atol=1e-4 * np.sqrt(fitted.objective))


def test_what_was_not_kept_is_laid_again(fitted: FittedModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is room for one linearised program alone, the other comes out the same when it is asked for."""
    first = linear_program(fitted.linear.program, fitted.linear.point)
    rows, moved = first.rows, first.recordings[0].moved_by(np.ones(fitted.theta.size))
    monkeypatch.setattr(linear, "MOST_KEPT", 0)
    other = linear_program(fitted.linear.program, fitted.linear.point)
    before = effort()
    assert first.rows is not rows and first.rows.jacobian.tobytes() == rows.jacobian.tobytes()
    assert first.recordings[0].moved_by(np.ones(fitted.theta.size)).tobytes() == moved.tobytes()
    assert effort() == before
    assert other.rows.residual.tobytes() == rows.residual.tobytes()


def test_innovations_of_a_right_model_are_noise(fitted: FittedModel) -> None:
    """Twice the objective is no more than the number of samples: floors and process noise are not too small."""
    samples = int(np.sum(fitted.linear.rows.channel >= 0))
    assert fitted.objective < 0.5 * samples * 1.1


def test_held_out_costs_exceed_those_of_the_fit(fitted: FittedModel) -> None:
    """A recording that took no part in a fit costs a little more than one that did, and of the same order."""
    costs = float(np.sum(held_out(fitted)))
    assert fitted.cost <= costs * (1.0 + 1e-6) < 1.2 * fitted.cost


def test_a_heavier_rotor_is_moved_less_by_the_same_torque_noise(fitted: FittedModel) -> None:
    """Gaps of twice the inertia are narrower, by 2 at most where torque noise enters, and that is credited."""
    program, names = fitted.linear.program, fitted.model.space.names
    theta = np.array([fitted.footing.numbers["a"][name] for name in names])
    same, nothing = with_own_noise(program, fitted.model, fitted.footing, theta)
    heavy, prices = with_own_noise(
        program, fitted.model, fitted.footing, theta * np.where(np.array(names) == "motor.inertia", 2.0, 1.0)
    )
    for before, one, two in zip(program.segments, same.segments, heavy.segments, strict=True):
        assert before.gap_weight is not None and one.gap_weight is not None and two.gap_weight is not None
        assert np.allclose(one.gap_weight, before.gap_weight, rtol=1e-9)
        widths = [np.sqrt(np.linalg.inv(w.swapaxes(1, 2) @ w)[:, 1, 1]) for w in (before.gap_weight, two.gap_weight)]
        ratio = widths[0] / widths[1]
        assert np.all((ratio > 1.2) & (ratio <= 2.0))
    assert all(np.allclose(price, 0.0, atol=1e-9) for price in nothing)
    assert all(np.all((-2.0 * np.log(2.0) <= price) & (price < -np.log(1.2))) for price in prices)


def test_gaps_cost_as_much_as_the_recording_tells_of_its_nodes(fitted: FittedModel) -> None:
    """Wider gaps cost nothing where no sample tells of a node, all of it where samples tell all, and else between.

    So it is in the likelihood with the nodes integrated out; its determinant is that of a dense matrix.
    """
    program, model = fitted.linear.program, fitted.model
    lighter = fitted.theta * np.where(np.array(model.space.names) == "motor.inertia", 0.5, 1.0)
    own, prices = with_own_noise(program, model, fitted.footing, lighter)
    item, cut, wider = fitted.linear.recordings[0], own.segments[0], prices[0]
    whole = float(np.sum(wider))
    assert whole > 0.0
    found = dict[float, float]()
    for share in (1e-4, 1.0, 1e6):
        seen = copy(item)
        seen.dy = share * item.dy
        seen._factor()
        found[share] = float(np.sum(gap_prices(seen, cut, wider)))
        for segments in (item.cut, cut):
            assert seen.nodes_told(segments) == pytest.approx(_dense_logdet(seen, segments), rel=1e-6)
    assert found[1e-4] < 0.02 * whole < found[1.0] < 0.98 * whole < found[1e6] <= whole


def _dense_logdet(item: linear.LinearRecording, cut: Segments) -> float:
    """Return the log-determinant of the nodes' information, from the rows of one column per node state."""
    own = copy(item)
    own.cut = cut
    unit = np.eye(cut.count * own.states).reshape(cut.count, own.states, -1)
    rows = own._applied(unit)
    return float(np.linalg.slogdet(rows.T @ rows)[1])


def test_recordings_are_held_out_of_fits_at_bounds(tmp_path: Path) -> None:
    """Where a bound keeps a parameter from its best value, the others answer for what is left out as they can.

    A step that is cut off at the bound without them would cost many times the fit.
    """
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["friction"]["viscous"] |= {"guess": 3.0 * VISCOUS, "min": 2.0 * VISCOUS}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    fitted = fit_base(prepare(load_problem(path)))
    assert fitted.values["motor.friction.viscous"] == pytest.approx(2.0 * VISCOUS)
    costs = float(np.sum(held_out(fitted)))
    assert fitted.objective <= costs * (1.0 + 1e-6) < 1.5 * fitted.objective


def test_a_parameter_pressed_against_a_bound_absorbs_nothing(tmp_path: Path) -> None:
    """Viscous friction on a second shaft, rigidly joined, shows what a bound on that of the first keeps from it."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    viscous = document["drive"]["shafts"][0]["friction"]["viscous"]
    slopes = list[float]()
    for lower in (0.0, 2.0 * VISCOUS):
        viscous |= {"guess": 3.0 * VISCOUS, "min": lower}
        path.write_text(yaml.safe_dump(document), encoding="utf-8")
        fitted = fit_base(prepare(load_problem(path)))
        rows = fitted.linear.rows
        column = rows.jacobian[:, [fitted.model.space.names.index("motor.friction.viscous")]]
        slopes.append(float(np.linalg.norm(rows.absorbed(column)) / np.linalg.norm(column)))
        assert rows.pressed.any() == (lower > 0)
    assert slopes[0] < 1e-6
    assert slopes[1] > 0.1


def test_a_gap_in_a_few_blocks_counts(fitted: FittedModel) -> None:
    """One block in which residuals are fifty times the noise is a gap, however unequal that makes the blocks."""
    rows = fitted.linear.rows
    blocks = blocks_of(rows)
    assert excess(rows, blocks).p_value > 0.05
    hit = np.where(blocks.of_row == 3, 50.0, 1.0) * rows.residual
    assert excess(replace(rows, residual=hit), blocks).p_value < 1e-6


def test_the_score_test_keeps_its_level(fitted: FittedModel) -> None:
    """Columns that have nothing to do with the residuals get p-values that are uniform, not small."""
    rows, blocks = fitted.linear.rows, blocks_of(fitted.linear.rows)
    rng = np.random.default_rng(0)
    smooth = np.cumsum(rng.standard_normal((rows.residual.size, 60)), axis=0)
    values = [score(rows, blocks, rows.absorbed(column[:, None])).p_value for column in smooth.T]
    assert np.mean(np.array(values) < 0.05) < 0.2
    assert np.median(values) > 0.2


def test_what_breaks_down_on_recordings_left_out_is_not_free() -> None:
    """Rows that broke down or ran away cost as much as the worst of the others, and no less than a large error."""
    costs = told(np.array([1.0, 3e7, np.nan, np.inf, 1e300]))
    assert list(costs) == [1.0, 3e7, 3e7, 3e7, 3e7]
    assert list(told(np.array([2.0, np.nan]))) == [2.0, 1e6] and list(told(np.array([2.0, 5.0]))) == [2.0, 5.0]


@pytest.mark.parametrize("odd", [np.nan, np.inf])
def test_where_the_simulation_breaks_down_nodes_are_no_numbers(odd: float) -> None:
    diagonal, upper = np.tile(np.eye(2), (4, 1, 1)), np.zeros((3, 2, 2))
    diagonal[1, 0, 1] = diagonal[1, 1, 0] = odd
    assert np.isnan(_banded_factors(diagonal, upper)).any()


def test_directions_that_nothing_holds_stay_where_they_are() -> None:
    """Two states that are one: the factors are those of the matrix but for what it takes to have some."""
    diagonal, upper = np.tile(np.ones((2, 2)), (3, 1, 1)), np.zeros((2, 2, 2))
    assert np.isfinite(_banded_factors(diagonal, upper)).all()
