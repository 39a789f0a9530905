"""How long blocks of residuals must be to keep their correlation."""

from __future__ import annotations

import numpy as np

from friction_ocp.simulation.grid import FloatArray


def block_length(series: FloatArray) -> float:
    """Return the block length, in samples, that is best for the variance of a mean; NaN counts as the mean.

    Automatic choice with a flat-top lag window. Source: Politis & White 2004, for blocks of fixed length, with the
    correction of Patton, Politis & White 2009. For an AR(1) of coefficient rho it tends to
    (6 rho^2 n / (1 - rho^2)^2)^(1/3).
    """
    seen = np.isfinite(series)
    count = series.size
    if count < 8:
        return 1.0
    r = np.where(seen, series - np.mean(series[seen]), 0.0) if seen.any() else np.zeros(count)
    covariance = np.fft.irfft(np.abs(np.fft.rfft(r, 2 * count)) ** 2)[:count] / count
    if covariance[0] <= 0:
        return 1.0
    width = 2 * _last_correlated(covariance / covariance[0])
    lags = np.arange(min(width, count - 1) + 1)
    window = np.clip(2.0 * (1.0 - lags / max(width, 1)), 0.0, 1.0)
    weighted = window * covariance[: lags.size]
    slope = 2.0 * float(np.sum(lags * weighted))
    power = 2.0 * float(np.sum(weighted)) - float(covariance[0])
    best = (1.5 * slope**2 / max(power**2, 1e-300)) ** (1.0 / 3.0) * count ** (1.0 / 3.0)
    return float(np.clip(best, 1.0, np.ceil(min(3.0 * np.sqrt(count), count / 3.0))))


def effective_size(series: FloatArray) -> float:
    """Return the number of independent samples that tell as much about a mean: n / (1 + 2 sum of autocorrelations).

    The sum ends before the first pair of neighbouring lags whose sum is negative. Source: Geyer 1992, initial positive
    sequence.
    """
    r = series[np.isfinite(series)]
    if r.size < 4:
        return float(r.size)
    r = r - r.mean()
    rho = np.fft.irfft(np.abs(np.fft.rfft(r, 2 * r.size)) ** 2)[: r.size]
    rho = rho / max(float(rho[0]), 1e-300)
    pairs = rho[: 2 * (r.size // 2)].reshape(-1, 2).sum(axis=1)
    stop = int(np.argmax(pairs <= 0)) if np.any(pairs <= 0) else pairs.size
    time = 2.0 * float(np.sum(pairs[:stop])) - 1.0
    return float(r.size / np.clip(time, 1.0, r.size))


def _last_correlated(rho: FloatArray) -> int:
    """Return the lag after which a run of autocorrelations is insignificant."""
    count = rho.size
    run = max(5, int(np.ceil(np.sqrt(np.log10(count)))))
    longest = int(np.ceil(np.sqrt(count))) + run
    small = np.abs(rho[1 : longest + run + 1]) < 2.0 * np.sqrt(np.log10(count) / count)
    for lag in range(max(0, small.size - run) + 1):
        if np.all(small[lag : lag + run]):
            return lag
    large = np.flatnonzero(~small)
    return int(large[-1]) + 1 if large.size else 0
