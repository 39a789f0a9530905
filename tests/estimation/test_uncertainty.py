"""Covariances against the closed forms of linear regression."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from regressions import autoregressive, regression, space

from friction_ocp.estimation.uncertainty import Uncertainty, uncertainty
from friction_ocp.simulation.losses import Huber

ROUNDING = 1e-9
SCATTER = 0.2
"""Relative error of the mean of a robust variance over the draws below."""


def design(rows: int) -> np.ndarray:
    """Return a regressor of slow, faster and no change."""
    t = np.linspace(0.0, 1.0, rows)
    return np.column_stack([np.sin(2 * np.pi * t), np.cos(10 * np.pi * t), np.ones(rows)])


def judged(
    x: np.ndarray,
    noise: np.ndarray,
    white: bool,
    prior_std: np.ndarray | float = np.inf,
    recordings: int = 1,
    window: np.ndarray | None = None,
) -> Uncertainty:
    """Return the uncertainty of a regression whose parameters are well inside their bounds."""
    found = regression(x, noise, prior_std=prior_std, recordings=recordings, window=window)
    return uncertainty(space(np.ones(x.shape[1]), -10, 10, prior_std), np.ones(x.shape[1]), found, white, "squares")


def test_white_residuals_give_the_covariance_of_regression() -> None:
    """It is (X'X)^-1 where residuals are in units of their noise, and intervals are normal."""
    x = design(300)
    found = judged(x, np.random.default_rng(1).standard_normal(300), white=True)
    assert found.kind == "gauss_newton"
    assert found.covariance == pytest.approx(np.linalg.inv(x.T @ x), rel=ROUNDING)
    reach = scipy.stats.norm.ppf(0.975) * found.std_error
    assert found.interval(np.ones(3)) == pytest.approx(np.column_stack([1 - reach, 1 + reach]), rel=1e-6)


def test_a_prior_adds_its_information() -> None:
    """The inverse covariances of data and prior add up."""
    x, stds = design(300), np.array([0.05, np.inf, 0.1])
    found = judged(x, np.zeros(300), white=True, prior_std=stds)
    assert found.covariance == pytest.approx(np.linalg.inv(x.T @ x + np.diag(stds**-2.0)), rel=ROUNDING)


def test_correlation_is_the_scaled_covariance() -> None:
    """Its diagonal is one, and two regressors that resemble each other have parameters that oppose each other."""
    x = design(300)
    x[:, 2] = x[:, 0] + 0.1 * x[:, 1]
    found = judged(x, np.zeros(300), white=True)
    assert np.diag(found.correlation) == pytest.approx(1.0)
    assert found.correlation[0, 2] == pytest.approx(-1.0, abs=0.01)


@pytest.mark.parametrize("recordings", [1, 4])
def test_the_sandwich_knows_correlated_noise(recordings: int) -> None:
    """Under autoregressive noise its mean over draws is the exact variance, which (X'X)^-1 is far from."""
    rows, phi, draws = 4000, 0.8, 60
    x, rng = design(rows), np.random.default_rng(2)
    parts = rows // recordings
    spread = [scipy.linalg.matmul_toeplitz(phi ** np.arange(parts), part) for part in np.split(x, recordings)]
    inverse = np.linalg.inv(x.T @ x)
    exact = np.diag(inverse @ x.T @ np.concatenate(spread) @ inverse)
    noises = [np.concatenate([autoregressive(phi, parts, rng) for _ in range(recordings)]) for _ in range(draws)]
    fits = [noise - x @ (inverse @ (x.T @ noise)) for noise in noises]
    mean = np.mean([np.diag(judged(x, fit, False, recordings=recordings).covariance) for fit in fits], axis=0)
    assert mean == pytest.approx(exact, rel=SCATTER)
    assert np.all(exact > 5.0 * np.diag(inverse))


def refitted(x: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much noise moves the estimate of a regression, and the residuals of that."""
    moved = np.linalg.solve(x.T @ x, x.T @ noise)
    return moved, noise - x @ moved


def test_errors_that_last_a_whole_free_run_are_counted_by_free_runs() -> None:
    """Each of 40 windows is off by a constant of its own; blocks that straddle windows would see half of it."""
    rows, count, draws = 4000, 40, 80
    window, rng = np.repeat(np.arange(count), rows // count), np.random.default_rng(5)
    x = np.random.default_rng(6).standard_normal((count, 3))[window] + 0.1 * design(rows)
    inverse = np.linalg.inv(x.T @ x)
    shares = np.array([inverse @ x[window == k].sum(axis=0) for k in range(count)])
    noises = [rng.standard_normal(count)[window] + 0.01 * rng.standard_normal(rows) for _ in range(draws)]
    found = [judged(x, refitted(x, noise)[1], False, window=window) for noise in noises]
    assert all(item.freedom <= count - 1 for item in found)
    mean = np.mean([np.diag(item.covariance) for item in found], axis=0)
    assert mean == pytest.approx(np.sum(shares**2, axis=0), rel=SCATTER)


def test_few_independent_stretches_make_wide_intervals() -> None:
    """Errors that wander for a quarter of the recording: the t distribution of few blocks keeps the coverage."""
    rows, draws, rng = 2000, 200, np.random.default_rng(8)
    x, hits = design(rows)[:, :2], []
    for _ in range(draws):
        moved, noise = refitted(x, autoregressive(0.995, rows, rng))
        found = judged(x, noise, white=False)
        low, high = found.interval(moved).T
        hits.append((low <= 0.0) & (high >= 0.0))
    assert np.mean(hits) > 0.85


def test_a_few_points_that_do_not_tell_of_one_another_stand_each_for_itself() -> None:
    """Twenty points of a polyline, a few behind its break: intervals cover, and are no wider than it takes."""
    speed = np.linspace(0.0, 2.0, 20)
    x = np.column_stack([np.ones(20), speed, np.maximum(speed - 1.2, 0.0)])
    variances, hits = [], []
    for seed in range(200):
        moved, noise = refitted(x, np.random.default_rng(seed).standard_normal(20))
        found = judged(x, noise, white=False)
        low, high = found.interval(moved).T
        variances.append(np.diag(found.covariance))
        hits.append((low <= 0.0) & (high >= 0.0))
    assert np.mean(variances, axis=0) == pytest.approx(np.diag(np.linalg.inv(x.T @ x)), rel=2.0 * SCATTER)
    assert np.mean(hits) > 0.92


def test_a_block_that_tells_most_is_left_out_as_far_as_others_tell() -> None:
    """A tenth of the rows holds most information: leaving it out moves the estimate by far more than its score."""
    rows, rng = 2000, np.random.default_rng(9)
    x = np.ones((rows, 1))
    x[:200] *= 6.0
    z = []
    for _ in range(200):
        moved, noise = refitted(x, autoregressive(0.9, rows, rng))
        z.append(moved[0] / judged(x, noise, white=False).std_error[0])
    assert np.std(z) < 1.3


def test_the_sandwich_agrees_where_noise_is_white() -> None:
    """It costs only scatter to use it without need."""
    x, rng = design(2000), np.random.default_rng(3)
    mean = np.mean([np.diag(judged(x, rng.standard_normal(2000), False).covariance) for _ in range(60)], axis=0)
    assert mean == pytest.approx(np.diag(np.linalg.inv(x.T @ x)), rel=SCATTER)


def test_robust_intervals_are_those_of_students_t() -> None:
    """They are wider than normal ones by the number of blocks behind the variance."""
    found = judged(design(2000), np.random.default_rng(4).standard_normal(2000), white=False)
    assert found.kind == "sandwich"
    assert 20 < found.freedom < 200
    low, high = found.interval(np.ones(3)).T
    assert (high - low) / found.std_error == pytest.approx(2.0 * scipy.stats.t.ppf(0.975, found.freedom))


def test_a_parameter_at_its_bound_is_held_and_has_no_error() -> None:
    """The others have the covariance of a regression without it."""
    x, theta = design(300), np.array([0.0, 1.0, 2.0])
    found = uncertainty(space(theta, 0.0, 10.0), theta, regression(x, np.zeros(300)), True, "squares")
    assert found.at_bound.tolist() == [True, False, False]
    assert np.all(np.isnan(found.covariance[0])) and np.all(np.isnan(found.covariance[:, 0]))
    assert found.covariance[1:, 1:] == pytest.approx(np.linalg.inv(x[:, 1:].T @ x[:, 1:]), rel=ROUNDING)


def test_bounds_are_reached_within_rounding_of_their_span() -> None:
    """Upper, lower and absent bounds."""
    theta = np.array([0.0, 1e-7, 1e-3, 1.0, 5.0])
    bounded = space(theta, np.array([0, 0, 0, 0, -np.inf]), np.array([1, 1, 1, 1, np.inf]))
    assert bounded.at_bounds(theta).tolist() == [True, True, False, True, False]


@pytest.mark.parametrize("white", [True, False])
def test_a_direction_without_information_is_vague_not_undefined(white: bool) -> None:
    """Parameters that act only as a sum, or not at all, get a huge standard error; their sum a small one."""
    x = design(300)
    x[:, 1] = x[:, 0]
    x[:, 2] = 0.0
    found = judged(x, np.random.default_rng(6).standard_normal(300), white)
    assert np.all(np.isfinite(found.covariance))
    assert np.all(found.std_error > 1e4)
    sum_variance = found.covariance[:2, :2].sum()
    assert sum_variance == pytest.approx(1.0 / float(x[:, 0] @ x[:, 0]), rel=0.1 if white else 1.0)


@pytest.mark.parametrize("outliers", [0.0, 0.2])
def test_a_robust_loss_need_not_be_the_likelihood_of_the_noise(outliers: float) -> None:
    """The spread of a mean by Huber's loss is what many draws show, with outliers of ten floors and without."""
    rows, rng, loss = 1000, np.random.default_rng(7), Huber()
    x, inside = np.ones((rows, 1)), space(np.zeros(1), -10, 10)
    ends, errors = list[float](), list[float]()
    for _ in range(200):
        noise = rng.standard_normal(rows) * np.where(rng.random(rows) < outliers, 10.0, 1.0)
        end = 0.0
        for _ in range(30):
            weight = loss.weight(noise - end)
            end = float(weight @ noise / weight.sum())
        left = end - noise
        found = replace(regression(x, left, loss.weight(left) * left), curvature=loss.curvature(left))
        doubt = uncertainty(inside, np.zeros(1), found, True, "huber")
        assert doubt.kind == "sandwich"
        ends.append(end)
        errors.append(float(doubt.std_error[0]))
    assert np.mean(errors) == pytest.approx(np.std(ends), rel=SCATTER)


def test_rows_beside_the_absolute_loss_keep_their_weight() -> None:
    """Static points and gaps are squares: alone they have the intervals of regression, whatever the loss."""
    x, theta = design(300), np.ones(3)
    squares = replace(regression(x, np.random.default_rng(2).standard_normal(300)), channel=np.full(300, -1))
    found = uncertainty(space(theta, -10, 10), theta, squares, True, "absolute")
    assert found.kind == "gauss_newton"
    assert found.covariance == pytest.approx(np.linalg.inv(x.T @ x), rel=ROUNDING)


def test_the_absolute_loss_has_the_covariance_of_least_absolute_deviations() -> None:
    """For Laplace noise of scale s it is s^2 (X'X)^-1, whatever the noise floor (Bassett & Koenker 1978)."""
    rows, scale, rng = 3000, 4.0, np.random.default_rng(5)
    x, theta = design(rows), np.ones(3)
    inside, variances = space(theta, -10, 10), []
    for _ in range(40):
        noise = rng.laplace(scale=scale, size=rows)
        variances.append(
            np.diag(uncertainty(inside, theta, regression(x, noise, np.sign(noise)), True, "absolute").covariance)
        )
    assert np.mean(variances, axis=0) == pytest.approx(scale**2 * np.diag(np.linalg.inv(x.T @ x)), rel=2 * SCATTER)
