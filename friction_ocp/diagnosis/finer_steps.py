"""Fits of the diagnosis on integrator steps as short as their recordings demand."""

from __future__ import annotations

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.polishing import polished, timed
from friction_ocp.estimation.model import Model, with_step
from friction_ocp.estimation.refinement import stepped_finely


def on_short_steps(fitted: FittedModel) -> FittedModel:
    """Fit again on shorter integrator steps where the error of those that a fit was made with shows or moves it.

    The first step follows from the guesses, and a spring may be far harder. Not where a model is astray: there no
    step says more.
    """
    if fitted.astray or not fitted.holds:
        return fitted
    model, _ = stepped_finely(fitted.model, fitted.linear.program, fitted.linear.point)
    return fitted if model is fitted.model else fitted_on(fitted, model)


def fitted_on(fitted: FittedModel, model: Model) -> FittedModel:
    """Fit on the integrator steps of another model, from where the fit stands; the same if they are no shorter."""
    if fitted.model.max_step <= model.max_step:
        return fitted
    stepped = with_step(fitted.model, model.max_step)
    return freed(timed(polished(stepped, fitted.footing, fitted.theta, fitted.linear.point.nodes)))
