"""The test of residuals for whiteness holds its level and has power."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats
from regressions import autoregressive

from friction_ocp.estimation.whiteness import SIGNIFICANCE, told_by_rounding, whiteness

TIME = 0.005 * np.arange(600)
FALSE_ALARM = 1e-4
"""Chance that a band below is left by luck; the seeds are fixed."""


def test_white_noise_passes_at_the_stated_rate() -> None:
    """Of many white residuals about 1 % are called coloured."""
    rng, draws = np.random.default_rng(3), 500
    alarms = sum(not whiteness(TIME, rng.standard_normal(TIME.size)).white for _ in range(draws))
    low, high = scipy.stats.binom.ppf([FALSE_ALARM, 1.0 - FALSE_ALARM], draws, SIGNIFICANCE)
    assert low <= alarms <= high


@pytest.mark.parametrize("phi", [-0.4, 0.25, 0.9])
def test_neighbours_that_resemble_each_other_are_seen(phi: float) -> None:
    """Autoregressive residuals fail, and their autocorrelation is phi at lag one."""
    test = whiteness(TIME, autoregressive(phi, TIME.size, np.random.default_rng(5)))
    assert not test.white
    assert test.autocorrelation[0] == pytest.approx(phi, abs=0.12)


def test_missing_samples_are_left_out() -> None:
    """NaN among white residuals is no colour, and does not hide colour."""
    rng = np.random.default_rng(7)
    missing = rng.random(TIME.size) < 0.3
    white, coloured = rng.standard_normal(TIME.size), autoregressive(0.6, TIME.size, rng)
    assert whiteness(TIME, np.where(missing, np.nan, white)).white
    assert not whiteness(TIME, np.where(missing, np.nan, coloured)).white


def test_a_constant_offset_is_no_colour() -> None:
    """The mean of the residuals is taken out: it says nothing about time."""
    noise = np.random.default_rng(11).standard_normal(TIME.size)
    assert whiteness(TIME, noise + 5.0).p_value == pytest.approx(whiteness(TIME, noise).p_value)


def test_lags_are_in_seconds_and_the_band_is_that_of_white_noise() -> None:
    """Lags count sampling steps; 95 % of the autocorrelations of white noise lie within 1.96 / sqrt(n)."""
    test = whiteness(TIME, np.random.default_rng(13).standard_normal(TIME.size))
    assert test.lag_s[:3] == pytest.approx([0.005, 0.010, 0.015])
    assert test.band == pytest.approx(1.96 / np.sqrt(TIME.size))
    assert np.mean(np.abs(test.autocorrelation) < test.band) > 0.9


def counted(speed: float, noise: float, misfit: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what is predicted of a counter of unit steps, and what it shows less that."""
    rng, samples = np.random.default_rng(seed), np.arange(3000)
    predicted = speed * samples
    shown = np.round(predicted + noise * rng.standard_normal(samples.size) + misfit * np.sin(samples / 30.0))
    return predicted, shown - predicted


@pytest.mark.parametrize("speed", [0.07, 1.26, 2.49])
def test_errors_of_rounding_at_a_steady_speed_tell_nothing(speed: float) -> None:
    """A right model leaves them, in a pattern that the speed makes of them."""
    predicted, residual = counted(speed, 0.0, 0.0, 1)
    assert not whiteness(np.arange(residual.size), residual).white
    assert told_by_rounding(predicted, residual, 1.0).mean() > 0.95


@pytest.mark.parametrize("misfit", [0.7, 3.0])
def test_what_a_model_misses_is_told_from_rounding(misfit: float) -> None:
    """Residuals that are larger than rounding makes them count, at a steady speed too."""
    predicted, residual = counted(1.26, 0.0, misfit, 1)
    asked = ~told_by_rounding(predicted, residual, 1.0)
    assert asked.mean() > 0.95
    assert not whiteness(np.arange(residual.size), np.where(asked, residual, np.nan)).white


def test_where_other_noise_moves_a_counter_all_samples_count() -> None:
    """Noise of two counts leaves nothing of the pattern, and errors larger than those of rounding."""
    predicted, residual = counted(1.26, 2.0, 0.0, 1)
    assert not told_by_rounding(predicted, residual, 1.0).any()
    assert whiteness(np.arange(residual.size), residual).white
