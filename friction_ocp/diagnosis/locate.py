"""What missing torque depends on: the variable that explains most of it, its shape, and what additions take of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.binned import band, means
from friction_ocp.effects.effect import Clues
from friction_ocp.simulation.grid import FloatArray, IntArray

BINS = 16
FOLDS = 5
LIKELIEST = 2
"""Periods that are looked at."""


@dataclass(frozen=True)
class Shape:
    """The missing torque of a shaft over the variable that explains most of it."""

    component: str
    variable: str
    period: float | None
    """In which the variable comes back, where it is one of that length that counts, in the unit of the variable."""
    share: float
    """Of its variance that the variable explains, cross-validated over stretches of time."""
    centre: FloatArray
    """(bins,) of the variable."""
    torque: FloatArray
    """(bins,) mean, N m."""
    lower: FloatArray
    upper: FloatArray
    """(bins,) 95 % band of the mean."""
    taken: FloatArray | None = None
    """(bins,) mean of what additions take of it, N m; None where there are none, or they are not known there."""


def shape(clues: Clues, shaft: str, after: Clues | None = None) -> Shape | None:
    """Return the shape of the missing torque of a shaft; None where it is not known.

    `after` are clues of the model with its additions, None where there are none.
    """
    torque = _missing_torque(clues, shaft)
    if torque.size < 4 * BINS or not np.any(torque):
        return None
    variables = _variables(clues, shaft)
    shares = [explained(one.values, torque) for one in variables]
    best = int(np.argmax(shares))
    left = None if after is None else _missing_torque(after, shaft)
    taken = torque - left if left is not None and left.size == torque.size else None
    return _shape(shaft, variables[best], shares[best], torque, taken)


def _missing_torque(clues: Clues, shaft: str) -> FloatArray:
    return np.concatenate([track.missing.torque.get(shaft, np.zeros(0)) for track in clues.tracks])


@dataclass(frozen=True)
class _Variable:
    name: str
    values: FloatArray
    """(segments,)."""
    period: float | None = None

    def within(self, period: float, crests: FloatArray) -> _Variable:
        """Return where the variable is within a period that begins at places (segments,)."""
        return _Variable(self.name, np.mod(self.values - crests, period), period)


def _variables(clues: Clues, shaft: str) -> list[_Variable]:
    """Return what may explain a torque, angle and time within their likeliest periods last.

    Where the phase of a wave differs from recording to recording, periods begin at its crests.
    """

    def joined(series: list[FloatArray]) -> FloatArray:
        parts = [values[track.missing.middle] for values, track in zip(series, clues.tracks, strict=True)]
        return np.concatenate(parts)

    speed = np.concatenate([track.missing.omega[shaft] for track in clues.tracks])
    angle = _Variable(f"{shaft}.theta", np.concatenate([track.missing.theta[shaft] for track in clues.tracks]))
    since = _Variable("time", joined([track.time - track.time[0] for track in clues.tracks]))
    clock = _Variable("time", joined([track.time for track in clues.tracks]))
    torques = [
        _Variable(f"{motor}.torque", joined([track.torque[motor] for track in clues.tracks]))
        for motor in clues.tracks[0].torque
    ]

    def folded(over: _Variable, kind: str) -> list[_Variable]:
        waves = clues.waves(shaft, kind)[:LIKELIEST]
        crests = [
            [np.full(track.missing.middle.size, wave.beginning(track.recording)) for track in clues.tracks]
            for wave in waves
        ]
        return [over.within(wave.period, np.concatenate(own)) for wave, own in zip(waves, crests, strict=True)]

    return [_Variable(f"{shaft}.omega", speed), angle, since, *torques, *folded(angle, "theta"), *folded(clock, "time")]


def explained(values: FloatArray, torque: FloatArray) -> float:
    """Return the share of the variance of the torque that its mean over bins of a variable predicts elsewhere."""
    bins = _bins(values)
    fold = (np.arange(torque.size) * FOLDS * 4 // torque.size) % FOLDS
    left = 0.0
    for k in range(FOLDS):
        known, held = fold != k, fold == k
        total = np.bincount(bins[known], torque[known], BINS)
        count = np.bincount(bins[known], minlength=BINS)
        mean = np.where(count > 0, total / np.maximum(count, 1), float(np.mean(torque[known])))
        left += float(np.sum((torque[held] - mean[bins[held]]) ** 2))
    whole = float(np.sum((torque - torque.mean()) ** 2))
    return max(0.0, 1.0 - left / max(whole, 1e-300))


def _bins(values: FloatArray) -> IntArray:
    edges = np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    return np.searchsorted(edges, values).astype(np.int64)


def _shape(shaft: str, over: _Variable, share: float, torque: FloatArray, taken: FloatArray | None) -> Shape:
    bins = _bins(over.values)
    told = np.bincount(bins, minlength=BINS) > 0
    mean, low, high = band(bins, torque, BINS)
    by = None if taken is None else means(bins, taken, BINS)[told]
    centre = means(bins, over.values, BINS)[told]
    return Shape(shaft, over.name, over.period, share, centre, mean[told], low[told], high[told], by)
