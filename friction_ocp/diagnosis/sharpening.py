"""Models that leave no more than noise, fitted with the noise of their measured inputs as unknowns.

Where the noise of a measured current moves a fine encoder within two samples by more than the encoder's own noise, a
model is judged by how much it answers to noise that its machine does not answer to: gaps are laid for one inertia, and
a rotor that is stated rightly looks too light. With the noise of every sample an unknown, none is favoured. But what
misses much would call that noise: it is judged as before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.easing import along
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import Footing, group_density, within
from friction_ocp.diagnosis.kinks import freed, loosened
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.options import level_of
from friction_ocp.diagnosis.polishing import polished, timed
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.torque_noise import SHORTEST, driving, seen_variance
from friction_ocp.parameters import is_off
from friction_ocp.simulation.grid import FloatArray

LATE = 0.01
"""Share of a sampling interval by which a node may miss a sample."""
MOST_SAMPLES = 30_000
"""Samples of all recordings together up to which the noise of each is an unknown: more cost time."""


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

    The same where it moves no channel by more than that shows itself, where recordings are too long or not sampled as
    their inputs are, and where torque noise is stated: that moves the machine.
    """
    stated = bool(model.problem.estimation.process_noise)
    if foot.noisy_inputs or not foot.joined or stated:
        return foot
    first = model.train[0]
    if not np.any(within(model, foot, first, SHORTEST * float(np.median(first.grid.dt))) > model.noise**2):
        return foot
    turning = driving(model.problem.drive, foot.numbers[model.train[0].name])
    inputs = tuple(dict.fromkeys(channel.name for _, channel, _ in turning))
    if sum(item.grid.time.size for item in foot.train) > MOST_SAMPLES or not _in_step(foot.train, model, inputs):
        return foot
    blurred = np.sqrt(model.noise**2 + _late(model, foot, first))
    return replace(foot, noise=blurred, noisy_inputs=inputs)


def _late(model: Model, foot: Footing, item: Experiment) -> FloatArray:
    """Return (outputs,) the variance of what delays of half a sample leave out of the noise that moves a channel.

    They are expanded about the nearest sample to as many derivatives of the motion as are known: not to the rate of
    an acceleration, which with noise that runs in lines changes by sqrt(2) of its deviation a sample.
    """
    mech, step = model.drive.mechanism, float(np.median(item.grid.dt))
    rate = np.sqrt(2.0) * group_density(model, foot, item.name) / step**1.5
    unknown = np.zeros((1, len(mech.state_names), len(mech.state_names)))
    for k, group in enumerate(mech.angle_groups):
        unknown[0, k, k] = (rate[group] * (0.5 * step) ** 3 / 6.0) ** 2
    for k, group in enumerate(mech.free_groups, len(mech.angle_groups)):
        unknown[0, k, k] = (rate[group] * (0.5 * step) ** 2 / 2.0) ** 2
    late = np.array([not is_off(channel.delay) or bool(channel.clock) for channel in model.problem.drive.outputs])
    return np.where(late, seen_variance(mech, foot.numbers[item.name], unknown), 0.0)


def _in_step(items: Sequence[Experiment], model: Model, inputs: Sequence[str]) -> bool:
    """Whether recordings have a node at every sample of some inputs, and at no other time."""
    named = {use.name: use.recording for use in model.problem.recordings}
    for item in items:
        times, near = item.grid.time, LATE * float(np.median(item.grid.dt))
        for name in inputs:
            samples = named[item.name].channels[name].time
            own = samples[(samples >= times[0] - near) & (samples <= times[-1] + near)]
            if own.size != times.size or not np.allclose(own, times, rtol=0.0, atol=near):
                return False
    return True
