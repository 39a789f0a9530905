"""Gross outliers and missing samples: robust losses stay with the clean fit, and their standard errors are right."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.stats
from axes import ENCODER_NOISE, TRUTH, fitted_axis, measured_axis

from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.recording.recording import Recording

OUTLIERS, MISSING, LONGEST_BURST = 0.05, 0.2, 30
ROBUST = ("huber", "student_t")
DRAWS = 40


def spoiled(recording: Recording, seed: int) -> Recording:
    """Replace samples by outliers of 20 to 200 noise floors, and take out bursts."""
    rng, channel = np.random.default_rng(seed), recording.channels["position"]
    values = np.array(channel.values, dtype=float)
    hit = rng.random(values.size) < OUTLIERS
    values[hit] += rng.choice([-1.0, 1.0], hit.sum()) * rng.uniform(20.0, 200.0, hit.sum()) * ENCODER_NOISE
    while np.mean(np.isnan(values)) < MISSING:
        first = rng.integers(values.size - LONGEST_BURST)
        values[first : first + rng.integers(5, LONGEST_BURST)] = np.nan
    return replace(recording, channels={**recording.channels, "position": replace(channel, values=values)})


@cache
def clean_fit(seed: int) -> Estimate:
    return identify(fitted_axis(measured_axis(seed)))


@pytest.mark.parametrize("loss", ROBUST)
@pytest.mark.parametrize("seed", range(2))
def test_the_estimate_stays_within_two_standard_errors_of_the_clean_one(loss: str, seed: int) -> None:
    """5 % gross outliers and 20 % missing in bursts: no parameter moves by more than two of the clean errors."""
    clean = clean_fit(seed)
    estimate = identify(fitted_axis(spoiled(measured_axis(seed), 100 + seed), loss=loss))
    assert estimate.converged
    for item, before in zip(estimate.parameters, clean.parameters, strict=True):
        assert abs(item.value - before.value) < 2.0 * before.std_error
        assert 1.0 < item.std_error / before.std_error < 2.0


def test_squares_do_not_stand_it() -> None:
    """The same data move a fit by squares far away: the outliers are gross."""
    estimate = identify(fitted_axis(spoiled(measured_axis(0), 100)))
    shift = [
        abs(item.value - before.value) / before.std_error
        for item, before in zip(estimate.parameters, clean_fit(0).parameters, strict=True)
    ]
    assert max(shift) > 10.0


@pytest.mark.slow
@pytest.mark.parametrize("loss", ROBUST)
def test_the_standard_errors_of_robust_losses_are_right(loss: str) -> None:
    """Over many draws the sum of squared z-scores, in full covariance, lies in its 99 % band."""
    total = 0.0
    for seed in range(DRAWS):
        estimate = identify(fitted_axis(spoiled(measured_axis(seed), 100 + seed), loss=loss))
        error = np.array([item.value - TRUTH[item.name] for item in estimate.parameters])
        total += float(error @ np.linalg.solve(estimate.uncertainty.covariance, error))
    low, high = scipy.stats.chi2.ppf([0.005, 0.995], DRAWS * len(TRUTH))
    assert low < total < high
