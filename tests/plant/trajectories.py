"""Functions of time that drive a plant, and test excitations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class Trajectory:
    """Values on a time grid, held (`zero`) or joined by lines (`linear`); constant beyond the ends."""

    time: np.ndarray
    value: np.ndarray
    hold: Literal["zero", "linear"] = "zero"

    def __post_init__(self) -> None:
        if np.shape(self.time) != np.shape(self.value) or np.ndim(self.time) != 1 or np.size(self.time) == 0:
            raise ValueError(
                f"trajectory: time {np.shape(self.time)} and value {np.shape(self.value)} must be equal (n,)"
            )
        if np.any(np.diff(self.time) <= 0):
            raise ValueError("trajectory: time is not increasing")

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the values at `time`; a jump belongs to the instant at which it happens."""
        if self.hold == "linear":
            return np.interp(time, self.time, self.value)
        index = np.searchsorted(self.time, np.asarray(time) + 1e-9, side="right") - 1
        return np.asarray(self.value, dtype=float)[np.maximum(index, 0)]


TrajectoryLike = Trajectory | tuple[np.ndarray, np.ndarray] | float


def as_trajectory(value: TrajectoryLike) -> Trajectory:
    """Accept a number or a (time, value) pair, which is held between its points."""
    if isinstance(value, Trajectory):
        return value
    if isinstance(value, tuple):
        return Trajectory(np.asarray(value[0], dtype=float), np.asarray(value[1], dtype=float))
    return Trajectory(np.zeros(1), np.array([float(value)]))


def _grid(duration: float, sample_time: float) -> np.ndarray:
    return np.arange(int(np.floor(duration / sample_time + 1e-9)) + 1) * sample_time


def constant(value: float) -> Trajectory:
    """Return the same value for ever."""
    return as_trajectory(value)


def staircase(levels: np.ndarray, dwell: float) -> Trajectory:
    """Return each level in turn for `dwell` seconds."""
    return Trajectory(np.arange(len(levels)) * dwell, np.asarray(levels, dtype=float))


def slow_sine(amplitude: float, frequency: float, duration: float, sample_time: float = 1e-3) -> Trajectory:
    """Return amplitude sin(2 pi frequency t), for slow reversals."""
    time = _grid(duration, sample_time)
    return Trajectory(time, amplitude * np.sin(2 * np.pi * frequency * time), "linear")


def chirp(amplitude: float, low: float, high: float, duration: float, sample_time: float = 1e-3) -> Trajectory:
    """Return a sine whose frequency rises linearly from `low` to `high` Hz."""
    time = _grid(duration, sample_time)
    phase = 2 * np.pi * (low * time + 0.5 * (high - low) * time**2 / duration)
    return Trajectory(time, amplitude * np.sin(phase), "linear")


def multisine(
    rms: float,
    band: tuple[float, float],
    duration: float,
    rng: np.random.Generator,
    sample_time: float = 1e-3,
    lines: int = 40,
) -> Trajectory:
    """Return a sum of sines of equal amplitude and random phase, log-spaced on multiples of 1 / duration."""
    time = _grid(duration, sample_time)
    wanted = np.geomspace(max(band[0], 1.0 / duration), band[1], lines) * duration
    frequency = np.unique(np.round(wanted)) / duration
    phase = rng.uniform(0.0, 2 * np.pi, frequency.size)
    value = np.zeros_like(time)
    for f, p in zip(frequency, phase, strict=True):
        value += np.sin(2 * np.pi * f * time + p)
    return Trajectory(time, value * rms * np.sqrt(2.0 / frequency.size))


def reversing_steps(
    levels: np.ndarray, dwell: tuple[float, float], duration: float, rng: np.random.Generator, sample_time: float = 1e-3
) -> Trajectory:
    """Return steps of random level and random dwell whose sign alternates; the mean is near zero."""
    time = _grid(duration, sample_time)
    value = np.zeros_like(time)
    start, sign = 0.0, 1.0
    while start < duration:
        end = start + rng.uniform(*dwell)
        value[(time >= start) & (time < end)] = sign * rng.choice(levels)
        start, sign = end, -sign
    return Trajectory(time, value)


def steps_and_multisine(
    levels: np.ndarray,
    dwell: tuple[float, float],
    rms: float,
    band: tuple[float, float],
    duration: float,
    rng: np.random.Generator,
    sample_time: float = 1e-3,
) -> Trajectory:
    """Return reversing steps of several levels with a multisine on top: slow, fast, reversing and accelerating."""
    steps = reversing_steps(levels, dwell, duration, rng, sample_time)
    sines = multisine(rms, band, duration, rng, sample_time)
    return Trajectory(steps.time, steps.value + sines.value)
