"""Which parameters act only through motions that are faster than the recordings were sampled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_ocp.drive.linear import ComplexArray, linearise
from friction_ocp.drive.values import bind_drive
from friction_ocp.estimation.model import Model
from friction_ocp.simulation.grid import BoolArray, FloatArray

STEP = 1e-3
"""Relative change of a parameter whose effect on the modes is looked at."""
OSCILLATES = 1e-6
"""Imaginary part of a pole over its size from which it is one of an oscillation."""
SHAPING = 0.1
"""Relative change of a pole over that of a parameter from which the parameter shapes the mode."""


def beyond_sampling(model: Model, theta: FloatArray, asked: BoolArray) -> BoolArray:
    """Return which of the parameters `asked` shape oscillations of the drive at rest, all of them beyond the log.

    A mode is beyond the log where its frequency exceeds half the rate at which any output channel of any recording was
    sampled: its course between two samples is not recorded, nor is that of the input that excites it.
    """
    found = np.zeros(theta.size, dtype=bool)
    if not np.any(asked) or not model.train:
        return found
    limit = 0.5 * max(_rates(model), default=np.inf)
    poles = _oscillations(model, theta)
    if not np.any(np.abs(poles) > 2.0 * np.pi * limit):
        return found
    for k in np.flatnonzero(asked):
        shaped = np.abs(poles)[_elasticity(model, theta, poles, int(k)) > SHAPING]
        found[k] = shaped.size > 0 and bool(np.all(shaped > 2.0 * np.pi * limit))
    return found


def _rates(model: Model) -> list[float]:
    """Return the sampling rates of all outputs of all training recordings, Hz."""
    names = [channel.name for channel in model.problem.drive.outputs]
    times: Sequence[FloatArray] = [use.recording.channels[name].time for use in model.problem.train for name in names]
    return [1.0 / float(np.median(np.diff(time))) for time in times if time.size > 1]


def _oscillations(model: Model, theta: FloatArray) -> ComplexArray:
    """Return the poles of oscillations about rest, 1/s; dry friction holds there and oscillates with nothing."""
    numbers = model.space.numbers(theta, model.train[0].name)
    drive = bind_drive(model.problem.drive, dict(zip(model.drive.parameter_names, map(float, numbers), strict=True)))
    poles = linearise(drive).poles
    return poles[poles.imag > OSCILLATES * np.abs(poles)]


def _elasticity(model: Model, theta: FloatArray, poles: ComplexArray, k: int) -> FloatArray:
    """Return (poles,) relative change of each pole over the relative change of a parameter."""
    moved = theta.copy()
    moved[k] *= 1.0 + STEP
    others = _oscillations(model, moved)
    if others.size == 0:
        return np.full(poles.size, np.inf)
    return np.min(np.abs(others[None, :] - poles[:, None]), axis=1) / np.abs(poles) / STEP
