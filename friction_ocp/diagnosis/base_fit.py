"""The fit of the base model from its guesses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.allowance import of_base
from friction_ocp.diagnosis.easing import along, eased, finer
from friction_ocp.diagnosis.excerpts import excerpts
from friction_ocp.diagnosis.finer_steps import SEARCHING, on_short_steps
from friction_ocp.diagnosis.fitted_model import AT_ODDS, FittedModel
from friction_ocp.diagnosis.footing import Footing, footing
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.own_noise import noise_moved
from friction_ocp.diagnosis.polishing import COARSE, loosely_joined, polished, timed
from friction_ocp.diagnosis.sharpening import fitted_sharply
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.fit import fit
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_ends import WARM
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import WIDTHS, mean_error, predictions
from friction_ocp.estimation.standstill import at_rest
from friction_ocp.execution.effort import limited
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute

RELAID, MOST_RELAID = float(np.log(2.0)), 2
"""Factor, by its logarithm, between what torque noise moves where a base fit ends and where its gaps were laid, above
which they are laid anew; how often at most. A rotor that is much too light there hides what is missing later."""
BLUNT = 0.2
"""Rounding of the absolute loss over the mean error while models compete: kinks would catch a refit of a few steps."""


def fit_base(model: Model) -> FittedModel:
    """Fit the base model from its guesses and lay the footing on which all models are compared.

    Raises FrictionOcpError where no simulation of it holds.
    """
    fitted = on_short_steps(_fitted_base(model), SEARCHING)
    if not fitted.holds:
        where = f"{model.problem.path or model.problem.title}: diagnose"
        what = "the simulation of the model as it stands breaks down along the recordings"
        remedy = "start from other guesses or narrow the bounds"
        raise FrictionOcpError(Finding(where, what, "a model that can be simulated", remedy))
    return fitted


def _fitted_base(model: Model) -> FittedModel:
    rough = footing(model, model.space.guess)
    if rough.segment_s is None and model.problem.estimation.loss == "squares":
        return _free_base(model, rough)
    if rough.segment_s is None:
        fitted = fit(model)
        theta = fitted.solution.point.theta
        loss = fitted.program.loss
        if isinstance(loss, Absolute):
            loss = Absolute(BLUNT * mean_error(fitted.program, fitted.solution.point))
        return polished(model, footing(model, theta, loss), theta, None)
    program, end = _rough_answer(model)
    foot = _laid(model, end.theta)
    exact = foot.program(model, program.experiments)
    nodes = exact.point_along(program, end).nodes
    fitted = _joined(model, foot, end.theta, nodes if len(foot.train) == len(program.experiments) else None)
    for _ in range(MOST_RELAID):
        if noise_moved(fitted.linear.program, model, fitted.footing, _plausible(model, fitted.theta)) < RELAID:
            break
        fitted = _joined(model, _laid(model, fitted.theta), fitted.theta, None)
    with limited(of_base(fitted)):
        return fitted_sharply(fitted, model.space.guess)


def _laid(model: Model, theta: FloatArray) -> Footing:
    """Lay a footing at parameters, as far as their priors let them be there.

    A stated rotor that is fitted far too light stands in for what the model lacks: gaps laid for it would let torque
    noise explain all of that, and lead to a rotor that is lighter still.
    """
    return footing(model, _plausible(model, theta))


def _plausible(model: Model, theta: FloatArray) -> FloatArray:
    """Return parameters with those at odds with their priors put where these end, as many times too small as large."""
    space = model.space
    with np.errstate(invalid="ignore", divide="ignore"):
        most = 1.0 + AT_ODDS * space.prior_std / np.abs(space.prior_mean)
        ends = space.prior_mean / most, space.prior_mean * most
    known = np.isfinite(space.prior_std) & (space.prior_mean != 0.0)
    low, high = np.where(known, np.minimum(*ends), -np.inf), np.where(known, np.maximum(*ends), np.inf)
    return space.clip(np.clip(theta, low, high))


def _joined(model: Model, foot: Footing, theta: FloatArray, nodes: tuple[FloatArray, ...] | None) -> FittedModel:
    """Fit segments that torque noise joins, as a footing lays them, from a start."""
    started = polished(model, foot, theta, nodes)
    return _ended(_from_afar(started, [model.space.guess, theta]))


def predicting(fitted: FittedModel) -> FittedModel:
    """Fit a base model to short predictions from the measured motion, from its guesses and from where it stands.

    Where a model lacks much, segments that torque noise joins bear errors from one to the next, all the more where
    motion is unstable, as friction that falls with speed makes it: no parameters lead on from there. A prediction
    begins afresh, and shows its own error alone.
    """
    model, foot = fitted.model, replace(fitted.footing, predicted=True)
    ends = [polished(model, foot, theta, None) for theta in (model.space.guess, fitted.theta)]
    return min(ends, key=lambda end: end.objective)


def _from_afar(fitted: FittedModel, starts: Sequence[FloatArray]) -> FittedModel:
    """Fit again through wide gaps from some starts where the fit has missed much, on finer segments where needed."""
    if not fitted.astray:
        return fitted
    program, point, factor = fitted.linear.program, fitted.linear.point, fitted.missed
    foot, wide = finer(fitted.model, fitted.footing, starts, factor)
    finely = foot.training(fitted.model)
    begins = [along(finely, program, point), eased(finely, wide, factor)]
    best = solve_gauss_newton(finely, min(begins, key=finely.objective), WARM).point
    return FittedModel(fitted.model, foot, linear_program(finely, best))


def _free_base(model: Model, rough: Footing) -> FittedModel:
    """Fit free runs by squares from the guesses, and from where loosely joined segments lead; the better end counts."""
    starts = [model.space.guess, _rough_answer(model)[1].theta]
    best = min((_coarse(model, rough, theta) for theta in starts), key=lambda end: end.objective)
    foot = footing(model, best.theta)
    return _ended(polished(model, foot, best.theta, best.linear.point.nodes))


def _coarse(model: Model, foot: Footing, theta: FloatArray) -> FittedModel:
    program, theta = foot.training(model), model.space.clip(theta)
    start = solve_nodes(program, suggested_point(program, theta))
    return polished(model, foot, theta, start.nodes, COARSE)


def _ended(fitted: FittedModel) -> FittedModel:
    """Fit from rest, in time and around kinks, for as long as a base model may take for that."""
    with limited(of_base(fitted)):
        return freed(timed(_from_rest(fitted)))


def _from_rest(fitted: FittedModel) -> FittedModel:
    """Fit again from recordings that start at rest, where that costs less."""
    program, point = fitted.linear.program, fitted.linear.point
    resting = at_rest(program, point)
    if program.objective(resting) >= program.objective(point):
        return fitted
    return polished(fitted.model, fitted.footing, fitted.theta, resting.nodes)


def _rough_answer(model: Model) -> tuple[Program, Point]:
    """Fit on loosely joined segments, from the guesses and from short predictions."""
    short = predictions(model, excerpts(model), WIDTHS[0])
    start = suggested_point(short, model.space.guess)
    starts = [model.space.guess, solve_gauss_newton(short, start, COARSE).point.theta]
    return loosely_joined(model, starts)
