"""Covariance of the estimate: from the Gauss-Newton Hessian, or robust where residuals are not white."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.influence import Influence
from friction_ocp.estimation.origins import pull
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.problem import Loss
from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray

stats: Any = _stats  # its own types are incomplete

CONFIDENCE = 0.95
NO_INFORMATION = 1e-30
"""Stands for the information on a parameter that no residual depends on."""
SMALLEST_INFORMATION, UNTOLD = 1e-14, 1e-12
"""Scaled information below which rounding decides, and from which a direction counts as told by the data."""
MIN_BLOCKS, MAX_BLOCKS = 3, 200
"""Blocks of residuals that the robust covariance is summed over: as many as are long enough to be independent. Where
these are few, the t distribution says how little a variance from them is known."""
LENGTHS = 4.0
"""Correlation lengths of a block."""
OF_A_WALK, FOR_A_PARAMETER = 2.9, 0.8
"""Blocks that residuals hold which are a random walk, at most in 95 % of cases, and how many more each fitted parameter
makes of them: with fewer they may be one. Walks of 500 and of 4000 rows show as many (`test_origins.py`)."""
MOST_LEVERAGE = 0.9
"""Share of what is known about a direction that leaving out a block may take: without a block that alone tells of it
nothing is known."""


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors of the parameters and how they were found."""

    covariance: FloatArray
    """(parameters, parameters); rows and columns of parameters at a bound are NaN, all without convergence."""
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

    @property
    def reach(self) -> float:
        """Standard errors from an estimate to the ends of its interval at 95 %."""
        return reach95(self.freedom)

    def interval(self, theta: FloatArray) -> FloatArray:
        """Return (parameters, 2) intervals at 95 %."""
        half = self.reach * self.std_error
        return np.column_stack([theta - half, theta + half])

    def withheld(self) -> Uncertainty:
        """Return it without covariance: that of an iterate that is no optimum says nothing of the parameters."""
        return dataclasses.replace(self, covariance=np.full_like(self.covariance, np.nan))


def reach95(freedom: float) -> float:
    """Return how many standard errors, known to some degrees of freedom, an interval at 95 % reaches to either side."""
    return float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))


def uncertainty(space: ParameterSpace, theta: FloatArray, found: Influence, sure: bool, loss: Loss) -> Uncertainty:
    """Return the covariance on the parameters that are not at a bound.

    Where it is `sure` that residuals are white noise of the stated floors it is the inverse Hessian of their squares;
    otherwise, and for losses that need not be the likelihood of the noise, what leaving out one block of neighbouring
    residuals after the other makes of it: the sandwich H^-1 B H^-1 with each block's share of the information taken out
    (Huber 1967; Bell & McCaffrey 2002, the jackknife). Without that few blocks with much to tell make intervals too
    short. Errors that go on to the end of a free run belong to the block in which they arise.
    """
    weight = _density_weight(found) if loss == "absolute" else found.curvature
    information = found.jacobian.T @ (weight[:, None] * found.jacobian) + found.prior
    bound = space.at_bounds(theta)
    free = ~bound
    own = np.ix_(free, free)
    told, untold = inverse_information(information[own])
    covariance = np.full(information.shape, np.nan)
    if sure and (loss == "squares" or not found.by_loss.any()):
        covariance[own] = told + untold
        return Uncertainty(covariance, "gauss_newton", bound, np.inf, information)
    moved = _jackknifed(found, weight, free, information[own], told)
    count, prior = len(moved), found.prior[own]
    moved = (moved - moved.mean(axis=0)) * np.sqrt((count - 1) / count)
    covariance[own] = moved.T @ moved + told @ prior @ told + untold
    return Uncertainty(covariance, "sandwich", bound, float(count - 1), information)


def _density_weight(found: Influence) -> FloatArray:
    """Curvature of the absolute loss: twice the density of its residuals at zero (Silverman's bandwidth)."""
    r = found.residual[found.by_loss]
    if not r.size:
        return found.curvature
    spread = min(float(np.std(r)), float(np.subtract(*np.quantile(r, [0.75, 0.25]))) / 1.34)
    width: float = 0.9 * spread * r.size**-0.2
    density = float(np.mean(np.exp(-0.5 * (r / width) ** 2))) / (width * np.sqrt(2.0 * np.pi))
    return np.where(found.by_loss, 2.0 * density, found.curvature)


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


def _jackknifed(
    found: Influence, weight: FloatArray, free: BoolArray, information: FloatArray, told: FloatArray
) -> FloatArray:
    """Return (blocks, parameters) how far leaving out each block moves the free parameters, to first order.

    `information` is that on the free parameters, `told` its inverse.
    """
    moved: list[FloatArray] = []
    length, own = _correlation_rows(found), np.ix_(free, free)
    pulls = pull(found, weight, _wandering(found, length, int(np.sum(free))))
    for rows in _blocks(found, length):
        part = pulls.information(rows)[own]
        left, _ = inverse_information(information - _leverage_limit(told, part) * part)
        moved.append(left @ (pulls.reach[rows].T @ pulls.error[rows])[free])
    return np.array(moved)


def _leverage_limit(told: FloatArray, part: FloatArray) -> float:
    """Return the share of a block's information that may be left out."""
    leverage = float(np.max(np.linalg.eigvals(told @ part).real, initial=0.0))
    return min(1.0, MOST_LEVERAGE / max(leverage, 1e-300))


def _wandering(found: Influence, length: float, parameters: int) -> list[IntArray]:
    """Return the rows of free runs whose errors may go on to the end of a recording, as those of a random walk do.

    Where a recording has several free runs they end with each.
    """
    most = (OF_A_WALK + FOR_A_PARAMETER * parameters / len(found.places)) * LENGTHS * length
    short = [rows for rows in found.places if rows.size < most and _tells_of_the_next(found.score_weight[rows])]
    return [rows for rows in short if found.by_loss[rows].all() and np.ptp(found.window[rows]) == 0]


def _blocks(found: Influence, length: float) -> list[IntArray]:
    """Return the rows of blocks of neighbouring residuals: several correlation lengths, or whole free runs.

    The errors of a free run go on to its end, and into none that starts afresh. A few residuals of which none tells of
    the next, such as those of static points, stand each for itself.
    """
    places = found.places
    runs: list[list[IntArray]] = [np.split(rows, np.flatnonzero(np.diff(found.window[rows])) + 1) for rows in places]
    apart = sum(map(len, runs)) >= MIN_BLOCKS
    blocks: list[IntArray] = []
    for rows, own in zip(places, runs, strict=True):
        wanted = max(int(np.clip(rows.size / (LENGTHS * length), MIN_BLOCKS / len(places), MAX_BLOCKS)), 2)
        if rows.size <= MAX_BLOCKS and not _tells_of_the_next(found.score_weight[rows]):
            wanted = rows.size
        if apart and len(own) > 1:
            cuts = np.linspace(0, len(own), min(wanted, len(own)) + 1).astype(int)
            blocks += [np.concatenate(own[begin:end]) for begin, end in pairwise(cuts)]
        else:
            blocks += np.array_split(rows, wanted)
    return blocks


def _tells_of_the_next(values: FloatArray) -> bool:
    """Whether neighbours among some values are alike, beyond what chance makes of independent ones."""
    r = values - values.mean()
    alike = float(r[1:] @ r[:-1]) / max(float(r @ r), 1e-300)
    return alike * np.sqrt(r.size) > float(stats.norm.ppf(CONFIDENCE))


def _correlation_rows(found: Influence) -> float:
    """Return the integrated autocorrelation length of the residuals, in rows (initial positive sequence)."""
    lengths: list[float] = []
    for rows in found.places:
        r = found.score_weight[rows] - found.score_weight[rows].mean()
        power = np.abs(np.fft.rfft(r, 2 * r.size)) ** 2
        rho = np.fft.irfft(power)[: r.size]
        rho = rho / max(float(rho[0]), 1e-300)
        stop = int(np.argmax(rho <= 0)) or r.size
        lengths.append(1.0 + 2.0 * float(np.sum(rho[1:stop])))
    return float(np.mean(lengths))
