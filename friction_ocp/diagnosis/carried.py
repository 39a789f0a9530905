"""What a joint carries over its twist: as the motion behind it needs it, and as models with and without additions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.binned import band, means
from friction_ocp.drive.parts import Transmission
from friction_ocp.effects.effect import Clues
from friction_ocp.simulation.grid import FloatArray, IntArray

BINS, FEWEST = 24, 4
"""Intervals of the twist, and segments of which a mean is shown."""
SIZE, WITHIN = BINS + 2, slice(1, -1)
"""All intervals, with what is beyond at either end, and those between."""
RARE = 0.002
"""Share of the segments at either end whose twist is not shown."""


@dataclass(frozen=True)
class Carried:
    """The torque in a joint over its twist, both on its output side, where anything twists it."""

    component: str
    twist: FloatArray
    """(bins,) rad."""
    needed: FloatArray
    """(bins,) mean of what moves the output as it moved, N m: what the joint carries, and what is missing behind it."""
    lower: FloatArray
    upper: FloatArray
    """(bins,) 95 % band of the mean."""
    after: FloatArray
    """(bins,) mean of what the joint carries in the model with its additions."""
    before: FloatArray | None
    """(bins,) the same in the model without them; None where it is rigid there. NaN where it never twists as far."""


def carried(before: Clues, after: Clues, joint: Transmission) -> Carried | None:
    """Return what a joint carries in the model with additions and without; None where it is rigid in both."""
    twist, torque = _along(after, joint.name)
    if twist.size < BINS:
        return None
    missing = np.concatenate([track.missing.torque.get(joint.to_shaft, np.zeros(0)) for track in after.tracks])
    low, high = (float(end) for end in np.quantile(twist, [RARE, 1.0 - RARE]))
    edges: FloatArray = np.linspace(low, high, BINS + 1)
    needed = torque + (missing if missing.size == torque.size else 0.0)
    bins, (other, carried_before) = _bins(twist, edges), _along(before, joint.name)
    told = _counts(bins) >= FEWEST
    if not told.any():
        return None
    mean, low, high = (each[WITHIN][told] for each in band(bins, needed, SIZE))
    at = _bins(other, edges)
    seen = np.where(_counts(at) > 0, means(at, carried_before, SIZE)[WITHIN], np.nan)
    return Carried(
        component=joint.name,
        twist=0.5 * (edges[1:] + edges[:-1])[told],
        needed=mean,
        lower=low,
        upper=high,
        after=means(bins, torque, SIZE)[WITHIN][told],
        before=seen[told] if other.size else None,
    )


def _along(clues: Clues, joint: str) -> tuple[FloatArray, FloatArray]:
    """Return (segments of all recordings,) twist and torque; none where the joint is rigid."""
    parts = [(track.missing.twist.get(joint), track.missing.carried.get(joint)) for track in clues.tracks]
    known = [(twist, torque) for twist, torque in parts if twist is not None and torque is not None]
    if not known:
        return np.zeros(0), np.zeros(0)
    twists, torques = zip(*known, strict=True)
    return np.concatenate(twists), np.concatenate(torques)


def _bins(twist: FloatArray, edges: FloatArray) -> IntArray:
    """Return the interval of each twist, the first and the last one being beyond the edges."""
    return np.searchsorted(edges, twist).astype(np.int64)


def _counts(bins: IntArray) -> IntArray:
    return np.bincount(bins, minlength=SIZE)[WITHIN]
