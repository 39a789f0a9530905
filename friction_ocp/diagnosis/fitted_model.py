"""A model at its best parameters on a footing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks, blocks_of
from friction_ocp.diagnosis.easing import FAR, missed
from friction_ocp.diagnosis.footing import Footing
from friction_ocp.diagnosis.linear import LinearProgram
from friction_ocp.diagnosis.own_noise import gap_prices, with_own_noise
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_ends import STEPS_OF_NODES
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.execution.effort import once
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

AT_ODDS = 5.0
"""Standard deviations of its prior from which a fitted value stands in for what is missing, or the prior is wrong."""


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A model at its best parameters on a footing; two of them are never the same."""

    model: Model
    footing: Footing
    linear: LinearProgram

    @property
    def theta(self) -> FloatArray:
        """(parameters,)."""
        return self.linear.point.theta

    @property
    def values(self) -> dict[str, float]:
        """Fitted values by name."""
        return dict(zip(self.model.space.names, map(float, self.theta), strict=True))

    @property
    def determined(self) -> int:
        """The number of parameters that lie within their bounds, not at one."""
        low, high = self.model.space.ends(self.theta)
        return int(np.sum(~low & ~high))

    def at_bound(self, name: str) -> bool:
        """Whether a parameter lies at one of its bounds; not where its value is stated."""
        low, high = self.model.space.ends(self.theta)
        return bool(dict(zip(self.model.space.names, low | high, strict=True)).get(name, False))

    @property
    def objective(self) -> float:
        """The cost of all residuals: half their sum of squares, or what the loss makes of them."""
        return self.linear.program.objective(self.linear.point) + self._unseen

    @property
    def holds(self) -> bool:
        """Whether the simulation does not break down."""
        return bool(np.isfinite(self.objective))

    @property
    def missed(self) -> float:
        """The power of the residuals over that of noise."""
        return missed(self.linear.program, self.linear.point)

    @property
    def astray(self) -> bool:
        """Whether something so large is missing that the parameters that the fit has found say little."""
        return FAR < self.missed < np.inf

    @property
    def at_odds(self) -> bool:
        """Whether the fit has moved a parameter far beyond what its prior allows."""
        return bool(np.any(np.abs(self.model.space.prior_deviations(self.theta)) > AT_ODDS))

    @property
    def lost(self) -> bool:
        """Whether it is free runs over whole recordings that have gone astray: they have many ends, most far off."""
        return self.astray and self.footing.segment_s is None

    @property
    def leads_loosely(self) -> bool:
        """Whether lost free runs are judged as loosely joined segments are, by squares, so that fits of these lead."""
        return self.lost and isinstance(self.footing.loss, Squares)

    @cached_property
    def blocks(self) -> Blocks:
        """Blocks of the residuals."""
        return blocks_of(self.linear.rows)

    @cached_property
    @once
    def cost(self) -> float:
        """The same with the noise that this model's own inertia would show: what models are compared by."""
        program, wider = with_own_noise(self.linear.program, self.model, self.footing, self.theta)
        point = solve_nodes(program, self.linear.point, STEPS_OF_NODES)
        cuts = zip(self.linear.recordings, program.segments, wider, strict=True)
        prices = sum(float(np.sum(gap_prices(item, cut, part))) for item, cut, part in cuts)
        return program.objective(point) + prices + self._unseen

    @property
    def _unseen(self) -> float:
        """What samples that reading late channels earlier lost count for, lest losing them looks like a gain."""
        program = self.linear.program
        return sum(float(np.sum(program.lost_costs(k))) for k in range(len(program.experiments)))
