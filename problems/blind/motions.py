"""How a machine is moved for a recording: references for its loop."""

from __future__ import annotations

import numpy as np
from plant import Trajectory

from blind.machines import Machine


def speed_reference(kind: str, top: float, duration: float, rng: np.random.Generator, step: float) -> np.ndarray:
    """Return a speed on the grid of `step`: reversing steps with a multisine, a multisine, slow sines or moves."""
    time = step * np.arange(round(duration / step) + 2)
    if kind == "steps":
        return _steps(time, top, rng) + 0.05 * top * _tones(time, 0.8, 12.0, rng)
    if kind == "multisine":
        return 0.35 * top * _tones(time, 0.2, 6.0, rng)
    if kind == "slow":
        slow, slower = rng.uniform(0.4, 0.7), rng.uniform(0.12, 0.2)
        return top * (0.08 * np.sin(2 * np.pi * slow * time) + 0.25 * np.sin(2 * np.pi * slower * time))
    return _moves(time, top, rng)


KINDS = ("steps", "multisine", "slow", "moves")


def _tones(time: np.ndarray, low: float, high: float, rng: np.random.Generator) -> np.ndarray:
    """Return a sum of 12 sines of random phase with an rms of 1."""
    frequency = np.geomspace(low, high, 12) * rng.uniform(0.9, 1.1, 12)
    phase = rng.uniform(0.0, 2 * np.pi, (12, 1))
    return np.sqrt(2.0 / 12) * np.sum(np.sin(2 * np.pi * frequency[:, None] * time + phase), axis=0)


def _steps(time: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """Return levels of alternating sign between 4 % and all of the top speed, slow ones for as long as fast ones."""
    value, at, sign = np.zeros_like(time), 0.0, 1.0
    while at < time[-1]:
        dwell = rng.uniform(0.05, 0.15) * time[-1]
        value[(time >= at) & (time < at + dwell)] = sign * top * np.exp(rng.uniform(np.log(0.04), 0.0))
        at, sign = at + dwell, -sign
    return value


def _moves(time: np.ndarray, top: float, rng: np.random.Generator) -> np.ndarray:
    """Return moves to and fro with ramps of speed and pauses between them."""
    corners, speeds, at, sign = [0.0], [0.0], 0.0, 1.0
    while at < time[-1]:
        ramp, hold, pause = rng.uniform([0.02, 0.02, 0.01], [0.06, 0.12, 0.04]) * time[-1]
        level = sign * top * rng.uniform(0.2, 0.9)
        corners += [at + ramp, at + ramp + hold, at + 2 * ramp + hold, at + 2 * ramp + hold + pause]
        speeds += [level, level, 0.0, 0.0]
        at, sign = corners[-1], -sign
    return np.interp(time, corners, speeds)


def reference(machine: Machine, kind: str, rng: np.random.Generator) -> dict[str, Trajectory]:
    """Return the reference of the loop: a speed, or its integral about zero within the travel."""
    step = machine.sample_time
    speed = speed_reference(kind, machine.top_speed, machine.duration, rng, step)
    time = step * np.arange(speed.size)
    if machine.loop.type == "pi_velocity":
        return {"reference.omega": Trajectory(time, speed)}
    angle = np.cumsum(speed) * step
    angle -= np.linspace(0.0, 1.0, angle.size) * angle[-1]
    return {"reference.theta": Trajectory(time, angle * min(1.0, machine.travel / np.ptp(angle)))}
