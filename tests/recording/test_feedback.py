"""Noise of a command that follows the counts of an encoder: what the loop makes of them is none."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from friction_ocp.recording.conditioning import high_frequency_noise
from friction_ocp.recording.feedback import EACH, unexplained_noise

FloatArray = npt.NDArray[np.float64]

COUNT = 2.0 * np.pi / 4096
SAMPLES, INTERVAL = 6000, 1e-3
GAIN, KEPT = 0.4, 0.7
"""A per rad/s of the speed that the loop tells, and what its low-pass filter keeps of it from sample to sample."""
SAMPLING_ERROR = 0.04


def times() -> FloatArray:
    return INTERVAL * np.arange(SAMPLES)


def counts() -> FloatArray:
    """Return a motion as an encoder shows it."""
    return COUNT * np.round((0.4 * np.sin(5.0 * times()) + 0.1 * np.sin(17.0 * times())) / COUNT)


def command(seen: FloatArray, saturation: float = np.inf) -> FloatArray:
    """Return what a loop commands that follows a smooth reference."""
    speed = 0.0
    found = np.zeros(seen.size)
    for k in range(1, seen.size):
        speed += (1.0 - KEPT) * ((seen[k] - seen[k - 1]) / INTERVAL - speed)
        found[k] = np.clip(GAIN * (2.0 * np.cos(5.0 * times()[k]) - speed), -saturation, saturation)
    return found


@pytest.mark.parametrize("std", [0.002, 0.05])
@pytest.mark.parametrize(("saturation", "error"), [(np.inf, SAMPLING_ERROR), (0.75, 0.1)])
def test_only_what_a_sensor_adds_is_noise(std: float, saturation: float, error: float) -> None:
    """The counts add to either; where it saturates it is no linear filter of them, and a deviation counts that."""
    rng = np.random.default_rng(3)
    shown = command(counts(), saturation) + std * rng.standard_normal(SAMPLES)
    assert high_frequency_noise(times(), shown) > 1.3 * std
    assert unexplained_noise(times(), shown, [counts()]) == pytest.approx(std, rel=error)


def test_noise_that_no_motion_knows_of_stays() -> None:
    """A motion without feedback, and one whose own noise is no part of the command, take nothing of it away."""
    rng = np.random.default_rng(4)
    shown = np.sin(5.0 * times()) + 0.01 * rng.standard_normal(SAMPLES)
    alone = high_frequency_noise(times(), shown)
    others = [counts(), counts() + COUNT * rng.standard_normal(SAMPLES)]
    assert unexplained_noise(times(), shown, others) == pytest.approx(alone, rel=SAMPLING_ERROR)


def test_missing_samples_are_left_out() -> None:
    rng = np.random.default_rng(5)
    shown = command(counts()) + 0.01 * rng.standard_normal(SAMPLES)
    shown[100:140] = np.nan
    seen = counts()
    seen[3000:3007] = np.nan
    assert unexplained_noise(times(), shown, [seen]) == pytest.approx(0.01, rel=SAMPLING_ERROR)


def test_what_cannot_be_told_is_nan() -> None:
    """Too few samples, no motion on the same clock, a motion that rests, a command that rests."""
    shown, few = command(counts()), 19 * EACH
    assert np.isnan(unexplained_noise(times()[:few], shown[:few], [counts()[:few]]))
    assert np.isnan(unexplained_noise(times(), shown, []))
    assert np.isnan(unexplained_noise(times(), shown, [counts()[:100]]))
    assert np.isnan(unexplained_noise(times(), shown, [np.zeros(SAMPLES)]))
    assert np.isnan(unexplained_noise(times(), np.ones(SAMPLES), [counts()]))
