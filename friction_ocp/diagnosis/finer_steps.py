"""Fits of the diagnosis on integrator steps as short as their recordings demand."""

from __future__ import annotations

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.polishing import polished, timed
from friction_ocp.estimation.model import Model, with_step
from friction_ocp.estimation.node_ends import worthwhile
from friction_ocp.estimation.refinement import stepped_finely

SEARCHING = 1.0
"""How far, in standard errors, half the step may move a parameter while models compete: no verdict hangs on that."""


def on_short_steps(fitted: FittedModel, shift: float) -> FittedModel:
    """Fit again on shorter integrator steps where the error of those that a fit was made with shows or moves it.

    It moves it where half the step shifts a parameter by more than `shift` standard errors: the first step follows from
    the guesses, and a spring may be far harder. Not where a model is astray, or compared by short predictions because
    others of it were: there no step says more.
    """
    if fitted.astray or fitted.footing.predicted or not fitted.holds:
        return fitted
    model, _ = stepped_finely(fitted.model, fitted.linear.program, fitted.linear.point, shift)
    return on_steps_of(model, fitted)


def on_steps_of(model: Model, fitted: FittedModel) -> FittedModel:
    """Fit on the integrator steps of another model, around the kinks there; the same if they are no shorter.

    Of two fits on different steps the one on shorter ones costs less for that alone: where it costs more, a kink has
    caught it.
    """
    stepped = fitted_on(fitted, model)
    if stepped is fitted:
        return fitted
    caught = stepped.objective - fitted.objective > worthwhile(stepped.linear.program, stepped.objective)
    return freed(stepped) if caught else stepped


def fitted_on(fitted: FittedModel, model: Model) -> FittedModel:
    """Fit on the integrator steps of another model, from where the fit stands; the same if they are no shorter."""
    if fitted.model.max_step <= model.max_step:
        return fitted
    stepped = with_step(fitted.model, model.max_step)
    return timed(polished(stepped, fitted.footing, fitted.theta, fitted.linear.point.nodes))
