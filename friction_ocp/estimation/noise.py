"""The noise floor of a channel, which never comes from the fit under test, and the torque noise of a shaft."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.recording.conditioning import detect_resolution, high_frequency_noise
from friction_ocp.simulation.grid import FloatArray


@dataclass(frozen=True)
class NoiseFloor:
    """Standard deviation of the measurement noise, SI, and where the number comes from."""

    std: float
    source: str


LevelWord = Literal["ok", "at_bound", "not_identifiable"]


@dataclass(frozen=True)
class NoiseLevel:
    """Torque noise of one shaft, N m/sqrt(Hz); N/sqrt(Hz) where the motion is linear."""

    shaft: str
    value: float
    std_error: float
    """NaN where the recordings do not tell it."""
    interval95: tuple[float, float]
    """Normal in the logarithm of the level."""
    verdict: LevelWord
    unit: str


def noise_floor(channel: Channel, signals: list[tuple[FloatArray, FloatArray]]) -> NoiseFloor:
    """Return the floor in the order of trust: stated, resolution, repeated runs, high frequencies.

    `signals` holds (time, values) of the channel in every recording.
    """
    if channel.noise_std is not None:
        return NoiseFloor(channel.noise_std, "noise_std")
    if channel.resolution is not None:
        return NoiseFloor(channel.resolution / math.sqrt(12.0), "resolution")
    repeated = _repeated_runs(signals)
    if repeated is not None:
        return NoiseFloor(repeated, "repeated_runs")
    floors = [high_frequency_noise(time, values) for time, values in signals]
    known = [floor for floor in floors if math.isfinite(floor) and floor > 0]
    if known:
        return NoiseFloor(float(np.median(known)), "high_frequency")
    steps = [step for step in (detect_resolution(values) for _, values in signals) if step is not None]
    if steps:
        return NoiseFloor(min(steps) / math.sqrt(12.0), "resolution")
    spread = max((float(np.nanstd(values)) for _, values in signals), default=1.0)
    return NoiseFloor(1e-3 * spread if spread > 0 else 1.0, "assumed")


def step_of(channel: Channel, values: FloatArray) -> float | None:
    """Return the step of a channel, as stated or as its values show it."""
    return detect_resolution(values) if channel.resolution is None else channel.resolution


def _repeated_runs(signals: list[tuple[FloatArray, FloatArray]]) -> float | None:
    """Return the deviation between runs that follow the same path at the same times, None where there are none."""
    variances: list[float] = []
    for k, (time, values) in enumerate(signals):
        for other_time, other in signals[k + 1 :]:
            if time.shape != other_time.shape or not np.allclose(time - time[0], other_time - other_time[0]):
                continue
            difference = values - other
            if np.nanstd(difference) < 0.02 * np.nanstd(values):
                variances.append(0.5 * float(np.nanvar(difference)))
    return math.sqrt(float(np.mean(variances))) if variances else None
