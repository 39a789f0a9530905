"""The way back from an addition that does nothing which the parameters of the model could not do as well.

A scale of the only encoder is inertia, stiffness and friction of another size. Such an addition helps a fit out of
where it was caught, and without it the fit is caught again, unless it goes back step by step.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg as _linalg  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.polishing import QUICK, polished
from friction_ocp.estimation.model import Model
from friction_ocp.simulation.grid import FloatArray

linalg: Any = _linalg  # its own types are incomplete

STEPS = 5
LEFT = 0.1
"""Share of what an addition does to the residuals that the other parameters may leave: none, were steps small."""


def led_back(current: FittedModel, simpler: Model) -> FloatArray | None:
    """Return parameters of a simpler model that do what the current model does; None where it lacks what that has.

    The numbers that are parameters of the current model alone go to what the simpler one states, and all others as they
    make up for it to first order.
    """
    names = current.model.space.names
    gone = [k for k, name in enumerate(names) if name not in simpler.space.names]
    stated = simpler.space.numbers_by_path(simpler.space.guess, simpler.train[0].name)
    if not gone or any(names[k] not in stated for k in gone):
        return None
    course = _course(current.theta[gone], np.array([stated[names[k]] for k in gone]))
    if _made_up_for(current, gone, course[0]) is None:
        return None
    at = current
    for value in course:
        step = _made_up_for(at, gone, value)
        theta = at.theta if step is None else at.theta + step
        held, bounds = at.model.space, (at.model.space.lower.copy(), at.model.space.upper.copy())
        for bound in bounds:
            bound[gone] = value
        space = replace(held, lower=bounds[0], upper=bounds[1])
        at = polished(replace(at.model, space=space), at.footing, theta, None, QUICK)
    return simpler.space.with_known(at.values)


def _course(begin: FloatArray, end: FloatArray) -> list[FloatArray]:
    """Return values between two, by equal factors where both have the same sign."""
    alike = begin * end > 0
    factor = np.where(alike, end / np.where(alike, begin, 1.0), 1.0)
    shares = np.arange(1, STEPS + 1) / STEPS
    return [np.where(alike, begin * factor**share, begin + share * (end - begin)) for share in shares]


def _made_up_for(at: FittedModel, gone: list[int], value: FloatArray) -> FloatArray | None:
    """Return (parameters,) the step to new values of some that changes the residuals least; None where that is much."""
    jacobian = at.linear.rows.jacobian
    others = [k for k in range(jacobian.shape[1]) if k not in gone]
    change: FloatArray = value - at.theta[gone]
    done = jacobian[:, gone] @ change
    scale = np.maximum(np.linalg.norm(jacobian[:, others], axis=0), 1e-300)
    answer: FloatArray = linalg.lstsq(jacobian[:, others] / scale, -done)[0] / scale
    step = np.zeros(at.theta.size)
    step[gone], step[others] = change, answer
    if np.linalg.norm(done + jacobian[:, others] @ answer) > LEFT * np.linalg.norm(done):
        return None
    return step
