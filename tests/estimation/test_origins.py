"""Errors that go on to the end of a free run are counted where they arise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from regressions import regression, space

from friction_ocp.estimation import uncertainty as robust
from friction_ocp.estimation.origins import pull

ROWS = 500


def drift(rng: np.random.Generator) -> np.ndarray:
    """Return what disturbances that last some samples leave behind in an integrator."""
    steps = np.convolve(rng.standard_normal(ROWS + 19), np.ones(20) / 20.0, "valid")
    return np.cumsum(steps)


def smooth(rng: np.random.Generator, columns: int) -> np.ndarray:
    """Return regressors that wander as positions under wrong parameters do."""
    return np.column_stack([drift(rng) for _ in range(columns)])


def test_summed_otherwise_the_scores_are_the_same() -> None:
    """Of two channels in turn, each by itself; their sum and the information are those of the rows."""
    rng = np.random.default_rng(1)
    found = regression(rng.standard_normal((ROWS, 2)), rng.standard_normal(ROWS))
    found = replace(found, channel=np.arange(ROWS) % 2)
    weight = rng.uniform(0.5, 1.0, ROWS)
    seen = pull(found, weight, [np.arange(ROWS)])
    assert seen.reach.T @ seen.error == pytest.approx(found.jacobian.T @ found.score_weight)
    assert seen.information(np.arange(ROWS)) == pytest.approx(found.jacobian.T @ (weight[:, None] * found.jacobian))
    for channel in (0, 1):
        own = np.flatnonzero(found.channel == channel)
        assert seen.error[own[1:]] == pytest.approx(np.diff(found.score_weight[own]))


def test_rows_that_do_not_wander_stay() -> None:
    """As they are in the Jacobian and the scores."""
    rng = np.random.default_rng(2)
    found = regression(rng.standard_normal((ROWS, 2)), rng.standard_normal(ROWS))
    seen = pull(found, np.ones(ROWS), [])
    assert np.array_equal(seen.reach, found.jacobian) and np.array_equal(seen.error, found.score_weight)


def test_intervals_cover_where_errors_drift() -> None:
    """Disturbances of a free run whose effects do not end: by where residuals are, intervals cover 80 % of truths."""
    hits = list[np.ndarray]()
    for seed in range(200):
        rng = np.random.default_rng(seed)
        x, noise = smooth(rng, 2), drift(rng)
        moved = np.linalg.solve(x.T @ x, x.T @ noise)
        found = regression(x, noise - x @ moved)
        doubt = robust.uncertainty(space(np.ones(2), -1e9, 1e9), np.ones(2), found, False, "squares")
        low, high = doubt.interval(moved).T
        hits.append((low <= 0.0) & (high >= 0.0))
    assert np.all(np.mean(hits, axis=0) > 0.93)
    assert np.mean(hits) < 0.99


@pytest.mark.parametrize("rows", [500, 4000])
@pytest.mark.parametrize("parameters", [0, 1, 3])
def test_a_random_walk_shows_as_few_independent_stretches(parameters: int, rows: int) -> None:
    """In 95 % of cases no more than is said, after a fit of as many parameters."""
    rng, blocks = np.random.default_rng(3), list[float]()
    for _ in range(400):
        walk = np.cumsum(rng.standard_normal(rows))
        x = np.cumsum(rng.standard_normal((rows, parameters)), axis=0)
        left = walk - x @ np.linalg.lstsq(x, walk, rcond=None)[0]
        found = regression(x, left)
        blocks.append(rows / (robust.LENGTHS * robust._correlation_rows(found)))  # pyright: ignore[reportPrivateUsage]
    share = np.mean(np.array(blocks) < robust.OF_A_WALK + robust.FOR_A_PARAMETER * parameters)
    assert share == pytest.approx(0.95, abs=0.03)  # 2.8 standard deviations of 400 draws
