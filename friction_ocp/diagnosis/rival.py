"""A candidate after its refit: numbers that it is weighed by, and the fit itself for whoever looks at it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from friction_ocp.diagnosis.exactness import exactness
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.effects.effect import Key
from friction_ocp.simulation.grid import FloatArray

TOLD = 3.0
"""Log-likelihood between two sets of residuals from which recordings tell them apart: odds of 20 to 1."""


def is_another(screened: Screened, fitted: FittedModel) -> bool:
    """Whether the parameters of a candidate end where they mean another effect."""
    return any(fitted.at_bound(path) for path in screened.augmentation.inside)


@dataclass(frozen=True)
class Standing:
    """What is asked of every refit."""

    cost: float
    """What models are compared by where they were fitted (`FittedModel.cost`)."""
    objective: float
    size: float
    """Root of the sum of squares of the channels' residuals."""
    determined: int
    """Parameters that are not at a bound."""
    values: Mapping[str, float]
    """Fitted values by name."""
    material: bool = True
    """Whether it takes away more than the floors are in doubt by, and is the effect that it is called: its parameters
    lie where they mean that; only a refit that is to be added is asked."""
    prior: float = 0.0
    """What the distance of fitted values from stated ones costs."""
    exactness: float = 0.0
    """What it costs that periods, which might be any, came out as they did, beside the price of a parameter."""

    @classmethod
    def of(cls, fitted: FittedModel, material: bool = True) -> Standing:
        """Look at a fit."""
        size = float(np.linalg.norm(_errors(fitted)))
        own = fitted.linear.rows
        prior = 0.5 * float(np.sum(own.residual[own.recording < 0] ** 2))
        exact = exactness(fitted)
        return cls(fitted.cost, fitted.objective, size, fitted.determined, fitted.values, material, prior, exact)


@dataclass(frozen=True)
class Rival:
    """A candidate that was refitted, and what it gains on recordings left out."""

    screened: Screened
    standing: Standing
    gains: FloatArray
    """(blocks,) decrease of the held-out objective against the model without it; NaN where that was not looked at."""
    seat: Callable[[], FittedModel]
    """Sets up the fit, which takes longer than most rivals are worth."""

    @classmethod
    def of(cls, screened: Screened, fitted: FittedModel, gains: FloatArray) -> Rival:
        """Return a candidate whose fit is set up already."""
        return cls(screened, Standing.of(fitted), gains, lambda: fitted)

    @property
    def key(self) -> Key:
        """Effect and component."""
        return self.screened.key

    @cached_property
    def fitted(self) -> FittedModel:
        """The fit."""
        return self.seat()

    def refitted(self, fitted: FittedModel, gains: FloatArray) -> Rival:
        """Return the same candidate with another fit."""
        return Rival.of(self.screened, fitted, gains)


def is_same(one: Rival, other: Rival) -> bool:
    """Whether two rivals leave the same residuals, as far as a likelihood can tell.

    Vectors of lengths that differ by more are further apart than that.
    """
    if 0.5 * (one.standing.size - other.standing.size) ** 2 >= TOLD:
        return False
    left = [_errors(item.fitted) for item in (one, other)]
    return left[0].size == left[1].size and 0.5 * float(np.sum((left[0] - left[1]) ** 2)) < TOLD


def _errors(fitted: FittedModel) -> FloatArray:
    rows = fitted.linear.rows
    return rows.residual[rows.channel >= 0]
