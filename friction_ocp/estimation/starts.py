"""Starts spread evenly around the guesses of a problem."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import qmc as _qmc  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.simulation.grid import FloatArray

qmc: Any = _qmc  # its own types are incomplete

SPREAD = 0.5
"""Decades to either side: a factor sqrt(10)."""


def start_points(space: ParameterSpace, count: int, seed: int) -> list[FloatArray]:
    """Return the guess and `count` - 1 points of a Latin hypercube within a factor sqrt(10) of it, inside the bounds.

    A guess of zero has no factors: its starts lie within the typical size of the parameter about it.
    """
    points = [space.guess]
    if count > 1:
        cube = qmc.LatinHypercube(space.guess.size, rng=np.random.default_rng(seed))
        spread: FloatArray = 2.0 * np.asarray(cube.random(count - 1), dtype=np.float64) - 1.0
        moved = np.where(space.guess != 0, space.guess * 10.0 ** (SPREAD * spread), space.scale * spread)
        points += [space.clip(point) for point in moved]
    return points
