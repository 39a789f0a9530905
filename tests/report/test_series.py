"""Thinning keeps what a person would see."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from friction_ocp.plots.series import FloatArray, peak_indices, rounded, trace_of

values = st.floats(-1e6, 1e6) | st.just(np.nan)


@given(arrays(np.float64, st.tuples(st.just(3), st.integers(1, 400)), elements=values), st.integers(16, 120))
def test_thinning_keeps_the_peaks_of_every_signal(signals: FloatArray, points: int) -> None:
    """Largest and smallest value, both ends and the presence of a gap survive."""
    kept = peak_indices(tuple(signals), points)
    assert len(kept) <= points or len(kept) == signals.shape[1]
    assert len(kept) <= max(points, 1)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == signals.shape[1] - 1
    assert np.isnan(signals).any() == np.isnan(signals[:, kept]).any()
    for signal in signals[np.isfinite(signals).any(axis=1)]:
        assert np.nanmax(signal[kept]) == np.nanmax(signal)
        assert np.nanmin(signal[kept]) == np.nanmin(signal)


def test_a_single_spike_among_a_million_samples_is_drawn() -> None:
    """One sample out of line stays where it was, in the residual too."""
    time = np.linspace(0.0, 1000.0, 1_000_000)
    measured = np.sin(time)
    measured[654_321] += 5.0
    trace = trace_of({"time": time, "measured": measured, "simulated": np.sin(time)})
    assert len(trace.time) <= 4000
    assert trace.samples == 1_000_000
    assert trace.time[np.argmax(trace.residual)] == time[654_321]


def test_a_gap_stays_a_gap() -> None:
    """Where nothing was measured for long, the curve breaks and the simulation goes on."""
    time = np.linspace(0.0, 10.0, 100_001)
    measured = np.where((time > 4.0) & (time < 4.02), np.nan, time)
    trace = trace_of({"time": time, "measured": measured, "simulated": time})
    assert np.isnan(trace.measured[(trace.time > 4.0) & (trace.time < 4.02)]).any()
    assert np.isfinite(trace.simulated).all()


def test_a_slow_channel_on_a_fast_axis_is_one_curve() -> None:
    """A sample every hundred instants is not a gap."""
    time = np.linspace(0.0, 10.0, 100_001)
    measured = np.full(len(time), np.nan)
    measured[::100] = time[::100]
    trace = trace_of({"time": time, "measured": measured, "simulated": time})
    assert len(trace.time) == 1001
    assert np.isfinite(trace.measured).all()


@given(arrays(np.float64, st.integers(0, 50), elements=values.filter(lambda value: not 0 < abs(value) < 1e-250)))
def test_rounding_is_finer_than_a_pixel(signal: FloatArray) -> None:
    """No value moves by more than a hundred-thousandth of the range; what is missing is None."""
    short = rounded(signal)
    assert [value is None for value in short] == np.isnan(signal).tolist()
    finite = signal[np.isfinite(signal)]
    if finite.size:
        extent = np.ptp(finite) or np.abs(finite).max()
        assert [value for value in short if value is not None] == pytest.approx(finite, abs=1e-5 * extent, rel=1e-12)


def test_a_small_motion_far_from_zero_keeps_its_shape() -> None:
    """Digits follow the range of a signal, not its offset."""
    assert rounded(np.array([12345.0, 12345.00001])) == [12345.0, 12345.00001]
