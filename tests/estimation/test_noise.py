"""The noise floor comes from the first source that there is, never from a fit."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.noise import NoiseFloor, noise_floor

TIME = 0.002 * np.arange(3000)
SMOOTH = np.sin(3.0 * TIME)
NOISE = 1e-3
SCATTER = 0.1
"""Relative error of a deviation from some thousand samples, robust estimate included."""

Signal = tuple[np.ndarray, np.ndarray]


def noisy(seed: int, path: np.ndarray = SMOOTH) -> Signal:
    """Return a run along a path with white noise."""
    return TIME, path + NOISE * np.random.default_rng(seed).standard_normal(TIME.size)


def channel(resolution: float | None = None, noise_std: float | None = None) -> Channel:
    """Return an encoder."""
    return Channel("position", "load.theta", resolution=resolution, noise_std=noise_std)


def test_a_stated_noise_is_taken_as_it_is() -> None:
    """`noise_std` outranks everything that the recordings would say."""
    assert noise_floor(channel(0.1, 0.25), [noisy(1), noisy(2)]) == NoiseFloor(0.25, "noise_std")


def test_a_stated_resolution_comes_next() -> None:
    """Rounding to steps of r has the deviation r / sqrt(12)."""
    assert noise_floor(channel(0.12), [noisy(1), noisy(2)]) == NoiseFloor(0.12 / np.sqrt(12.0), "resolution")


def test_repeated_runs_come_third() -> None:
    """Runs along the same path differ by their noise alone."""
    floor = noise_floor(channel(), [noisy(1), noisy(2), noisy(3, np.cos(2.0 * TIME))])
    assert floor.source == "repeated_runs"
    assert floor.std == pytest.approx(NOISE, rel=SCATTER)


def test_high_frequencies_come_last() -> None:
    """Single runs show their noise above the frequencies of the motion."""
    floor = noise_floor(channel(), [noisy(1), noisy(2, np.cos(2.0 * TIME))])
    assert floor.source == "high_frequency"
    assert floor.std == pytest.approx(NOISE, rel=SCATTER)


def test_runs_at_other_times_are_no_repetition() -> None:
    """The same motion recorded at another rate is not compared sample by sample."""
    time, values = noisy(2)
    assert noise_floor(channel(), [noisy(1), (1.1 * time, values)]).source == "high_frequency"


def test_missing_samples_do_not_hide_the_noise() -> None:
    """NaN are left out."""
    time, values = noisy(1)
    values[np.random.default_rng(3).random(values.size) < 0.2] = np.nan
    assert noise_floor(channel(), [(time, values)]).std == pytest.approx(NOISE, rel=SCATTER)


def test_a_signal_that_rests_has_some_floor() -> None:
    """A residual over the floor is finite even where nothing moves."""
    floor = noise_floor(channel(), [(TIME, np.zeros(TIME.size))])
    assert floor.source == "assumed"
    assert floor.std > 0
