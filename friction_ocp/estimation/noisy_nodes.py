"""Segments of one sample each, of which noise of the measured inputs is part of the nodes.

Where a fine encoder sees what the noise of a current would do to the machine, that noise is an unknown of every sample,
held by its deviation: gaps, which are laid for one inertia and join samples of which each bears on two of them, would
favour models that answer less to noise. Source: Fuller 1987, Measurement error models (functional models).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from friction_ocp.drive.input_noise import RATE, noise_states
from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.segments import Segments
from friction_ocp.simulation.grid import IntArray

EXACT, FREE = 1e-3, 1e3
"""Gap of the noise of an input over its deviation where a line leads on to the next sample, and where nothing does."""


def sampled(item: Experiment) -> IntArray:
    """Return the first nodes of segments of one sample each, the last node behind them."""
    return np.arange(item.grid.time.size, dtype=np.int64)


def with_noise(drive: SteppedDrive, item: Experiment, segments: Segments, deviation: Mapping[str, float]) -> Segments:
    """Return segments of one sample each with the noise of the noisy inputs of a drive, `deviation` by input.

    Of an input that runs in lines it is one noise at the end of a segment and at the beginning of the next.
    """
    assert segments.gap_weight is not None
    noise, rates = noise_states(drive)
    count, known, states = segments.count, segments.gap_weight.shape[1], len(drive.state_names)
    std = np.array([deviation[name] for name in drive.noisy_inputs])
    step = float(np.median(np.diff(item.grid.time)))
    rising = np.array([name + RATE in drive.state_names for name in drive.noisy_inputs])
    gaps = np.zeros((count - 1, states, states))
    gaps[:, :known, :known] = segments.gap_weight
    gaps[:, noise, noise] = 1.0 / (np.where(rising, EXACT, FREE) * std)
    gaps[: segments.measured, noise, noise] = 1.0 / (FREE * std)
    gaps[:, rates, rates] = step / (FREE * std[rising])
    start = np.zeros((count, states))
    if segments.start_weight is not None:
        start[:, :known] = segments.start_weight
    start[segments.measured :, noise] = 1.0 / std
    return Segments(segments.first, gaps, segments.measured, start)
