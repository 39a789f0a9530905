"""Motions that a drive may be asked for: speeds over time, as shares of the speed that is allowed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from friction_ocp.simulation.grid import FloatArray

SEED = 0
"""Of the phases and levels: the same problem gives the same motions."""


@dataclass(frozen=True)
class Motion:
    """A kind of motion."""

    name: str
    sentence: str
    """What is done, for the reader."""
    speed: Callable[[FloatArray], FloatArray]
    """Share of the allowed speed over the share of the time that has gone (n,)."""


def _levels(share: FloatArray) -> FloatArray:
    """Return steady speeds of alternating sign, evenly spaced in logarithm, in mixed order."""
    rng = np.random.default_rng(SEED)
    levels = rng.permutation(np.geomspace(0.03, 1.0, 8)).repeat(2) * np.tile([1.0, -1.0], 8)
    return levels[np.minimum((share * levels.size).astype(int), levels.size - 1)]


def _slow_levels(share: FloatArray) -> FloatArray:
    return 0.15 * _levels(share)


def _fast_levels(share: FloatArray) -> FloatArray:
    levels = np.array([1.0, -1.0, 0.7, -0.7, 0.85, -0.85, 0.55, -0.55])
    return levels[np.minimum((share * levels.size).astype(int), levels.size - 1)]


def _tones(low: float, high: float) -> Callable[[FloatArray], FloatArray]:
    def speed(share: FloatArray) -> FloatArray:
        rng = np.random.default_rng(SEED)
        cycles, phases = np.geomspace(low, high, 12), rng.uniform(0.0, 2.0 * np.pi, (12, 1))
        total = np.sum(np.sin(2.0 * np.pi * cycles[:, None] * share + phases), axis=0)
        return total / float(np.max(np.abs(total)))

    return speed


def _sweep(share: FloatArray) -> FloatArray:
    """Return a sine from 2 to 200 cycles over the whole time, its frequency growing evenly in logarithm."""
    rate = np.log(100.0)
    return 0.3 * np.sin(2.0 * np.pi * 2.0 * (np.exp(rate * share) - 1.0) / rate)


def _small_reversals(share: FloatArray) -> FloatArray:
    return (0.005 + 0.03 * share) * np.sin(2.0 * np.pi * 24.0 * share)


def _moves(share: FloatArray) -> FloatArray:
    """Return moves to and fro with ramps, and rests between them."""
    phase = (4.0 * share) % 1.0
    corners, speeds = [0.0, 0.08, 0.36, 0.44, 0.5, 0.58, 0.86, 0.94, 1.0], [0, 1, 1, 0, 0, -1, -1, 0, 0]
    return np.interp(phase, corners, speeds)


def _triangle(share: FloatArray) -> FloatArray:
    return 0.3 * np.interp((2.0 * share) % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])


MOTIONS = (
    Motion("levels", "steady speeds of either sign from 3 to 100 % of the allowed one", _levels),
    Motion("slow_levels", "slow steady speeds of either sign, up to 15 % of the allowed one", _slow_levels),
    Motion("fast_levels", "fast steady speeds of either sign", _fast_levels),
    Motion("multisine", "a sum of slow and fast sines", _tones(3.0, 60.0)),
    Motion("sweep", "a sine whose frequency grows a hundredfold", _sweep),
    Motion("small_reversals", "small reversals that grow until the drive breaks away", _small_reversals),
    Motion("moves", "moves to and fro with rests between them", _moves),
    Motion("triangle", "speed that slowly rises and falls through zero", _triangle),
)
