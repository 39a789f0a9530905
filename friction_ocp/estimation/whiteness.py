"""Whether residuals are white, channel by channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.simulation.grid import FloatArray

stats: Any = _stats  # its own types are incomplete

LAGS = 20
SIGNIFICANCE = 0.01
SHOWN_LAGS = 200


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


def whiteness(time: FloatArray, residual: FloatArray) -> Whiteness:
    """Test residuals (NaN where missing) by the statistic of Ljung & Box 1978 over 20 lags."""
    seen = np.isfinite(residual)
    r, count = np.where(seen, residual - np.nanmean(residual), 0.0), int(seen.sum())
    lags = min(SHOWN_LAGS, r.size // 4)
    power = np.fft.irfft(np.abs(np.fft.rfft(r, 2 * r.size)) ** 2)[: lags + 1]
    rho = power[1:] / max(float(power[0]), 1e-300)
    used = min(LAGS, lags)
    statistic = count * (count + 2.0) * float(np.sum(rho[:used] ** 2 / (count - np.arange(1, used + 1))))
    step = float(np.median(np.diff(time)))
    p_value = float(stats.chi2.sf(statistic, used))
    lag_s = np.asarray(step * np.arange(1, lags + 1), dtype=np.float64)
    return Whiteness(lag_s, rho, 1.96 / np.sqrt(max(count, 1)), p_value)
