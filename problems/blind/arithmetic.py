"""Arithmetic of the score: shares, log score, calibration with its band, and the test between two methods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta, binom

Stated = Sequence[tuple[float, bool]]
"""Probability and truth of every possibility of one case; their probabilities sum to 1 and one is true."""
LEAST = 1e-3
"""Probability below which a log score is not counted down further: an answer that was never considered."""
EDGES = (0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0)
"""Of the bins of stated probability."""
RESAMPLES = 2000


def share_interval(hits: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the interval of a share (Clopper & Pearson 1934)."""
    tail = 0.5 * (1.0 - level)
    low = float(beta.ppf(tail, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return low, high


def log_score(probabilities: Sequence[float]) -> float:
    """Return the mean logarithm of the probability that was given to the truth; 0 is perfect."""
    return float(np.mean(np.log(np.maximum(probabilities, LEAST))))


@dataclass(frozen=True)
class Bin:
    """Possibilities of about one stated probability."""

    low: float
    high: float
    count: int
    stated: float
    """Mean probability."""
    observed: float
    """Share of them that were true."""
    band: tuple[float, float]
    """95 % of the shares that would be observed were the probabilities right."""

    @property
    def inside(self) -> bool:
        """Whether what was observed lies in the band."""
        return self.band[0] <= self.observed <= self.band[1]


def calibration(cases: Sequence[Stated], rng: np.random.Generator) -> list[Bin]:
    """Return the bins that hold something; the band draws the truth of every case from its stated probabilities."""
    owner = np.concatenate([np.full(len(case), k) for k, case in enumerate(cases)])
    stated = np.array([probability for case in cases for probability, _ in case])
    true = np.array([truth for case in cases for _, truth in case], dtype=float)
    which = np.clip(np.searchsorted(EDGES, stated, side="right") - 1, 0, len(EDGES) - 2)
    drawn = np.stack([_draw(stated, owner, rng) for _ in range(RESAMPLES)])
    bins: list[Bin] = []
    for k in np.unique(which):
        own = which == k
        low, high = np.quantile(drawn[:, own].mean(axis=1), [0.025, 0.975])
        bins.append(
            Bin(EDGES[k], EDGES[k + 1], int(own.sum()), float(stated[own].mean()), float(true[own].mean()),
                (float(low), float(high)))
        )  # fmt: skip
    return bins


def _draw(stated: np.ndarray, owner: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return one possible truth: in every case one possibility, by the stated probabilities (Gumbel 1954)."""
    keys = np.log(np.maximum(stated, 1e-300)) + rng.gumbel(size=stated.size)
    order = np.lexsort((keys, owner))
    last = np.append(np.diff(owner[order]) != 0, True)
    truth = np.zeros(stated.size)
    truth[order[last]] = 1.0
    return truth


def expected_error(bins: Sequence[Bin]) -> float:
    """Return the mean distance of observed shares from stated probabilities, by the number in each bin."""
    count = sum(item.count for item in bins)
    return sum(item.count * abs(item.observed - item.stated) for item in bins) / count if count else 0.0


def mcnemar(ours: Sequence[bool], theirs: Sequence[bool]) -> float:
    """Return the two-sided p-value that two methods are right equally often, from the cases on which they differ.

    The exact test of McNemar 1947: under equality each differing case falls either way with probability 1/2.
    """
    better = sum(a and not b for a, b in zip(ours, theirs, strict=True))
    worse = sum(b and not a for a, b in zip(ours, theirs, strict=True))
    if better + worse == 0:
        return 1.0
    return float(min(1.0, 2.0 * binom.cdf(min(better, worse), better + worse, 0.5)))


def excess(ratios: Sequence[float]) -> float:
    """Return the mean over channels of max(0, ratio^2 - 1), ratio being rms error over noise floor."""
    return float(np.mean([max(0.0, ratio**2 - 1.0) for ratio in ratios]))


def shrinkage(before: Sequence[float], after: Sequence[float]) -> float | None:
    """Return the share of the excess that is gone; None where there was none."""
    size = excess(before)
    return None if size <= 0.0 else 1.0 - excess(after) / size
