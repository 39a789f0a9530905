"""Noise floor, resolution, clipping and smooth motion against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.conditioning import (
    detect_resolution,
    high_frequency_noise,
    is_clipped,
    reach_of_ends,
    smooth_motion,
    without_low_pass,
)

SAMPLING_ERROR = 0.06
"""Relative; a median absolute deviation of some 4,000 correlated samples."""
N = 4000
RATE = 1000.0


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def times(rng: np.random.Generator | None = None) -> np.ndarray:
    jitter = 0.0 if rng is None else rng.uniform(-0.3, 0.3, N)
    return (np.arange(N) + jitter) / RATE


def sine(time: np.ndarray, frequency: float = 1.5) -> np.ndarray:
    return np.sin(2.0 * np.pi * frequency * time)


@pytest.mark.parametrize("noise_std", [1e-6, 1e-3, 0.1])
@pytest.mark.parametrize("irregular", [False, True])
def test_noise_of_a_smooth_signal_is_found(rng: np.random.Generator, noise_std: float, irregular: bool) -> None:
    """White noise on a smooth signal is measured right at regular and irregular times, with gaps."""
    time = times(rng if irregular else None)
    values = 10.0 + sine(time) + noise_std * rng.normal(size=N)
    values[rng.integers(0, N, 100)] = np.nan
    assert high_frequency_noise(time, values) == pytest.approx(noise_std, rel=SAMPLING_ERROR)


def test_noise_ignores_cubics(rng: np.random.Generator) -> None:
    """A cubic at irregular times has no noise but rounding."""
    time = times(rng)
    assert high_frequency_noise(time, 1.0 - time + 2.0 * time**2 - time**3) < 1e-12


def test_noise_ignores_spikes_and_steps(rng: np.random.Generator) -> None:
    """One per cent of spikes and some steps do not move the floor far."""
    values = 0.01 * rng.normal(size=N)
    values[::100] += 5.0
    values[N // 2 :] += 3.0
    assert high_frequency_noise(times(), values) == pytest.approx(0.01, rel=0.15)


@pytest.mark.parametrize("resolution", [1e-4, 1e-3, 1e-2])
def test_noise_of_a_quantised_signal_is_that_of_rounding(resolution: float) -> None:
    """Quantisation alone has the floor resolution / sqrt(12), at any speed of the signal."""
    values = np.round(sine(times()) / resolution) * resolution
    assert high_frequency_noise(times(), values) == pytest.approx(resolution / np.sqrt(12.0), rel=0.1)


def test_command_on_a_grid_has_no_noise() -> None:
    """Constant acceleration from rest visits multiples of one step, yet it is no quantised measurement."""
    values = 4e-7 * np.arange(N) ** 2
    assert detect_resolution(values) == pytest.approx(4e-7)
    assert high_frequency_noise(times(), values) < 1e-10


@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0])
def test_noise_and_rounding_add(rng: np.random.Generator, ratio: float) -> None:
    """Noise before rounding adds to that of rounding in squares."""
    resolution = 1e-3
    values = np.round((sine(times()) + ratio * resolution * rng.normal(size=N)) / resolution) * resolution
    expected = resolution * np.sqrt(ratio**2 + 1.0 / 12.0)
    assert high_frequency_noise(times(), values) == pytest.approx(expected, rel=0.1)


def test_noise_of_a_resting_signal(rng: np.random.Generator) -> None:
    """Stretches of rest say nothing; a constant and a switching command have none; too few samples give NaN."""
    values = np.concatenate((np.zeros(3 * N), 0.1 * rng.normal(size=N)))
    time = np.arange(4.0 * N)
    assert high_frequency_noise(time, values) == pytest.approx(0.1, rel=SAMPLING_ERROR)
    assert high_frequency_noise(time, np.ones(4 * N)) == 0.0
    assert high_frequency_noise(time, np.floor(time / N)) == 0.0
    assert np.isnan(high_frequency_noise(time[:8], values[:8]))


@given(st.floats(1e-6, 1e3), st.floats(-10.0, 10.0), st.lists(st.integers(-5000, 5000), min_size=5, max_size=50))
def test_resolution_is_the_common_step(step: float, offset: float, counts: list[int]) -> None:
    """Counts of a step from any offset give the greatest common divisor of their gaps times the step."""
    levels = np.unique(counts)
    found = detect_resolution(step * (np.array(counts) + offset))
    if len(levels) < 5:
        assert found is None
    else:
        assert found == pytest.approx(step * float(np.gcd.reduce(np.diff(levels))), rel=1e-6)


def test_resolution_of_continuous_and_switching_signals(rng: np.random.Generator) -> None:
    """Continuous values, single precision ones, and a few commanded levels have no resolution."""
    assert detect_resolution(rng.normal(size=N)) is None
    assert detect_resolution(10.0 + 1e-9 * rng.normal(size=N)) is None
    assert detect_resolution(sine(times()).astype(np.float32)) is None
    assert detect_resolution([0.0, 1.0, 2.0, 1.0, 0.0]) is None
    assert detect_resolution([np.nan, np.nan]) is None


def test_resolution_of_an_encoder_with_gaps() -> None:
    """An encoder of 4096 counts is recognised in radians, with missing samples."""
    step = 2.0 * np.pi / 4096
    values = np.round(sine(times()) / step) * step
    values[::7] = np.nan
    assert detect_resolution(values) == pytest.approx(step, rel=1e-9)


@pytest.mark.parametrize("limits", [(-0.9, 0.9), (-2.0, 0.9), (-0.5, 2.0)])
def test_clipping_is_seen_at_one_end_or_both(rng: np.random.Generator, limits: tuple[float, float]) -> None:
    """A sine cut at one or both ends is clipped, with and without noise before the cut."""
    values = sine(times())
    assert is_clipped(np.clip(values, *limits))
    assert is_clipped(np.clip(values + 0.01 * rng.normal(size=N), *limits))
    assert is_clipped(np.clip(np.round(values * 4096) / 4096, *limits))


def test_motion_that_rests_or_turns_is_not_clipped(rng: np.random.Generator) -> None:
    """A sine, its quantised flat tops, a rest at one end, a square wave and noise are not clipped."""
    time = times()
    rest = np.concatenate((np.zeros(N), 1.0 - np.cos(2.0 * np.pi * time / time[-1]), np.zeros(N)))
    assert not any(is_clipped(np.round(sine(time) / step) * step) for step in (1e-9, 1e-3, 1e-2, 0.1))
    assert not is_clipped(rest)
    assert not is_clipped(np.round(rest * 500.0) / 500.0)
    assert not is_clipped(np.sign(sine(time)))
    assert not is_clipped(rng.normal(size=N))
    assert not is_clipped(np.ones(N))


def test_rest_that_friction_ends_with_a_jump_is_not_clipped() -> None:
    """An axis that friction holds where it has turned, and that breaks away at once, is not at the end of its range."""
    stroke = -np.cos(np.linspace(0.0, np.pi, 400))
    held, leaving = np.full(100, stroke[-1]), stroke[::-1][60:]
    seen = np.concatenate([stroke, held, leaving] * 3)
    assert not is_clipped(seen)
    assert not is_clipped(np.round(seen * 2000.0) / 2000.0)


def test_ramp_into_a_rest_that_a_fall_ends_is_not_clipped() -> None:
    """A servo that follows a ramp to its end, and is let go there, stops at once and starts from rest."""
    ramp, fall = np.linspace(0.0, 1.5, 600), 0.5 * 3e-4 * np.arange(1, 80) ** 2
    seen = np.concatenate([ramp, np.full(40, 1.5), 1.5 - fall])
    assert not is_clipped(seen)
    assert not is_clipped(np.round(seen * 650.0) / 650.0)


def moves(step: float, speed: float, acceleration: float) -> np.ndarray:
    """Return a servo that goes to and fro by 1 rad, at rest between, as the means of 20 instants in every sample."""
    reached = speed / acceleration
    time = np.arange(0.0, 1.0 / speed + reached, step / 20.0)
    rate = speed * np.clip(np.minimum(time, time[-1] - time) / reached, 0.0, 1.0)
    stroke = np.cumsum(rate) * step / 20.0
    rests = [np.full(count, place) for count, place in ((1130, 0.0), (1570, stroke[-1]), (930, 0.0))]
    fine = np.concatenate([rests[0], stroke, rests[1], stroke[-1] - stroke, rests[2], stroke, rests[1]])
    return fine[10::20]


@pytest.mark.parametrize("reached", [3.2, 6.0, 20.0])
@pytest.mark.parametrize("step", [0.001, 0.008, 0.02])
@pytest.mark.parametrize("resolution", [0.0, 1e-6, 1e-5])
def test_moves_from_place_to_place_are_not_clipped(step: float, reached: float, resolution: float) -> None:
    """A servo that rests where its moves end is not cut off, be it at full speed after a few samples."""
    seen = moves(step, 0.1, 0.1 / (reached * step))
    assert not is_clipped(np.round(seen / resolution) * resolution if resolution else seen)


def test_smooth_motion_of_a_line_is_exact(rng: np.random.Generator) -> None:
    """A line is its own smoothing spline at any cutoff: exact speed, no acceleration."""
    time = times(rng)
    theta, omega, alpha = smooth_motion(time, 2.0 - 3.0 * time, cutoff_hz=5.0)
    np.testing.assert_allclose(theta, 2.0 - 3.0 * time, atol=1e-9)
    np.testing.assert_allclose(omega, -3.0, atol=1e-6)
    np.testing.assert_allclose(alpha, 0.0, atol=1e-3)


@pytest.mark.parametrize("ratio", [0.25, 1.0, 3.0])
def test_gain_of_smooth_motion(ratio: float) -> None:
    """A sine keeps its phase and the gain 1 / (1 + (f / cutoff)^4), in position, speed and acceleration."""
    cutoff, time = 8.0, times()
    w = 2.0 * np.pi * ratio * cutoff
    gain = 1.0 / (1.0 + ratio**4)
    inside = slice(N // 4, -N // 4)
    for order, (found, expected) in enumerate(
        zip(
            smooth_motion(time, np.sin(w * time), cutoff),
            (np.sin(w * time), np.cos(w * time), -np.sin(w * time)),
            strict=True,
        )
    ):
        np.testing.assert_allclose(found[inside], gain * w**order * expected[inside], atol=2e-3 * gain * w**order)


def test_smooth_motion_recovers_speed_and_acceleration(rng: np.random.Generator) -> None:
    """With the cutoff left open, noise is smoothed away by what the noise floor says; gaps are bridged."""
    time, w = times(rng), 2.0 * np.pi * 1.5
    values = sine(time) + 1e-3 * rng.normal(size=N)
    values[1000:1020] = np.nan
    theta, omega, alpha = smooth_motion(time, values)
    inside = slice(N // 20, -N // 20)
    assert np.std(theta[inside] - sine(time)[inside]) < 3e-4
    assert np.std(omega[inside] - w * np.cos(w * time)[inside]) < 0.02 * w
    assert np.std(alpha[inside] + w**2 * sine(time)[inside]) < 0.1 * w**2


def test_smooth_motion_without_noise_interpolates() -> None:
    """A signal without visible noise is interpolated, not smoothed."""
    time = times()
    theta, _, _ = smooth_motion(time, sine(time))
    np.testing.assert_allclose(theta, sine(time), atol=1e-7)


def test_smooth_motion_needs_samples() -> None:
    """Too few samples are refused in words."""
    with pytest.raises(FrictionOcpError, match="smooth motion: there are 2 samples; at least 5 are needed"):
        smooth_motion([0.0, 1.0, 2.0], [0.0, np.nan, 1.0])


@pytest.mark.parametrize("time_constant", [1e-4, 0.02, 1.0])
def test_a_low_pass_is_undone(rng: np.random.Generator, time_constant: float) -> None:
    """Held levels come back from behind a filter that moves towards them exponentially; a missing sample stays so."""
    time = times(rng)
    fed = rng.normal(size=N)
    shown = np.zeros(N)
    for k in range(N - 1):
        shown[k + 1] = fed[k] + (shown[k] - fed[k]) * np.exp(-(time[k + 1] - time[k]) / time_constant)
    found = without_low_pass(time, shown, time_constant)
    np.testing.assert_allclose(found[:-1], fed[:-1], atol=1e-9)
    shown[N // 2] = np.nan
    holed = without_low_pass(time, shown, time_constant)
    assert np.flatnonzero(~np.isfinite(holed)).tolist() == [N // 2]
    np.testing.assert_allclose(np.delete(holed, [N // 2 - 1, N // 2])[:-1], np.delete(fed, [N // 2 - 1, N // 2])[:-1])


def test_stamps_that_come_in_pairs_are_smoothed(rng: np.random.Generator) -> None:
    """Penalties beyond what stamps so close together can bear are not needed: the noise is found below them."""
    time = np.arange(0.0, 30.0, 0.01)
    time[[500, 1500, 2500]] = time[[499, 1499, 2499]] + 1e-6
    truth = np.sin(0.5 * time)
    theta, omega, _ = smooth_motion(time, truth + 1e-3 * rng.standard_normal(time.size))
    assert np.sqrt(np.mean((theta - truth) ** 2)) < 3e-4
    assert np.sqrt(np.mean((omega - 0.5 * np.cos(0.5 * time))[20:-20] ** 2)) < 5e-3


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_ends_bear_on_the_acceleration_no_farther_than_their_reach(noise: float, rng: np.random.Generator) -> None:
    """A body that speeds up evenly does so from reach to reach; a third of that from an end it seems not to."""
    time = np.arange(0.0, 4.0, 0.01)
    values = 10.0 * time**2 + noise * rng.standard_normal(time.size)
    _, _, alpha = smooth_motion(time, values)
    reach = reach_of_ends(time, values)
    inside = (time > reach) & (time < time[-1] - reach)
    assert np.mean(inside) > 0.5
    assert np.max(np.abs(alpha[inside] / 20.0 - 1.0)) < 2e-3 + 4.0 * np.std(alpha[inside]) / 20.0
    near = (time < reach / 3.0) | (time > time[-1] - reach / 3.0)
    assert np.max(np.abs(alpha[near] / 20.0 - 1.0)) > 0.5
