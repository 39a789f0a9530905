"""What free periods are worth: what might have any and comes out as once a turn is the less likely cause."""

from __future__ import annotations

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.estimation.uncertainty import inverse_information

PERIOD = ".period"
"""How the names of periods end."""


def exactness(fitted: FittedModel) -> float:
    """Return what the marginal likelihood falls by, over all free periods, for how exactly they are told.

    By the share of its bounds that a period may lie in: the information about it grows with the third power of a
    recording's length, not with the first as Schwarz's price of a parameter has it. What has a period of its own that
    ends where another effect's is by nature, such as once a turn, is the less likely one. Source: Djuric 1998.
    """
    space = fitted.model.space
    periodic = np.array([name.partition("@")[0].endswith(PERIOD) for name in space.names], dtype=bool)
    own = np.flatnonzero(periodic & (space.lower > 0.0) & np.isfinite(space.upper))
    jacobian = fitted.linear.rows.jacobian
    if not own.size or not np.all(np.isfinite(jacobian)):  # what breaks down has no errors, and no part in a choice
        return 0.0
    told, untold = inverse_information(jacobian.T @ jacobian)
    error = np.sqrt((np.diag(told) + np.diag(untold))[own]) / np.abs(fitted.theta[own])
    most = np.log(space.upper[own] / space.lower[own])
    return float(np.sum(np.log(np.maximum(most / (np.sqrt(2.0 * np.pi) * error), 1.0))))
