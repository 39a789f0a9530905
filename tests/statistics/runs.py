"""The small axis of the estimator's tests, with what its statistics need."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from axes import CURRENT, axis, fitted_axis, measured_axis, problem

from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.execution.executor import InProcess
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Recording
from friction_ocp.statistics.execution import Execution

HERE = Execution(InProcess())


@cache
def run_of(seed: int) -> Recording:
    """Return a run of the plant."""
    return measured_axis(seed)


def right_problem(**estimation: Any) -> Problem:
    """Return the problem whose model is that of the plant: two runs."""
    return fitted_axis(run_of(1), run_of(2), **estimation)


def coloured_problem(runs: int = 2) -> Problem:
    """Return the problem with a slow wander on the encoder that no model explains."""
    uses = []
    for seed in range(1, runs + 1):
        recording = run_of(seed)
        channel = recording.channels["position"]
        wander = 0.05 * np.sin(7.0 * channel.time + seed) + 0.03 * np.sin(23.0 * channel.time)
        channels = {**recording.channels, "position": replace(channel, values=channel.values + wander)}
        uses.append(RecordingUse(replace(recording, channels=channels)))
    return replace(fitted_axis(run_of(1)), train=tuple(uses))


def with_law(law: Any, *seeds: int, validation: tuple[int, ...] = (), **estimation: Any) -> Problem:
    """Return a problem about the plant with another law, its inertia fitted too."""
    base = fitted_axis(*(run_of(seed) for seed in seeds), **estimation)
    (shaft,) = base.drive.shafts
    shafts = (replace(shaft, friction=replace(shaft.friction, law=law)),)
    uses = tuple(RecordingUse(run_of(seed)) for seed in validation)
    return replace(base, drive=replace(base.drive, shafts=shafts), validation=uses)


__all__ = [
    "CURRENT",
    "HERE",
    "CoulombViscous",
    "Free",
    "axis",
    "coloured_problem",
    "problem",
    "right_problem",
    "with_law",
]
