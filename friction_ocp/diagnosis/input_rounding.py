"""Errors of rounding of the measured inputs: a current that stays at one count errs by the same for long.

Noise that is counted as white averages out over a stretch of time, this error does not: it is a slow torque.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.linalg as _linalg  # pyright: ignore[reportMissingTypeStubs]
import scipy.ndimage as _ndimage  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import LinearRecording
from friction_ocp.diagnosis.rounding import wave_powers
from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.drive_noise import input_noise
from friction_ocp.estimation.noise import step_of
from friction_ocp.estimation.torque_noise import driving
from friction_ocp.simulation.grid import FloatArray, IntArray

linalg: Any = _linalg  # its own types are incomplete
ndimage: Any = _ndimage  # its own types are incomplete

STRETCHES = 24
"""Of time, of equal length, in each recording."""
SMALL = 1.0 / 16.0
"""Noise of a running mean of an input over a count: with as much the finest waves that are left hardly blur."""


def input_columns(fitted: FittedModel, by_torque: Mapping[str, FloatArray]) -> FloatArray:
    """Return (rows, errors) what errors of rounding of measured inputs do slowly, each of deviation 1.

    `by_torque` (rows, stretches) holds by shaft what a torque of 1 N m over each stretch alone does. Where in a count
    an input stays is not known: its mean error over a stay is anything of its deviation.
    """
    model, found = fitted.model, [np.zeros((fitted.linear.rows.residual.size, 0))]
    numbers = fitted.footing.numbers[model.train[0].name]
    for shaft, channel, factor in driving(model.problem.drive, numbers):
        step = _step(fitted, channel)
        if step is not None and shaft in by_torque:
            found.append(factor * by_torque[shaft] @ _mean_errors(fitted, channel, step))
    return np.concatenate(found, axis=1)


def stretch_of(item: LinearRecording) -> IntArray:
    """Return (segments,) the stretch of a recording, one of STRETCHES of equal length, in which each segment lies."""
    return (np.arange(item.cut.count) * STRETCHES) // item.cut.count


def _step(fitted: FittedModel, channel: Channel) -> float | None:
    values = [use.recording.channels[channel.name].values for use in fitted.model.problem.recordings]
    return step_of(channel, np.concatenate(values))


def _mean_errors(fitted: FittedModel, channel: Channel, step: float) -> FloatArray:
    """Return (stretches, stays) the mean errors of an input over the stretches of all recordings, in its unit.

    A stay is one stretch, or several in a row within a count, whose errors are one of deviation 1. The error is a sum
    of waves over one count (rounding.py), which average out as the input moves.
    """
    noise, _ = input_noise(fitted.model, channel)
    powers = wave_powers(step, noise) * noise**2
    waves = 2j * np.pi * np.arange(1, powers.size + 1)[:, None] / step
    column, found = fitted.model.drive.input_names.index(channel.name), list[FloatArray]()
    for item in fitted.linear.recordings:
        stretch = stretch_of(item)[item.segment]
        marks = (stretch == np.arange(STRETCHES)[:, None]).astype(float)
        marks /= np.maximum(marks.sum(axis=1, keepdims=True), 1.0)
        smooth = _smooth(item.item.grid.at_node[:, column], noise, step)
        sizes: FloatArray = np.sqrt(powers @ np.abs(np.exp(waves * smooth) @ marks.T) ** 2)
        stay = _stays(np.array([np.median(smooth[stretch == k]) for k in range(STRETCHES)]), step)
        of_stay = np.zeros((STRETCHES, int(stay[-1]) + 1))
        of_stay[np.arange(STRETCHES), stay] = sizes
        found.append(of_stay)
    return np.asarray(linalg.block_diag(*found))


def _smooth(values: FloatArray, noise: float, step: float) -> FloatArray:
    """Return running means in which noise is a small part of a count."""
    count = min(round((noise / (SMALL * step)) ** 2), values.size)
    return np.asarray(ndimage.uniform_filter1d(values, max(count, 1), mode="nearest"))


def _stays(levels: FloatArray, step: float) -> IntArray:
    """Return (stretches,) numbers of stays: stretches in a row whose levels differ by less than half a count."""
    stay, first = np.zeros(levels.size, dtype=np.int64), 0
    for k in range(1, levels.size):
        if not abs(levels[k] - levels[first]) < 0.5 * step:
            first = k
        stay[k] = stay[k - 1] + (first == k)
    return stay
