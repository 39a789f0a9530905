"""Parameters in coordinates of their bounds, random starts, and points made to obey the constraints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from friction_ocp.estimation.parameter_space import ParameterSpace

FloatArray = npt.NDArray[np.float64]

START_FACTOR = np.sqrt(10.0)
SHARE_OF_BOUNDS = 0.1
"""Where a guess is zero, a random start is drawn within this share of the bounds."""


@dataclass(frozen=True)
class ParameterBox:
    """The bounds of a problem, as a unit cube with constraints."""

    space: ParameterSpace

    def to_unit(self, theta: FloatArray) -> FloatArray:
        """Return coordinates in which the bounds are 0 and 1."""
        return (theta - self.space.lower) / (self.space.upper - self.space.lower)

    def from_unit(self, unit: FloatArray) -> FloatArray:
        """Return parameters from coordinates in which the bounds are 0 and 1."""
        return self.space.clip(self.space.lower + unit * (self.space.upper - self.space.lower))

    def repaired(self, theta: FloatArray, rounds: int = 10) -> FloatArray:
        """Return a nearby point that obeys the constraints: violated ones are projected on, in scaled coordinates."""
        if self.space.constraints is None:
            return theta
        for _ in range(rounds):
            margins, rows = (np.asarray(item) for item in self.space.constraints(theta))
            violated = margins.ravel() < 0
            if not np.any(violated):
                break
            scaled = rows.reshape(-1, theta.size)[violated] * self.space.scale
            step = np.linalg.pinv(scaled) @ -margins.ravel()[violated]
            theta = self.space.clip(theta + self.space.scale * step)
        return theta

    def random_start(self, rng: np.random.Generator) -> FloatArray:
        """Return a start within a factor sqrt(10) of each guess, inside the bounds; log-uniform."""
        space = self.space
        factor = START_FACTOR ** rng.uniform(-1.0, 1.0, space.guess.size)
        span = np.where(np.isfinite(space.upper - space.lower), space.upper - space.lower, space.scale)
        shift = SHARE_OF_BOUNDS * span * rng.uniform(-0.5, 0.5, space.guess.size)
        return space.clip(np.where(space.guess != 0, space.guess * factor, shift))
