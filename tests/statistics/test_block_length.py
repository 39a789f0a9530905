"""Block lengths and effective sample sizes against the closed forms of first-order autoregression."""

from __future__ import annotations

import numpy as np
import pytest
from regressions import autoregressive

from friction_ocp.statistics.block_length import block_length, effective_size

SAMPLES, DRAWS = 4000, 40
SCATTER = 0.2
"""Relative error of the mean over the draws, its bias at this length included."""


@pytest.mark.parametrize("phi", [0.5, 0.8, 0.9])
def test_the_block_length_is_that_of_politis_and_white(phi: float) -> None:
    """Its mean is (6 phi^2 n / (1 - phi^2)^2)^(1/3), from their equation 9 with the autocovariance phi^|k|."""
    rng = np.random.default_rng(1)
    found = [block_length(autoregressive(phi, SAMPLES, rng)) for _ in range(DRAWS)]
    assert np.mean(found) == pytest.approx((6.0 * phi**2 * SAMPLES / (1.0 - phi**2) ** 2) ** (1 / 3), rel=SCATTER)


def test_white_noise_needs_blocks_of_a_few_samples() -> None:
    """Nothing is there to be kept together."""
    rng = np.random.default_rng(2)
    assert np.median([block_length(rng.standard_normal(SAMPLES)) for _ in range(DRAWS)]) < 5.0


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_the_effective_size_is_that_of_the_mean(phi: float) -> None:
    """n (1 - phi) / (1 + phi)."""
    rng = np.random.default_rng(3)
    found = [effective_size(autoregressive(phi, SAMPLES, rng)) for _ in range(DRAWS)]
    assert np.mean(found) == pytest.approx(SAMPLES * (1.0 - phi) / (1.0 + phi), rel=SCATTER)


@pytest.mark.parametrize("series", [np.zeros(50), np.full(50, np.nan), np.arange(3.0), np.zeros(0)])
def test_what_holds_nothing_needs_one_sample(series: np.ndarray) -> None:
    """Constant, missing and very short series have blocks of one sample, and no size beyond their own."""
    assert block_length(series) == 1.0
    assert 0.0 <= effective_size(series) <= series.size


def test_gaps_do_not_change_the_choice_much() -> None:
    """One sample in twenty missing."""
    rng = np.random.default_rng(4)
    series = autoregressive(0.9, SAMPLES, rng)
    thinned = np.where(rng.uniform(size=SAMPLES) < 0.05, np.nan, series)
    assert block_length(thinned) == pytest.approx(block_length(series), rel=0.3)
