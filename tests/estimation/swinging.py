"""Runs of a plant that three sines of current swing to and fro."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from plant import Plant, Trajectory

from friction_ocp.recording.recording import Channel, Recording

AMPLITUDE = 0.9
"""Of each sine, A."""


def swung(
    name: str,
    plant: Plant,
    frequencies: Sequence[float],
    seconds: float,
    step: float,
    units: Mapping[str, str],
    seed: int,
) -> Recording:
    """Return what the sensors of a plant show, by channel and unit; frequencies in Hz, a new current every `step` s."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds + 1.0, step)
    waves = [np.sin(2 * np.pi * f * time + rng.uniform(0.0, 6.0)) for f in frequencies]
    current = Trajectory(time, AMPLITUDE * np.sum(waves, axis=0), "linear")
    run = plant.simulate(seconds, {"drive.current": current}, rng)
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in units.items()})
