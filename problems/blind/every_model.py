"""The second baseline: fit every model with one effect and take the one with the lowest left-out error.

It uses the effects, fits and left-out errors of the package, so that only what a diagnosis adds is compared: the tests
of significance, the probabilities, and the competition of what is unknown. To save time only the models of the largest
predicted gains are fitted, which can only help it.
"""

from __future__ import annotations

import numpy as np

from blind.judging import Pair
from friction_ocp import FrictionOcpError, Problem
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import held_out
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.screen import Screened, screen
from friction_ocp.effects.registry import candidates, effects
from friction_ocp.estimation.model import prepare

FITTED = 12
"""Models that are fitted."""


def answer(problem: Problem) -> Pair | None:
    """Return the effect and place of the model with the lowest left-out error; None where it is the base model."""
    base = fit_base(prepare(problem))
    clues = clues_of(base)
    costs: dict[Pair | None, float] = {None: float(np.sum(held_out(base)))}
    entries = candidates(problem.drive, problem.diagnosis.get("effects") or list(effects()))
    found = [screen(base, effect, place, clues) for effect, place in entries]
    promising = sorted((item for item in found if item is not None), key=lambda item: -item.gain)[:FITTED]
    for item in promising:
        costs[item.key] = _left_out(base, item)
    return min(costs, key=costs.__getitem__)


def _left_out(base: FittedModel, item: Screened) -> float:
    try:
        cost = float(np.sum(held_out(completed(quick_refit(base, item)))))
    except (FrictionOcpError, np.linalg.LinAlgError):
        return np.inf
    return cost if np.isfinite(cost) else np.inf
