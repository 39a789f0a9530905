"""What a recording that has not been made would tell: about parameters, and between two models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.special as _special  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import footing
from friction_ocp.diagnosis.linear import LinearProgram, linear_program
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.noise import noise_floor
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.estimation.stages import free_run
from friction_ocp.estimation.uncertainty import inverse_information
from friction_ocp.recording.recording import Recording
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

ODDS = 99.0
"""Likelihood ratio at which one of two models counts as decided."""


@dataclass(frozen=True)
class Evidence:
    """What a recording would say between two models, one of them true."""

    separation: float
    """Squared distance of their residuals, in noise floors, after the false one has adapted: twice the expected
    logarithm of the likelihood ratio."""

    @property
    def power(self) -> float:
        """Probability that the true model is ahead by odds of 99 to 1."""
        if self.separation <= 0:
            return 0.0
        reach = (0.5 * self.separation - np.log(ODDS)) / np.sqrt(self.separation)
        return float(_special.ndtr(reach))


def evidence(fitted: FittedModel, recording: Recording) -> Evidence:
    """Return what a recording that another model made says against a fitted one, whose parameters may still adapt."""
    linear = _linear(fitted, recording)
    own = linear.rows.recording >= 0
    residual, jacobian = linear.rows.residual[own], linear.rows.jacobian[own]
    known = _known(fitted, linear.program.space.names)
    pull = jacobian.T @ residual
    told, _ = inverse_information(jacobian.T @ jacobian + known)
    closed = float(pull @ told @ pull)
    return Evidence(max(float(residual @ residual) - closed, 0.0))


def information(fitted: FittedModel, recording: Recording) -> FloatArray:
    """Return (parameters, parameters) the information in a recording, in the order of the fitted model's parameters."""
    linear = _linear(fitted, recording)
    jacobian = linear.rows.jacobian[linear.rows.recording >= 0]
    return _placed(jacobian.T @ jacobian, linear.program.space.names, fitted.model.space.names)


def known_information(fitted: FittedModel) -> FloatArray:
    """Return (parameters, parameters) the information that recordings at hand and priors give."""
    jacobian = fitted.linear.rows.jacobian
    return jacobian.T @ jacobian


def _known(fitted: FittedModel, names: tuple[str, ...]) -> FloatArray:
    return _placed(known_information(fitted), fitted.model.space.names, names)


def _placed(matrix: FloatArray, names: tuple[str, ...], wanted: tuple[str, ...]) -> FloatArray:
    """Return a matrix over other names; what has no counterpart is zero."""
    found = np.zeros((len(wanted), len(wanted)))
    shared = [name for name in wanted if name in names]
    to, of = [wanted.index(name) for name in shared], [names.index(name) for name in shared]
    found[np.ix_(to, to)] = matrix[np.ix_(of, of)]
    return found


def _linear(fitted: FittedModel, recording: Recording) -> LinearProgram:
    """Return the fitted model's program of a recording at its parameters, its states those that fit best."""
    model = prepare(_problem(fitted, recording))
    theta = model.space.with_known(fitted.values)
    foot = replace(footing(model, theta), segment_s=fitted.footing.segment_s)
    program = foot.program(model, model.train)
    freely = free_run(model, model.train, 0.0, Squares(), None)
    alone = program.point_along(freely, suggested_point(freely, theta))
    starts = [suggested_point(program, theta), alone]
    return linear_program(program, min((solve_nodes(program, start) for start in starts), key=program.objective))


def _problem(fitted: FittedModel, recording: Recording) -> Problem:
    """Return the problem of one recording with noise floors stated: a recording without noise would show none."""
    model = fitted.model
    floors = _floors(model)
    channels = tuple(replace(item, noise_std=floors[item.name]) for item in model.problem.drive.channels)
    first = model.problem.train[0]
    use = RecordingUse(replace(recording, name=first.name), first.set)
    drive = replace(model.problem.drive, channels=channels)
    estimation = replace(model.problem.estimation, max_step=model.max_step)
    return replace(model.problem, drive=drive, train=(use,), validation=(), static=(), estimation=estimation)


def _floors(model: Model) -> Mapping[str, float]:
    found = {name: floor.std for name, floor in model.floors.items()}
    for item in model.problem.drive.inputs:
        signals = [use.recording.channels[item.name] for use in model.problem.recordings]
        found[item.name] = noise_floor(item, [(one.time, one.values) for one in signals]).std
    return found
