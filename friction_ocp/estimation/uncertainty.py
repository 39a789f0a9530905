"""Covariance of the estimate: from the Gauss-Newton Hessian, or robust where residuals are not white."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.influence import Influence
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.simulation.grid import BoolArray, FloatArray

stats: Any = _stats  # its own types are incomplete

CONFIDENCE = 0.95
NO_INFORMATION = 1e-30
"""Stands for the information on a parameter that no residual depends on."""
SMALLEST_INFORMATION, UNTOLD = 1e-14, 1e-12
"""Scaled information below which rounding decides, and from which a direction counts as told by the data."""
MIN_BLOCKS, MAX_BLOCKS = 24, 200
"""Blocks of residuals that the robust covariance is summed over: enough to average, long enough to be independent."""


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors of the parameters and how they were found."""

    covariance: FloatArray
    """(parameters, parameters); rows and columns of parameters at a bound are NaN."""
    kind: str
    """`gauss_newton` or `sandwich`."""
    at_bound: BoolArray
    """(parameters,)."""
    freedom: float
    """Degrees of freedom of the t distribution behind the intervals."""
    information: FloatArray
    """(parameters, parameters) Gauss-Newton Hessian."""

    @property
    def std_error(self) -> FloatArray:
        """(parameters,), NaN at a bound."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> FloatArray:
        """(parameters, parameters)."""
        return self.covariance / np.outer(self.std_error, self.std_error)

    def interval(self, theta: FloatArray) -> FloatArray:
        """Return (parameters, 2) intervals at 95 %."""
        reach = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, self.freedom)) * self.std_error
        return np.column_stack([theta - reach, theta + reach])


def uncertainty(space: ParameterSpace, theta: FloatArray, found: Influence, white: bool, absolute: bool) -> Uncertainty:
    """Return the covariance on the parameters that are not at a bound.

    With white residuals it is the inverse Hessian; otherwise, and for losses that are no likelihood of the noise,
    the sandwich H^-1 B H^-1 with B summed over blocks of neighbouring residuals (Huber 1967, Hall 1985).
    """
    information = found.information
    if absolute:
        information = found.jacobian.T @ (_density_weight(found)[:, None] * found.jacobian) + found.prior
    bound = space.at_bounds(theta)
    free = ~bound
    told, untold = inverse_information(information[np.ix_(free, free)])
    covariance = np.full(information.shape, np.nan)
    if white and not absolute:
        covariance[np.ix_(free, free)] = told + untold
        return Uncertainty(covariance, "gauss_newton", bound, np.inf, information)
    scores = _block_scores(found, free)
    reach, prior = told @ scores.T, found.prior[np.ix_(free, free)]
    covariance[np.ix_(free, free)] = reach @ reach.T + told @ prior @ told + untold
    return Uncertainty(covariance, "sandwich", bound, float(len(scores) - 1), information)


def _density_weight(found: Influence) -> FloatArray:
    """Curvature of the absolute loss: twice the density of the residuals at zero (Silverman's bandwidth)."""
    r = found.residual
    spread = min(float(np.std(r)), float(np.subtract(*np.quantile(r, [0.75, 0.25]))) / 1.34)
    width: float = 0.9 * spread * r.size**-0.2
    density = float(np.mean(np.exp(-0.5 * (r / width) ** 2))) / (width * np.sqrt(2.0 * np.pi))
    return np.full(r.size, 2.0 * density)


def inverse_information(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the inverse of an information matrix in two parts: directions with information, and those without.

    The latter get a huge variance. No score varies along them, so that a sandwich would find them known.
    """
    own = np.diag(matrix)
    size = np.sqrt(np.where(own > 0, own, NO_INFORMATION))
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    variances = 1.0 / np.maximum(values, SMALLEST_INFORMATION)
    told = np.where(values > UNTOLD, variances, 0.0)
    untold, scale = variances - told, np.outer(size, size)
    return (vectors * told) @ vectors.T / scale, (vectors * untold) @ vectors.T / scale


def _block_scores(found: Influence, free: BoolArray) -> FloatArray:
    """Return (blocks, parameters) centred sums of scores, scaled so that their outer products sum to their variance."""
    scores = found.jacobian[:, free] * found.score_weight[:, None]
    recordings = np.unique(found.recording)
    length = _correlation_rows(found)
    blocks: list[FloatArray] = []
    for index in recordings:
        own = scores[found.recording == index]
        wanted = int(np.clip(own.shape[0] / (4.0 * length), MIN_BLOCKS / recordings.size, MAX_BLOCKS))
        blocks += [part.sum(axis=0) for part in np.array_split(own, max(wanted, 2))]
    stacked = np.array(blocks)
    count = stacked.shape[0]
    centred = stacked - stacked.mean(axis=0)
    return centred * np.sqrt(count / (count - 1))


def _correlation_rows(found: Influence) -> float:
    """Return the integrated autocorrelation length of the residuals, in rows (initial positive sequence)."""
    lengths: list[float] = []
    for index in np.unique(found.recording):
        r = found.score_weight[found.recording == index]
        r = r - r.mean()
        power = np.abs(np.fft.rfft(r, 2 * r.size)) ** 2
        rho = np.fft.irfft(power)[: r.size]
        rho = rho / max(float(rho[0]), 1e-300)
        stop = int(np.argmax(rho <= 0)) or r.size
        lengths.append(1.0 + 2.0 * float(np.sum(rho[1:stop])))
    return float(np.mean(lengths))
