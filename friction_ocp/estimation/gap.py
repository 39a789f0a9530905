"""Weights of the continuity gaps: how far a state may jump between two segments."""

from __future__ import annotations

import numpy as np

from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.mechanism import WARMTH
from friction_ocp.estimation.drive_noise import TorqueNoise, input_impulses
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_gaps import gap_roots
from friction_ocp.simulation.grid import FloatArray, IntArray

RELATIVE_GAP = 0.05
"""Standard deviation of a gap over the typical size of its state, where no process noise is stated."""
AT_ONCE = 0.01
"""Share of a recording up to which a piece of it begins with it."""
COLD = 1e-4
"""Standard deviation of how far friction has warmed up where a recording starts, over its typical size."""


def gap_weights(model: Model, item: Experiment, first: IntArray) -> FloatArray:
    """Return (segments - 1, states, states) W with W'W the inverse covariance of each gap."""
    if not model.process_noise:
        return np.tile(np.diag(1.0 / (RELATIVE_GAP * model.state_scale)), (len(first) - 2, 1, 1))
    numbers = model.space.numbers_by_path(model.nominal, item.name)
    noise = TorqueNoise(model.process_noise, {item.name: numbers})
    return gap_roots(model, noise, item, first, input_impulses(model, item, numbers))


def start_weight(model: Model, item: Experiment) -> FloatArray:
    """Return (states,) 1 / standard deviation of the prior on the first state of a recording, or of a piece of one.

    States are as uncertain as they are large; but how far friction has warmed up is counted from the start of the
    recording.
    """
    weight = 1.0 / model.state_scale
    names = model.drive.input_names
    if TIME in names:
        gone = float(item.grid.at_node[0, names.index(TIME)]) / float(item.grid.time[-1] - item.grid.time[0])
        cold = np.array([name.endswith(WARMTH) and gone < AT_ONCE for name in model.drive.state_names], dtype=bool)
        weight[cold] /= COLD
    return weight
