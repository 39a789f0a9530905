"""Ways out of the ends that the kinks of exact friction make."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.estimation.around_kinks import around_kinks
from friction_ocp.estimation.node_ends import WARM
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.rough_bowl import stepped_out, unstuck
from friction_ocp.execution.effort import piece


def freed(fitted: FittedModel) -> FittedModel:
    """Go on through friction with a smoothed sign, and back; keep what came in where that leads to nothing better.

    A shaft that sticks in the model and slides in truth, or the reverse, is an end whose derivatives show nothing: it
    stays there whatever the parameters are, and looks like a torque that the model lacks.
    """
    if not fitted.theta.size:
        return fitted
    with piece():
        return _moved(fitted, _freed(fitted))


def _freed(fitted: FittedModel) -> Point:
    program, point = fitted.linear.program, fitted.linear.point
    if fitted.footing.noisy_inputs:
        return stepped_out(fitted.model, program, unstuck(fitted.model, program, point))
    beyond = around_kinks(fitted.model, program, point, WARM)
    best = beyond.point if beyond.objective < fitted.objective else point
    return unstuck(fitted.model, program, best)


def _moved(fitted: FittedModel, point: Point) -> FittedModel:
    program = fitted.linear.program
    return fitted if point is fitted.linear.point else replace(fitted, linear=linear_program(program, point))


def loosened(fitted: FittedModel) -> FittedModel:
    """Go on from fresh nodes, or from those that friction with a hardly smoothed sign leads to, if that leads on."""
    return _moved(fitted, unstuck(fitted.model, fitted.linear.program, fitted.linear.point))
