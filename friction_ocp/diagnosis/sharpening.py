"""Models that leave no more than noise, fitted with the noise of their measured inputs as unknowns.

With the noise of every sample an unknown, no model is favoured for answering less to noise that its machine does not
answer to (`unknown_noise.py`). But what misses much would call that noise: it is judged as before.
"""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.diagnosis.easing import along
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import WITHIN, Footing
from friction_ocp.diagnosis.kinks import freed, loosened
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.options import level_of
from friction_ocp.diagnosis.polishing import polished, timed
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.unknown_noise import blurred, noise_moves, tellable_inputs
from friction_ocp.simulation.grid import FloatArray


def fitted_sharply(fitted: FittedModel, guesses: FloatArray) -> FittedModel:
    """Fit a model again on a sharpened footing; the same where there is none, or where more than noise is left there.

    From where it stands, which noise may have drawn far from the truth, and from the guesses.
    """
    model, foot = fitted.model, sharpened(fitted.model, fitted.footing)
    if foot is fitted.footing or fitted.astray:
        return fitted
    here = along(foot.training(model), fitted.linear.program, fitted.linear.point)
    starts = [polished(model, foot, fitted.theta, here.nodes), polished(model, foot, guesses, None)]
    found = freed(min((loosened(timed(start)) for start in starts), key=lambda end: end.objective))
    return fitted if innovations(found).significant(level_of(model.problem)) else found


def seen_on(foot: Footing, fitted: FittedModel) -> FittedModel:
    """Return a model at its parameters on another footing, its nodes where they are best."""
    program = foot.training(fitted.model)
    point = solve_nodes(program, along(program, fitted.linear.program, fitted.linear.point))
    return FittedModel(fitted.model, foot, linear_program(program, point))


def sharpened(model: Model, foot: Footing) -> Footing:
    """Return a footing on which the noise of measured inputs is an unknown of every sample.

    The same where it moves no channel within a segment by more than segments bear, where recordings are too long or not
    sampled as their inputs are, and where torque noise is stated: that moves the machine.
    """
    stated = bool(model.problem.estimation.process_noise)
    if foot.noisy_inputs or not foot.joined or stated:
        return foot
    inputs = tellable_inputs(model, foot.train)
    if not inputs or not noise_moves(model, foot, WITHIN):
        return foot
    return replace(foot, noise=blurred(model, foot), noisy_inputs=inputs)
