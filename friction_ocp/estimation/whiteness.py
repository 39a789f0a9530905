"""Whether residuals are white, channel by channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.simulation.grid import FloatArray

stats: Any = _stats  # its own types are incomplete

LAGS = 20
SIGNIFICANCE = 0.01
SHOWN_LAGS = 200
STRETCH = 100
"""Samples that are asked together whether they tell more than rounding."""
SPREAD = 5.0
"""Deviations by which the power of residuals may be above that of rounding."""


@dataclass(frozen=True)
class Whiteness:
    """Autocorrelation of the residuals of one channel in one recording."""

    lag_s: FloatArray
    autocorrelation: FloatArray
    band: float
    """Half-width of the 95 % band of white residuals."""
    p_value: float

    @property
    def white(self) -> bool:
        """Whether whiteness stands at the 1 % level."""
        return self.p_value > SIGNIFICANCE


def told_by_rounding(predicted: FloatArray, residual: FloatArray, step: float) -> npt.NDArray[np.bool_]:
    """Return (n,) at which samples of a counter residuals (n,), in its unit, are as large and not whiter than rounding.

    At a steady speed a counter's errors of rounding repeat themselves, and a right model leaves them. Where rounding
    what is `predicted` (n,) to `step` makes errors that are not white, and residuals are no larger than these, they
    tell nothing of the model. Source: Widrow, Kollar 2008, Quantization noise, ch. 3.
    """
    found = np.zeros(residual.size, dtype=bool)
    rounded = np.asarray(step * np.round(predicted / step) - predicted, dtype=np.float64)
    for rows in np.array_split(np.arange(residual.size), max(1, residual.size // STRETCH)):
        seen = rows[np.isfinite(residual[rows])]
        if seen.size < 2 * LAGS:
            continue
        least = max(float(np.sum(rounded[seen] ** 2)), seen.size * step**2 / 12.0)
        small = float(np.sum(residual[seen] ** 2)) <= least * (1.0 + SPREAD * float(np.sqrt(2.0 / seen.size)))
        found[seen] = small and not _tested(seen.astype(np.float64), rounded[seen]).white
    return found


def whiteness(time: FloatArray, residual: FloatArray) -> Whiteness:
    """Test residuals (NaN where missing) by the statistic of Ljung & Box 1978 over 20 lags."""
    return _tested(time, residual - np.nanmean(residual))


def _tested(time: FloatArray, errors: FloatArray) -> Whiteness:
    """Test errors (NaN where missing) whose mean is known to be zero."""
    seen = np.isfinite(errors)
    r, count = np.where(seen, errors, 0.0), int(seen.sum())
    lags = min(SHOWN_LAGS, r.size // 4)
    power = np.fft.irfft(np.abs(np.fft.rfft(r, 2 * r.size)) ** 2)[: lags + 1]
    rho = power[1:] / max(float(power[0]), 1e-300)
    used = min(LAGS, lags)
    statistic = count * (count + 2.0) * float(np.sum(rho[:used] ** 2 / (count - np.arange(1, used + 1))))
    step = float(np.median(np.diff(time)))
    p_value = float(stats.chi2.sf(statistic, used))
    lag_s = np.asarray(step * np.arange(1, lags + 1), dtype=np.float64)
    return Whiteness(lag_s, rho, 1.96 / np.sqrt(max(count, 1)), p_value)
