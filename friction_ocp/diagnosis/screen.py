"""The score test of a candidate: what it would gain, without refitting anything."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks, Score, score
from friction_ocp.diagnosis.contrast import Contrast, contrast
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Key, Trial
from friction_ocp.effects.registry import effects
from friction_ocp.errors import FrictionOcpError
from friction_ocp.parameters import Free
from friction_ocp.simulation.grid import FloatArray

OTHER, MOST_STARTS = 0.3, 3
"""Gain of a further start over that of the first from which it is worth trying, and how many there are at most."""


@dataclass(frozen=True)
class Start:
    """Where a refit may begin: a trial at its predicted size, and how the base model's parameters make room for it."""

    trial: Trial
    sizes: tuple[float, ...]
    shift: Mapping[str, float]
    """Predicted change of the parameters of the base model."""

    def added(self, off: Mapping[str, float], scale: float = 1.0) -> dict[str, float]:
        """Return the values of the added parameters at `scale` times the predicted size."""
        return self.trial.values(off, [scale * size for size in self.sizes])

    def values(self, off: Mapping[str, float], known: Mapping[str, float], scale: float) -> dict[str, float]:
        """Return the values of all parameters at `scale` times the predicted size."""
        moved = {name: known[name] + scale * step for name, step in self.shift.items()}
        return {**known, **moved, **self.added(off, scale)}


@dataclass(frozen=True)
class Screened:
    """A candidate as the score test sees it."""

    effect: str
    component: str
    gain: float
    """Predicted decrease of the objective at its best trial."""
    p_value: float
    """Corrected for the number of trials."""
    starts: tuple[Start, ...]
    """Best first, from trials that are not neighbours."""
    augmentation: Augmentation

    @property
    def values(self) -> Mapping[str, float]:
        """Predicted values of the added parameters."""
        return self.starts[0].added(self.augmentation.off) if self.starts else {}

    @property
    def key(self) -> Key:
        """Effect and component."""
        return self.effect, self.component

    def holds(self, other: Screened) -> bool:
        """Whether this has all added parameters of another candidate, and more."""
        own, others = set(self.augmentation.off), set(other.augmentation.off)
        return bool(others) and others < own

    def includes(self, other: Screened) -> bool:
        """Whether another candidate is this one without some of its parameters, or with those that nature has."""
        named = self.component == other.component and other.effect in effects()[self.effect].includes
        return named or self.holds(other)


def screen(base: FittedModel, effect: AbstractEffect, place: str, clues: Clues) -> Screened | None:
    """Test an effect at a place; None where the drive with it cannot be simulated."""
    try:
        augmentation = effect.addition(base.model.problem.drive, place, clues)
        built = contrast(base.model, base.linear, augmentation.drive)
    except FrictionOcpError:
        return None
    found = [_tried(built, base.blocks, augmentation, trial) for trial in augmentation.trials]
    order = sorted(range(len(found)), key=lambda k: -found[k].gain)
    best, chosen = found[order[0]], list[int]()
    for k in order:
        near = any(abs(k - other) <= 1 for other in chosen)
        if found[k].start is not None and not near and found[k].gain >= OTHER * best.gain:
            chosen.append(k)
    starts = [found[k].start for k in chosen[:MOST_STARTS]]
    p_value = min(1.0, best.p_value * len(found))
    return Screened(effect.name, place, best.gain, p_value, tuple(x for x in starts if x is not None), augmentation)


@dataclass(frozen=True)
class _Tried:
    gain: float
    p_value: float
    start: Start | None


NOT_TOLD = _Tried(0.0, 1.0, None)


def _tried(built: Contrast, blocks: Blocks, augmentation: Augmentation, trial: Trial) -> _Tried:
    count, off, rows = len(trial.amplitudes), augmentation.off, built.base.rows
    columns = built.columns([{**off, **trial.fixed, **trial.amplitudes[j]} for j in range(count)])
    if not np.all(np.isfinite(columns)):
        return NOT_TOLD
    left = rows.absorbed(columns)
    if not _stands_out(columns, left):
        return NOT_TOLD
    found: Score = score(rows, blocks, left)
    sizes = _allowed(augmentation.drive, trial, off, found.sizes)
    if not np.any(sizes):
        return NOT_TOLD
    shift = -rows.fitted(columns @ sizes)
    names = built.model.space.names
    start = Start(trial, tuple(map(float, sizes)), dict(zip(names, map(float, shift), strict=True)))
    return _Tried(found.gain, found.p_value, start)


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
