"""What a signal says of itself before any model: noise floor, resolution, clipping, smooth motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.interpolate as _interpolate  # pyright: ignore[reportMissingTypeStubs]
import scipy.linalg as _linalg  # pyright: ignore[reportMissingTypeStubs]
import scipy.optimize as _optimize  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.recording import FloatArray

interpolate: Any = _interpolate  # its own types are incomplete
linalg: Any = _linalg
optimize: Any = _optimize

MAD_TO_STD = 1.4826
_MIN_LEVELS = 5
FEWEST_SAMPLES = 5
"""Samples from which the motion between them can be told."""


def high_frequency_noise(time: npt.ArrayLike, values: npt.ArrayLike) -> float:
    """Return the standard deviation of white noise on a smooth signal, NaN where there are too few samples.

    Fourth divided differences, scaled to unit noise gain, remove any local cubic; their median absolute deviation is
    robust against steps and spikes. A signal that rests on one value says nothing there. A quantised signal has at
    least resolution / sqrt(12), unless it is a smooth command on a grid. Zero means that no noise is to be seen; noise
    slower than five samples never is.
    """
    t, y = _present(time, values)
    if len(t) < 9:
        return float("nan")
    residual = fourth_differences(t, y)
    windows = np.lib.stride_tricks.sliding_window_view(y, 5)
    moving = residual[np.ptp(windows, axis=1) > 0.0]
    if not len(moving):
        return 0.0
    if len(np.unique(y)) < _MIN_LEVELS:
        return MAD_TO_STD * float(np.median(np.abs(residual)))
    robust = MAD_TO_STD * float(np.median(np.abs(moving)))
    resolution = detect_resolution(y)
    if resolution is None or not 0.05 * resolution < robust <= resolution:
        return robust
    within = residual[np.abs(residual) <= 3.0 * resolution]
    return max(resolution / np.sqrt(12.0), float(np.sqrt(np.mean(within**2))))


def detect_resolution(values: npt.ArrayLike) -> float | None:
    """Return the step whose integer multiples, from any offset, all values are; None if there is none.

    Fewer than five levels are no evidence: a command that switches is not a coarse sensor.
    """
    y = np.asarray(values, dtype=np.float64)
    levels = np.unique(y[np.isfinite(y)])
    if len(levels) < _MIN_LEVELS:
        return None
    rounding = 1e4 * np.finfo(np.float64).eps * float(np.max(np.abs(levels)))
    gaps = np.diff(levels)
    gaps = gaps[gaps > rounding]
    if len(gaps) < _MIN_LEVELS - 1:
        return None
    step = _common_divisor(gaps, rounding)
    return None if step is None else float(np.sum(gaps) / np.sum(np.round(gaps / step)))


def is_clipped(values: npt.ArrayLike, min_share: float = 0.01) -> bool:
    """Tell whether the signal runs into its highest or lowest value and stays there, while it moves otherwise.

    Only runs of equal extremes count that are longer than runs elsewhere and are reached and left in full motion, four
    levels of a quantised signal within five samples: neither is the flat top of a quantised sine, nor a rest, which
    friction may end with a jump or from which the signal starts slowly, be it that two samples alone show this. But a
    commanded plateau looks the same as clipping, and so does a rest that ends at full speed within a sample.
    """
    y = np.asarray(values, dtype=np.float64)
    y = y[np.isfinite(y)]
    if len(y) < 10 or float(np.ptp(y)) == 0.0:
        return False
    at_extreme = (y == np.max(y)) | (y == np.min(y))
    if np.mean(at_extreme) < min_share or np.mean(~at_extreme) < 0.1:
        return False
    starts, stops = _runs(y)
    lengths, outside = stops - starts, ~at_extreme[starts]
    long = ~outside & (lengths > max(2.0, 2.0 * float(np.quantile(lengths[outside], 0.9))))
    level = detect_resolution(y) or 0.0
    coarse, noise = 4.0 * level, high_frequency_noise(np.arange(len(y)), y)
    usual = {
        reach: float(np.median(np.abs(y[reach:] - y[:-reach])[~(at_extreme[reach:] & at_extreme[:-reach])]))
        for reach in range(2, 6)
    }
    stuck, ways = 0, np.zeros(2, dtype=bool)
    for start, stop in zip(starts[long].tolist(), stops[long].tolist(), strict=True):
        longest = min(max((stop - start) // 2, 2), 5)
        # A parabola reached and left with slope s is s n / 4 high over n samples; a quantised one stays within levels.
        height = float(np.nanmean(_moves(y, start, stop, 2))) / 2.0 * (stop - start) / 4.0
        fast, slow = np.zeros(2, dtype=bool), np.zeros(2, dtype=bool)
        for reach in range(2, longest + 1):
            near, far = _moves(y, start, stop, reach), _moves(y, start, stop, 2 * reach)
            # Twice as long after a rest a signal is four times as far from it; from where it was cut off, less.
            most = 2.0 * (stop - start + 2 * reach) / (stop - start + reach)
            rest = far > np.sqrt(4.0 * most) * (near - level)
            slow |= (near > max(coarse, 4.0 * noise)) & rest
            fast = (near > max(0.25 * usual[reach], coarse)) & ~rest
        fast &= ~slow
        if np.any(fast) and height > coarse:
            stuck += stop - start
            ways |= fast | np.array([start == 0, stop == len(y)])
    return stuck >= min_share * len(y) and bool(np.all(ways))


def without_low_pass(time: npt.ArrayLike, values: npt.ArrayLike, time_constant: float) -> FloatArray:
    """Return (n,) what a first-order filter was fed that shows `values`: its mean from each sample to the next.

    A controller that reports a filtered current shows it late and flattened. The filter is inverted exactly for an
    input held between samples; the last interval repeats the one before it, and missing samples stay so.
    """
    t, y = np.asarray(time, dtype=np.float64), np.array(values, dtype=np.float64)
    present = np.flatnonzero(np.isfinite(t) & np.isfinite(y))
    if present.size < 2:
        return y
    shown, kept = y[present], np.exp(-np.diff(t[present]) / time_constant)
    with np.errstate(divide="ignore", invalid="ignore"):  # times that stand still are refused by the checks that follow
        fed = (shown[1:] - kept * shown[:-1]) / (1.0 - kept)
    y[present] = np.append(fed, fed[-1])
    return y


def smooth_motion(
    time: npt.ArrayLike, values: npt.ArrayLike, cutoff_hz: float | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, speed and acceleration, (n,) each, of a cubic smoothing spline.

    It shifts no phase; its gain is 1/2 at the cutoff and falls with the fourth power of frequency above it. Without a
    cutoff it is as smooth as the noise floor allows: the residual has the size of `high_frequency_noise`. Missing
    samples are bridged; the acceleration is zero at both ends, and off beside them (`reach_of_ends`). Source: Reinsch
    1967.
    """
    t = np.asarray(time, dtype=np.float64)
    t_present, y = _present(time, values)
    if len(t_present) < FEWEST_SAMPLES:
        allowed = f"at least {FEWEST_SAMPLES} are needed"
        raise FrictionOcpError(Finding("smooth motion", f"there are {len(t_present)} samples", allowed))
    step = float(np.mean(np.diff(t_present)))
    penalty = _penalty(t_present, y, step) if cutoff_hz is None else (2.0 * np.pi * cutoff_hz * step) ** -4
    smooth = y if penalty == 0.0 else _reinsch(t_present / step, y, penalty)
    spline = interpolate.CubicSpline(t_present, smooth, bc_type="natural")
    theta, omega, alpha = (np.asarray(spline(t, order), dtype=np.float64) for order in range(3))
    return theta, omega, alpha


def reach_of_ends(time: npt.ArrayLike, values: npt.ArrayLike) -> float:
    """Return for how long, s, the ends of a smoothed motion bear on its acceleration, by more than a thousandth.

    What a spline is forced to at an end decays by 2 - sqrt(3) a sample where it interpolates, and by exp(-1 / sqrt(2))
    over the fourth root of its penalty, in samples, where it smooths.
    """
    t, y = _present(time, values)
    step = float(np.mean(np.diff(t)))
    smoothed = np.sqrt(2.0) * _penalty(t, y, step) ** 0.25
    return step * float(np.log(1e3)) * max(smoothed, 1.0 / float(np.log(2.0 + np.sqrt(3.0))))


def _penalty(t: FloatArray, y: FloatArray, step: float) -> float:
    return _penalty_for_noise(t / step, y, high_frequency_noise(t, y))


def _present(time: npt.ArrayLike, values: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    t, y = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    present = np.isfinite(y) & np.isfinite(t)
    return t[present], y[present]


def fourth_differences(t: FloatArray, y: FloatArray) -> FloatArray:
    """Return (n - 4,) fourth divided differences over five neighbours, scaled: white noise keeps its deviation."""
    times = np.lib.stride_tricks.sliding_window_view(t / np.mean(np.diff(t)), 5)
    windows = np.lib.stride_tricks.sliding_window_view(y, 5)
    total, squares = np.zeros(len(times)), np.zeros(len(times))
    for k in range(5):
        others = [times[:, k] - times[:, j] for j in range(5) if j != k]
        weight = 1.0 / (others[0] * others[1] * others[2] * others[3])
        total += weight * (windows[:, k] - windows[:, 2])
        squares += weight**2
    return total / np.sqrt(squares)


def _common_divisor(gaps: FloatArray, rounding: float) -> float | None:
    """Return the largest step of which all gaps are multiples, by Euclid's algorithm, or None.

    With enough gaps the smallest is taken if it fits to 0.5 %: values may have been printed with few digits.
    """
    step = float(np.min(gaps))
    if len(gaps) >= 8 and np.all(np.abs(gaps - step * np.round(gaps / step)) < 0.005 * step):
        return step
    while step > 1e3 * rounding:
        misfit = np.flatnonzero(np.abs(gaps - step * np.round(gaps / step)) > rounding)
        if not len(misfit):
            return step
        gap = rest = float(gaps[misfit[0]])
        while rest > rounding:
            step, rest = rest, abs(step - rest * round(step / rest))
        step = gap / round(gap / step)
    return None


def _runs(y: FloatArray) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return start and stop of every run of equal values."""
    changes = np.flatnonzero(np.diff(y) != 0.0) + 1
    return np.concatenate(([0], changes)), np.concatenate((changes, [len(y)]))


def plateaus(values: FloatArray) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return start and stop of every run of three or more samples at the highest or lowest value."""
    starts, stops = _runs(values)
    there = ((values == np.nanmax(values)) | (values == np.nanmin(values)))[starts] & (stops - starts > 2)
    return starts[there], stops[there]


def _moves(y: FloatArray, start: int, stop: int, reach: int) -> FloatArray:
    """Return (2,) how far the signal is from the value of a run `reach` samples before and after it; NaN is outside."""
    places = (start - reach, stop - 1 + reach)
    return np.array([abs(float(y[place] - y[start])) if 0 <= place < len(y) else np.nan for place in places])


def _reinsch(t: FloatArray, y: FloatArray, penalty: float) -> FloatArray:
    """Return the minimiser of sum (y - f)^2 + penalty * integral f''^2 at the knots."""
    h = np.diff(t)
    lower, upper = 1.0 / h[:-1], 1.0 / h[1:]
    middle = -lower - upper
    bands = np.zeros((3, len(t) - 2))
    bands[2] = (h[:-1] + h[1:]) / 3.0 + penalty * (lower**2 + middle**2 + upper**2)
    bands[1, 1:] = h[1:-1] / 6.0 + penalty * (middle[:-1] * lower[1:] + upper[:-1] * middle[1:])
    bands[0, 2:] = penalty * upper[:-2] * lower[2:]
    curvature = np.asarray(linalg.solveh_banded(bands, np.diff(np.diff(y) / h)), dtype=np.float64)
    padded = np.concatenate(([0.0], curvature, [0.0]))
    slope = np.concatenate(([0.0], np.diff(padded) / h, [0.0]))
    return y - penalty * np.diff(slope)


def _penalty_for_noise(t: FloatArray, y: FloatArray, noise_std: float) -> float:
    """Return the penalty that leaves a residual of the noise floor, by its logarithm; 0 to interpolate."""

    def excess(exponent: float) -> float:
        residual = float(np.sqrt(np.mean((y - _reinsch(t, y, 10.0**exponent)) ** 2)))
        return float(np.log(max(residual, 1e-300) / noise_std))

    low, high, step = -4.0, 12.0, 2.0
    if not noise_std > 0.0 or excess(low) >= 0.0:
        return 0.0
    while low < high and step > 0.1:
        try:
            if excess(low + step) > 0.0:
                return 10.0 ** float(optimize.brentq(excess, low, low + step, xtol=1e-5))
            low += step
        except linalg.LinAlgError:  # rounding: a penalty beyond what stamps so close together can bear
            step *= 0.5
    return 10.0**low
