"""Which samples of a counter tell nothing new."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.recording.repeats import PERIODS, SHORTEST, repeated
from friction_ocp.simulation.grid import BoolArray, FloatArray

SAMPLES = 2000


def counted(motion: FloatArray) -> FloatArray:
    """Return what a counter of steps of one shows."""
    return np.round(motion)


def kept(motion: FloatArray) -> BoolArray:
    return ~repeated(counted(motion), 1.0)


def test_a_rest_counts_once() -> None:
    assert np.sum(kept(np.full(SAMPLES, 0.3))) == 1


@pytest.mark.parametrize("whole", [1, 4, -200])
def test_whole_counts_a_sample_count_once(whole: int) -> None:
    assert np.sum(kept(0.3 + whole * np.arange(SAMPLES))) == 1


@pytest.mark.parametrize("period", range(2, PERIODS + 1))
def test_as_much_is_kept_as_the_mean_error_tells(period: int) -> None:
    """Errors that repeat themselves after p samples leave a mean with a deviation smaller by p, for ever."""
    assert np.sum(kept(0.3 + np.arange(SAMPLES) / period)) == period**2


@pytest.mark.parametrize("speed", [4.1, 4.46, 0.37, np.pi])
def test_a_motion_that_passes_counts_irregularly_is_kept(speed: float) -> None:
    assert np.mean(kept(0.3 + speed * np.arange(SAMPLES))) > 0.99


def test_counts_that_are_passed_slowly_are_kept() -> None:
    """Their errors are slow, but those of one pass add up to nothing."""
    assert np.mean(kept(0.01 * np.arange(SAMPLES))) > 0.9


def test_accelerating_through_whole_speeds_is_kept() -> None:
    assert np.mean(kept(0.5 * 0.004 * np.arange(SAMPLES) ** 2)) > 0.8


def test_a_rest_between_moves_counts_once() -> None:
    rest = 300
    away = np.cumsum(np.full(SAMPLES, np.pi))
    found = kept(np.concatenate([away, np.full(rest, away[-1]), away[-1] - away]))
    assert np.mean(found[SAMPLES : SAMPLES + rest]) < 0.05
    assert np.mean(found[:SAMPLES]) > 0.99 and np.mean(found[SAMPLES + rest :]) > 0.99


def test_noise_of_half_a_count_makes_samples_independent() -> None:
    noise = 0.5 * np.random.default_rng(3).normal(size=SAMPLES)
    assert np.mean(kept(4.0 * np.arange(SAMPLES) + 0.3 + noise)) > 0.8


def test_means_of_what_is_kept_err_as_independent_samples_do() -> None:
    """Over speeds of whole counts and simple fractions of them, at any phase; all samples together err by more."""
    rng = np.random.default_rng(4)
    own, all_of_them = list[float](), list[float]()
    for _ in range(300):
        period = int(rng.integers(1, PERIODS + 1))
        motion = rng.uniform() + rng.integers(0, 50) * np.arange(SAMPLES) / period
        error = (counted(motion) - motion) * np.sqrt(12.0)
        told = kept(motion)
        own.append(float(np.sum(error[told]) / np.sqrt(np.sum(told))))
        all_of_them.append(float(np.sum(error) / np.sqrt(SAMPLES)))
    assert np.std(own) == pytest.approx(1.0, abs=0.2)
    assert np.std(all_of_them) > 10.0


def test_the_step_is_what_counts_are_told_by() -> None:
    motion = 0.3 + 4.0 * np.arange(SAMPLES)
    assert np.array_equal(repeated(5e-7 * counted(motion), 5e-7), repeated(counted(motion), 1.0))


def test_few_samples_are_kept() -> None:
    for size in range(SHORTEST):
        assert not repeated(np.zeros(size), 1.0).any()
