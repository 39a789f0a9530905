"""Nights that are unlike the others of their series."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.fleet.scatter import levels_of
from friction_ocp.simulation.grid import FloatArray

stats: Any = _stats  # its own types are incomplete

FEWEST = 5
"""Nights from which one can be unlike the others."""


def unlikeness(design: FloatArray, value: FloatArray, std_error: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n,) distances of each night from what the others predict, in its own deviations, and their p-values.

    The externally studentised residual: line and scatter of the nights come from all nights but this one. Its
    distribution is Student's t, exactly so for fits of equal standard error. A night whose fit is better than those
    that the scatter was learnt from has fewer degrees of freedom: its variance is known less well, by the delta method
    on the squares that the scatter is found from. Sources: Cook & Weisberg 1982, section 2.2.2; Satterthwaite 1946.
    """
    count = value.size
    lines = levels_of(design, value, std_error, ~np.eye(count, dtype=np.bool_))
    freedom = count - 1 - design.shape[1]
    if freedom < 1:
        return np.zeros(count), np.ones(count)
    expected = np.array([design[k] @ line.coefficients for k, line in enumerate(lines)])
    own = np.array([std_error[k] ** 2 + line.night_scatter**2 for k, line in enumerate(lines)])
    doubt = np.array([design[k] @ line.covariance @ design[k] for k, line in enumerate(lines)])
    known = np.minimum(own * np.array([line.weight for line in lines]), 1.0) ** 2
    distance = (value - expected) / np.sqrt(np.maximum(own + doubt, 1e-300))
    return distance, np.asarray(2.0 * stats.t.sf(np.abs(distance), freedom * known), dtype=np.float64)
