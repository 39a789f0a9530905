"""Coherence of two signals, and the distance of two curves."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.estimation.agreement import coherence, curve_distance

TIME = np.linspace(0.0, 20.0, 4001)


def test_a_filtered_signal_is_coherent_where_it_has_power(rng_seed: int = 0) -> None:
    """A linear copy has coherence 1, independent noise next to none, and both together their share of power."""
    rng = np.random.default_rng(rng_seed)
    first, noise = rng.standard_normal((2, TIME.size))
    assert np.min(coherence(TIME, 2.0 * first, first).share[1:]) > 0.999
    assert np.mean(coherence(TIME, noise, first).share) < 0.3
    shared = coherence(TIME, first + noise, first).share
    assert np.mean(shared) == pytest.approx(0.5, abs=0.1)


def test_the_explained_power_is_that_of_the_copy_and_survives_thinning() -> None:
    """A tone that the simulation has, beside a weaker one that it lacks, explains its own share of the power."""
    rng = np.random.default_rng(1)
    with_it, without = np.sin(2 * np.pi * 2.0 * TIME), 0.5 * np.sin(2 * np.pi * 11.0 * TIME + 1.0)
    found = coherence(TIME, with_it + without, with_it + 1e-3 * rng.standard_normal(TIME.size))
    assert found.explained == pytest.approx(0.8, abs=0.05)
    thin = found.thinned(40)
    assert thin.frequency.size <= 40 and np.all(np.diff(thin.frequency) > 0)
    assert thin.explained == pytest.approx(found.explained, rel=1e-9)


def test_a_signal_that_stands_still_is_explained_by_none() -> None:
    """Without power there is nothing to share, and nothing to be warned of."""
    time = np.linspace(0.0, 1.0, 200)
    assert coherence(time, np.zeros(200), np.zeros(200)).explained == 0.0


def test_missing_samples_are_bridged() -> None:
    """Gaps do not spread."""
    wave = np.sin(2 * np.pi * 3.0 * TIME) * np.exp(-0.2 * TIME)
    holes = np.where(np.arange(TIME.size) % 7 == 3, np.nan, wave)
    found = coherence(TIME, holes, wave)
    assert found.share[np.argmin(np.abs(found.frequency - 3.0))] > 0.99


def test_the_distance_is_least_along_the_curve() -> None:
    """Equal curves are no distance apart; a shift in time costs at most k times the shift, and a shift in value
    leaves d next to nothing: it is a deviation, blind to bias."""
    wave = np.sin(2 * np.pi * 0.5 * TIME)
    assert curve_distance(TIME, wave, wave) == pytest.approx(0.0, abs=1e-6)
    shifted = np.sin(2 * np.pi * 0.5 * (TIME - 0.02))
    assert 0.0 < curve_distance(TIME, wave, shifted, scale=1.0) < 0.02
    line = 0.1 * TIME
    assert curve_distance(TIME, line, line + 0.3, scale=1.0) < 0.1 * 0.3
