"""Is there a gap: the power of the innovations over the noise floor, in blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks, stats
from friction_ocp.diagnosis.linear import Rows

FLOOR_DOUBT = 0.05
"""Relative doubt about any noise floor: an error that is this much above it may be the floor's own."""
DOUBTED = (1.0 + FLOOR_DOUBT) ** 2
"""Power over that of noise up to which it may be the floor's own."""


@dataclass(frozen=True)
class Excess:
    """Mean square of the innovations over their variance."""

    ratio: float
    p_value: float
    """Probability of so much power where there is nothing but noise, the floor being off by its doubt."""

    @property
    def beyond(self) -> float:
        """Share of the power that noise does not explain, in units of the noise."""
        return max(self.ratio - 1.0, 0.0)

    def significant(self, level: float) -> bool:
        """Whether there is more than noise at a level."""
        return self.p_value < level


def excess(rows: Rows, blocks: Blocks) -> Excess:
    """Test whether the mean power of the blocks exceeds what noise gives (one-sided t test over blocks).

    A gap in a few blocks alone makes their powers so unequal that a t test sees nothing: the mean is also compared with
    what the independent samples of the blocks make of noise (chi-square). Static points are independent of one
    another: each set is tested by itself. The smallest p-value counts, times the number of tests (Bonferroni).
    """
    samples = (rows.channel >= 0) & (rows.residual != 0.0)
    power, count = blocks.sums(rows.residual**2), blocks.sums(samples.astype(float))
    told = count > 0
    ratios = power[told] / count[told]
    mean = float(np.sum(power) / max(float(np.sum(count)), 1.0))
    if ratios.size < 2:
        return Excess(mean, 1.0)
    spread = float(np.std(ratios, ddof=1)) / np.sqrt(ratios.size)
    statistic = (float(np.mean(ratios)) - DOUBTED) / max(spread, 1e-300)
    each = blocks.independent
    rare = float(stats.chi2.sf(each * float(np.sum(ratios)) / DOUBTED, each * ratios.size))
    tests = [float(stats.t.sf(statistic, ratios.size - 1)), rare]
    for number in rows.static:
        errors = rows.residual[rows.recording == number]
        tests.append(float(stats.chi2.sf(float(errors @ errors) / DOUBTED, errors.size)))
    return Excess(mean, min(1.0, len(tests) * min(tests)))
