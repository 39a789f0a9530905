"""The instants at which an acceleration jumps: a derivative cannot see them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.simulation.grid import BoolArray, FloatArray

CLEAR = 5.0 * np.sqrt(5.0)
"""Step beyond those beside it, over the noise of a channel, that noise alone does not make: five deviations."""
RARE = 0.05
"""Share of samples beside jumps."""


def without_jumps(item: Experiment, outputs: Sequence[Channel], noise: FloatArray) -> Experiment:
    """Return a recording without the samples of accelerations on both sides of a jump.

    Friction changes its sign between two samples; which of them a simulation finds behind the jump is chance.
    """
    measured = item.measured.copy()
    for k, channel in enumerate(outputs):
        if channel.signal == "alpha":
            measured[beside_jumps(measured[:, k], float(noise[k])), k] = np.nan
    return replace(item, measured=measured)


def beside_jumps(values: FloatArray, noise: float) -> BoolArray:
    """Return (n,) whether a sample lies next to a step that its neighbours do not lead up to.

    Where such steps are common they are no jumps but a vibration, and none is returned.
    """
    found = np.zeros(values.size, dtype=bool)
    step = np.diff(values)
    if step.size < 3:
        return found
    jump = np.abs(step[1:-1] - 0.5 * (step[:-2] + step[2:])) > CLEAR * noise
    found[1:-2] |= jump
    found[2:-1] |= jump
    return found if np.mean(found) < RARE else np.zeros_like(found)
