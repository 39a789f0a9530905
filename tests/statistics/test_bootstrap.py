"""Bootstrap: its scatter is that of the estimate, whatever the residuals are like."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from runs import HERE, coloured_problem, right_problem

from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.problem import StaticUse
from friction_ocp.estimation.uncertainty import uncertainty
from friction_ocp.recording.static_points import StaticPoints
from friction_ocp.result_folder import save
from friction_ocp.statistics.answer import answer
from friction_ocp.statistics.bootstrap import (
    bootstrap,
    one_steps,
    refit,
    resampled,
    resampled_score,
    residual_blocks,
    signs,
)

DRAWS = 80
SCATTER = 0.3
"""Relative: three standard deviations of a standard error from 80 draws."""

CURVED = 0.25
"""Of a standard error: what a step leaves out in a model that is nearly linear."""


def test_white_residuals_give_the_standard_errors_of_the_fit() -> None:
    """Refitted draws of a right model scatter by its standard errors, about the estimate."""
    found = bootstrap(right_problem(), DRAWS, HERE)
    assert found.method == "refit"
    assert found.draws.shape == (DRAWS, 3)
    assert found.std_error == pytest.approx(found.estimate.uncertainty.std_error, rel=SCATTER)
    values = np.array([item.value for item in found.estimate.parameters])
    assert np.all(np.abs(found.draws.mean(axis=0) - values) < 4.0 * found.std_error / np.sqrt(DRAWS))
    assert np.all(np.diff(found.percentiles, axis=1) > 0)


@pytest.mark.slow
def test_blocks_are_longer_where_residuals_wander() -> None:
    """And the draws scatter as the sandwich says, not as white noise would: one of few long blocks is hardly known."""
    found = bootstrap(coloured_problem(8), DRAWS, HERE)
    white = answer(right_problem(), HERE)
    assert all(item.length_s > 0.02 for item in found.blocks)
    assert all(item.length_s < 0.01 for item in residual_blocks(white.workshop))
    assert found.std_error == pytest.approx(found.estimate.uncertainty.std_error, rel=0.5)


def test_static_points_alone_are_drawn_like_recordings(tmp_path: Path) -> None:
    """Each has a sign of its own: draws scatter by the standard errors of a right model, and the page says so."""
    rng, error = np.random.default_rng(5), 2e-3
    speed = np.concatenate([side * np.geomspace(0.05, 20.0, 40) for side in (1.0, -1.0)])
    torque = np.sign(speed) * 0.07 + 2.2e-3 * speed + error * rng.standard_normal(speed.size)
    units = {"speed": "rad/s", "torque": "N m", "std_error": "N m"}
    points = StaticPoints("points", speed, units, torque=torque, std_error=np.full(speed.size, error))
    problem = replace(right_problem(), train=(), validation=(), static=(StaticUse(points),))
    shaft = replace(problem.drive.shafts[0], inertia=0.003)
    found = bootstrap(replace(problem, drive=replace(problem.drive, shafts=(shaft,))), DRAWS, HERE)
    assert found.blocks == ()
    assert found.std_error == pytest.approx(found.estimate.uncertainty.std_error, rel=SCATTER)
    save(found, tmp_path)
    assert "The error of every static point gets a random sign" in (tmp_path / "report.html").read_text("utf-8")


def test_static_points_beside_a_recording_take_part_in_every_draw() -> None:
    """In refits and in steps: else what they alone tell would not scatter."""
    problem = right_problem()
    speed = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
    units = {"speed": "rad/s", "torque": "N m", "std_error": "N m"}
    torque = 0.07 + 2.2e-3 * speed + 1e-3 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    points = StaticPoints("points", speed, units, torque=torque, std_error=np.full(speed.size, 1e-3))
    found = answer(replace(problem, static=(StaticUse(points),)), HERE)
    program, best = found.workshop.fitted.program, found.workshop.fitted.solution.point
    lengths = tuple(item.length_s for item in residual_blocks(found.workshop))
    drawn = resampled(program, best, lengths, np.random.default_rng(1)).static[0]
    (term,) = program.static
    errors = term.predict(program.space, best.theta) - term.measured
    flipped = term.predict(program.space, best.theta) - drawn.measured
    assert np.abs(flipped) == pytest.approx(np.abs(errors))
    assert set(np.sign(flipped * errors)) == {-1.0, 1.0}
    seen = influence(program, best)
    alone = replace(seen, score_weight=np.where(seen.recording < len(lengths), 0.0, seen.score_weight))
    pulls = np.array([resampled_score(alone, lengths, np.random.default_rng(k)) for k in range(400)])
    own = seen.recording >= len(lengths)
    expected = np.sqrt(np.sum((seen.jacobian[own] * seen.score_weight[own, None]) ** 2, axis=0))
    assert pulls.std(axis=0) == pytest.approx(expected, rel=0.15)


def test_one_steps_agree_with_refits() -> None:
    """The same signs move a nearly linear model by the same step, within a fraction of a standard error."""
    found = answer(right_problem(), HERE)
    lengths = tuple(item.length_s for item in residual_blocks(found.workshop))
    steps = np.array(one_steps(found, lengths, 10))
    refits = np.array([refit(found.workshop, number, lengths)["theta"] for number in range(10)])
    assert np.all(np.abs(steps - refits) < CURVED * found.estimate.uncertainty.std_error)
    assert np.all(np.abs(refits - refits.mean(axis=0)).max(axis=0) > found.estimate.uncertainty.std_error)


def test_relaxed_segments_take_one_step() -> None:
    """Their gaps are noise as well, which a refit of the measurement would not draw."""
    problem = right_problem()
    relaxed = replace(problem, estimation=replace(problem.estimation, fit="relaxed", process_noise={"motor": 1e-4}))
    found = bootstrap(relaxed, DRAWS, HERE)
    assert (found.method, found.failed) == ("one_step", 0)
    fitted = answer(relaxed, HERE).workshop.fitted
    seen = influence(fitted.program, fitted.solution.point)
    sandwich = uncertainty(fitted.program.space, fitted.solution.point.theta, seen, sure=False, loss="squares")
    assert found.std_error == pytest.approx(sandwich.std_error, rel=0.5)


def test_draws_repeat_and_resume(tmp_path: Path) -> None:
    """The seed decides the draws; more of them keep those that were there."""
    first = bootstrap(right_problem(seed=3), 20, replace(HERE, folder=tmp_path))
    before = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "tasks").iterdir()}
    more = bootstrap(right_problem(seed=3), 24, replace(HERE, folder=tmp_path))
    assert more.draws[:20] == pytest.approx(first.draws, abs=0.0)
    after = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "tasks").iterdir()}
    assert len(after) == len(before) + 4
    assert before.items() <= after.items()


def test_signs_change_between_blocks_only() -> None:
    """About half of the blocks change sign, at multiples of the length from a random phase."""
    time = np.arange(5000) * 1e-3
    drawn = signs(time, 0.05, np.random.default_rng(1))
    changes = np.flatnonzero(np.diff(drawn))
    assert set(np.unique(drawn)) == {-1.0, 1.0}
    assert 30 < changes.size < 70
    assert np.all(np.diff(changes) % 50 <= 1) or np.all((np.diff(changes) + 1) % 50 <= 2)


def test_too_few_draws_are_refused() -> None:
    """Percentiles of a handful mean nothing."""
    with pytest.raises(FrictionOcpError, match="3 draws are too few; at least 20"):
        bootstrap(right_problem(), 3, HERE)
