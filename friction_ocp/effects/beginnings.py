"""How far friction has settled where each recording begins, from the torque that a model lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import Clues, Track, fitted_friction
from friction_ocp.effects.periods import FEWEST, are_apart
from friction_ocp.effects.spectrum import without
from friction_ocp.simulation.grid import FloatArray

SHORTEST, LONGEST, LOOKED_AT = 0.03, 3.0, 15
"""Time constants over the longest recording that are looked at, and how many."""
SPEEDS = 64
"""At which a friction curve is worked out; it is interpolated between."""


@dataclass(frozen=True)
class Beginnings:
    """How friction settles, begun otherwise in every recording."""

    time_constant: float
    """s."""
    begun: dict[str, float]
    """By recording: 1 where it has settled, 0 where furthest from it."""

    def by_path(self, path: str) -> dict[str, float]:
        """Return the values by the path of a warm-up's numbers."""
        return {f"{path}.begun@{name}": value for name, value in self.begun.items()}


def begins_apart(drive: Drive, place: str, clues: Clues) -> Beginnings | None:
    """Return how far the friction of a shaft has settled where recordings begin; None where all begin alike.

    As with phases of waves, an F test says whether the recordings show that, and how much a change of friction that is
    alike in all takes of what one of another size in each takes. Nor where there are static points: nobody knows how
    warm it was at those.
    """
    names = clues.recordings
    if len(names) == 1 or clues.steady:
        return None
    friction = np.concatenate([_curve(drive, place, clues, track) for track in clues.tracks])
    seen = [track.finely for track in clues.tracks]
    time = np.concatenate([track.time[track.finely.middle] for track in clues.tracks])
    recording = np.repeat([names.index(track.recording) for track in clues.tracks], [one.middle.size for one in seen])
    present = np.flatnonzero(np.bincount(recording, minlength=len(names)) >= FEWEST)
    if present.size < 2:
        return None
    made_up_for = np.concatenate([track.ordinary(place) for track in clues.tracks])
    lacking = without(np.concatenate([one.torque[place] for one in seen]), made_up_for)
    own = recording[:, None] == np.arange(len(names))
    longest = max(float(np.ptp(track.time)) for track in clues.tracks)
    shared, apart = list[float](), list[tuple[float, float, FloatArray]]()
    for constant in longest * np.geomspace(SHORTEST, LONGEST, LOOKED_AT):
        fading: FloatArray = without((friction * np.exp(-time / constant))[:, None] * own, made_up_for)
        taken, sizes = _fitted(fading, lacking)
        apart.append((taken, float(constant), sizes))
        shared.append(_fitted(fading.sum(axis=1, keepdims=True), lacking)[0])
    most, constant, sizes = max(apart, key=lambda one: one[0])
    left = int(lacking.size - made_up_for.shape[1] - present.size - 1)
    if not are_apart(max(shared), most, float(np.sum(lacking**2)), int(present.size) - 1, left):
        return None
    furthest = sizes[np.argmax(np.abs(sizes))]
    return Beginnings(constant, {name: float(1.0 - size / furthest) for name, size in zip(names, sizes, strict=True)})


def _curve(drive: Drive, place: str, clues: Clues, track: Track) -> FloatArray:
    """Return (segments,) the torque against the motion of a shaft that its fitted friction makes without load, N m."""
    omega = track.finely.omega[place]
    fastest = max(float(np.max(np.abs(omega), initial=0.0)), 1e-12)
    speeds, element = np.linspace(0.0, fastest, SPEEDS), fitted_friction(drive, place, clues)
    sides: list[Sequence[float]] = [
        [float(element.magnitude(side, float(speed), 0.0)) for speed in speeds] for side in ("negative", "positive")
    ]
    backwards, forwards = (np.interp(np.abs(omega), speeds, side) for side in sides)
    return np.sign(omega) * np.where(omega > 0.0, forwards, backwards)


def _fitted(columns: FloatArray, values: FloatArray) -> tuple[float, FloatArray]:
    """Return what columns take of the sum of squares of values, and their sizes."""
    sizes = np.linalg.lstsq(columns, values, rcond=None)[0].astype(np.float64)
    return float(np.sum((columns @ sizes) ** 2)), sizes
