"""The score test of a candidate: what it would gain, without refitting anything."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks, Score, score
from friction_ocp.diagnosis.contrast import Contrast, contrast
from friction_ocp.diagnosis.linear import LinearProgram
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Trial
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.model import Model
from friction_ocp.parameters import Free
from friction_ocp.simulation.grid import FloatArray

SECOND = 0.3
"""Gain of a second start over that of the first from which it is worth trying."""


@dataclass(frozen=True)
class Screened:
    """A candidate as the score test sees it."""

    effect: str
    component: str
    gain: float
    """Predicted decrease of the objective at its best trial."""
    p_value: float
    """Corrected for the number of trials."""
    starts: tuple[Mapping[str, float], ...]
    """Predicted values of the added parameters, best first, from trials that are not neighbours."""
    augmentation: Augmentation

    @property
    def values(self) -> Mapping[str, float]:
        """Predicted values of the added parameters."""
        return self.starts[0]

    @property
    def key(self) -> tuple[str, str]:
        """Effect and component."""
        return self.effect, self.component


def screen(
    model: Model, base: LinearProgram, blocks: Blocks, effect: AbstractEffect, place: str, clues: Clues
) -> Screened | None:
    """Test an effect at a place; None where the drive with it cannot be simulated."""
    try:
        augmentation = effect.augment(model.problem.drive, place, clues)
        built = contrast(model, base, augmentation.drive)
    except FrictionOcpError:
        return None
    found = [_tried(built, blocks, augmentation, trial) for trial in augmentation.trials]
    best = max(range(len(found)), key=lambda k: found[k][0])
    gain, p_value, values = found[best]
    others = [k for k in range(len(found)) if abs(k - best) > 1 and found[k][0] > SECOND * gain]
    second = [found[max(others, key=lambda k: found[k][0])][2]] if others else []
    return Screened(effect.name, place, gain, min(1.0, p_value * len(found)), (values, *second), augmentation)


def _tried(
    built: Contrast, blocks: Blocks, augmentation: Augmentation, trial: Trial
) -> tuple[float, float, Mapping[str, float]]:
    count = len(trial.amplitudes)
    off = augmentation.off
    columns = built.columns([{**off, **trial.fixed, **trial.amplitudes[j]} for j in range(count)])
    if not np.all(np.isfinite(columns)):
        return 0.0, 1.0, {}
    left = built.base.rows.absorbed(columns)
    if not _stands_out(columns, left):
        return 0.0, 1.0, {}
    found: Score = score(built.base.rows, blocks, left)
    sizes = _allowed(augmentation.drive, trial, off, found.sizes)
    if not np.any(sizes):
        return 0.0, 1.0, {}
    return found.gain, found.p_value, trial.values(off, list(sizes))


RANK = 1e-6
"""Share of a column, in length, below which what the parameters leave of it is rounding."""


def _stands_out(columns: FloatArray, left: FloatArray) -> bool:
    return bool(np.all(np.linalg.norm(left, axis=0) > RANK * np.linalg.norm(columns, axis=0)))


def _allowed(drive: Drive, trial: Trial, off: Mapping[str, float], sizes: FloatArray) -> FloatArray:
    """Return the sizes with those set to zero that bounds forbid altogether."""
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    kept = sizes.copy() if sizes.size else np.zeros(len(trial.amplitudes))
    for k, amplitude in enumerate(trial.amplitudes):
        for path, on in amplitude.items():
            free = values.get(path)
            start = off.get(path, 0.0)
            if trial.inverse:
                kept[k] = max(float(kept[k]), 0.0)
            elif isinstance(free, Free) and start + kept[k] * (on - start) < free.min and free.min >= start:
                kept[k] = 0.0
    return kept
