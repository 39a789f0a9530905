"""How far free runs of one model stray from one another where noise alone sets them apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.blocks import stats
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors, excess_of
from friction_ocp.estimation.drive_noise import input_noise
from friction_ocp.estimation.experiment import Experiment, experiment
from friction_ocp.estimation.lateness import read_earlier
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.estimation.score import simulate_recordings
from friction_ocp.estimation.torque_noise import driving
from friction_ocp.simulation.grid import FloatArray

LOOKS = (5, 9, 19, 39, 69)
"""Draws of the noise after which it is asked whether a further one may go as far: together at the level."""
DRAWS = 19
"""Those that are enough where no verdict hangs on it."""
GAIN = 0.01
"""Share of what a run errs that a step has to gain where its start is looked for: more does not show in its excess."""


def strays_as_far(fitted: FittedModel, errors: FreeErrors, seed: int, level: float, held_out: bool = True) -> bool:
    """Whether runs that noise sets apart part by as much as free runs err, of what was held out or fitted.

    At a level: one run in a hundred of the same kind passes the largest of 99. No more of them are simulated than that
    takes, and few where the errors lie beyond what these tell of a further one (`_beyond`), at a part of the level
    after each of LOOKS.

    A drive whose friction falls with speed, or that is about to stick, multiplies the least difference of its start and
    of its inputs: be its model as good as it may, its free runs tell little. Nothing is linearised: measurement and
    drive of the motors get as much noise again, and what follows is simulated.
    """
    model, rng, most = fitted.model, np.random.default_rng(seed), errors.excess()
    held_out = held_out and bool(model.validation)
    uses = model.problem.validation if held_out else model.problem.train
    plain = errors.runs if held_out else simulate_recordings(model, model.train, fitted.theta)
    levels = {channel.name: input_noise(model, channel)[0] for _, channel, _ in driving(model.problem.drive, {})}
    levels |= dict(zip(model.drive.output_names, map(float, model.noise), strict=True))
    drawn = list[float]()
    for _ in range(math.ceil(1.0 / level) - 1):
        items = tuple(_with_noise(model, use, levels, rng) for use in uses)
        runs = simulate_recordings(model, items, fitted.theta, relative=GAIN)
        apart = np.concatenate([one.simulated - other.simulated for one, other in zip(runs, plain, strict=True)])
        ratios: FloatArray = np.nanmean(apart**2, axis=0) / model.noise**2
        drawn.append(excess_of(ratios))
        if drawn[-1] >= most:
            return True
        if len(drawn) in LOOKS and _beyond(most, drawn, level / len(LOOKS)):
            break
    return False


def _beyond(most: float, drawn: Sequence[float], level: float) -> bool:
    """Whether a further draw would pass a value with less probability than a level, logarithms being normal.

    By the prediction interval of Student's t; what is below the noise counts as that.
    """
    logs = np.log1p(np.array(drawn))
    reach = float(stats.t.isf(level, logs.size - 1)) * float(np.std(logs, ddof=1)) * math.sqrt(1.0 + 1.0 / logs.size)
    return math.log1p(most) > float(np.mean(logs)) + reach


def _with_noise(model: Model, use: RecordingUse, levels: dict[str, float], rng: np.random.Generator) -> Experiment:
    """Return a recording with noise of some standard deviations added to channels by name."""
    channels = dict(use.recording.channels)
    for name in sorted(levels.keys() & channels.keys()):
        channel = channels[name]
        values = channel.values + levels[name] * rng.standard_normal(channel.values.shape)
        channels[name] = replace(channel, values=values)
    noisy = replace(use, recording=replace(use.recording, channels=channels))
    laid = experiment(noisy, model.drive, model.problem.drive.inputs, model.max_step)
    return read_earlier(laid, model.drive.output_names, use.late)
