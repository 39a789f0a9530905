"""How far one model leads another on what was held out, and how much of that is chance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.estimate import Estimate
from friction_ocp.estimation.uncertainty import reach95
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.block_length import effective_size
from friction_ocp.statistics.scores import held_out_densities


@dataclass(frozen=True)
class Lead:
    """Held-out log-likelihood of one model less that of another."""

    difference: float
    chance: float
    """Half the 95 % interval of the difference."""

    @property
    def tied(self) -> bool:
        """Whether the difference may be chance."""
        return abs(self.difference) <= self.chance


def held_out_lead(best: Estimate, other: Estimate, sizes: Mapping[str, float]) -> Lead:
    """Return the lead of one model over another in held-out likelihood.

    Its standard error is that of the sum of differences between the log densities of single samples, which count
    as far as they are independent. Source: Vuong 1989, eq. 5.6.
    """
    pairs = tuple(zip(held_out_densities(best, sizes), held_out_densities(other, sizes), strict=True))
    leads = [ours.values - theirs.values for ours, theirs in pairs]
    counts = [
        effective_size(lead) if ours.correlated else float(lead.size)
        for lead, (ours, _) in zip(leads, pairs, strict=True)
    ]
    std_error = float(np.sqrt(sum(_variance(lead, count) for lead, count in zip(leads, counts, strict=True))))
    freedom = max(1.0, sum(counts) - len(counts))
    return Lead(float(sum(np.sum(lead) for lead in leads)), reach95(freedom) * std_error)


def _variance(lead: FloatArray, independent: float) -> float:
    """Return the variance of the sum of samples of which so many are independent."""
    spread = float(np.sum((lead - lead.mean()) ** 2)) / max(lead.size - 1, 1)
    return lead.size**2 * spread / independent
