"""Periods of waves in a torque that is missing: from parts short enough to look through, then along all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.effects.spectrum import LINES, MOST_LINES, peaks, spectrum
from friction_ocp.simulation.grid import FloatArray

FEWEST = 8
"""Places that tell anything."""
FINER = 4.0
"""Frequencies that are looked at in each cycle over the whole range of places, once a peak is known."""


@dataclass(frozen=True)
class Seen:
    """What is missing along a stretch without interruption."""

    place: FloatArray
    """(n,) rad or s."""
    torque: FloatArray
    """(n,) N m."""
    beyond: FloatArray
    """(n,) N m, without what parameters could make up for."""
    factor: FloatArray
    """(n,) that a wave is multiplied with."""
    together: str = ""
    """Waves have the same phase in stretches that name the same."""


def likeliest(seen: Sequence[Seen], lowest: float) -> list[float]:
    """Return the likeliest periods of a wave, longer ones than 1/`lowest` left out; none where nothing is missing.

    Frequencies are looked at half a cycle apart over the longest stretch, up to half a cycle from place to place at
    typical speed. Where these are too many, stretches are cut until they are not: a long way has many cycles, and a few
    of them show a period nearly as well. What they show is sharpened along all stretches that share a phase.
    """
    seen = [one for one in seen if one.place.size >= FEWEST]
    steps = [np.sqrt(np.mean(np.diff(one.place) ** 2)) for one in seen]
    fastest = 0.5 / max(float(np.mean(steps)), 1e-300) if steps else 0.0
    most = MOST_LINES / 2.0 / max(fastest, 1e-300)
    parts = [part for one in seen for part in _parts(one, most)]
    travel = max([float(np.ptp(part.place)) for part in parts], default=0.0)
    lines = int(np.clip(2.0 * travel * fastest, LINES, MOST_LINES))
    frequencies = np.linspace(0.5, lines / 2.0, lines) / max(travel, 1e-300)
    frequencies = frequencies[frequencies >= lowest]
    power, beyond = _spectra(parts, frequencies)
    if not np.any(power):
        return []
    apart, whole = 0.5 / max(travel, 1e-300), _joined(seen)
    sharp = [_sharpened(whole, float(frequencies[k]), apart) for k in peaks(power, beyond)]
    return [1.0 / frequency for frequency in dict.fromkeys(sharp)]


def _spectra(seen: Sequence[Seen], frequencies: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the powers of waves in what is missing, and beyond parameters, phases of their own in every stretch."""
    power, beyond = np.zeros(frequencies.size), np.zeros(frequencies.size)
    for one in seen:
        place = one.place - one.place[0]
        power += spectrum(place, one.torque, one.factor, frequencies)
        beyond += spectrum(place, one.beyond, one.factor, frequencies)
    return power, beyond


def _parts(one: Seen, most: float) -> Iterator[Seen]:
    """Yield a stretch in halves, and these, until each goes no further than `most`."""
    if np.ptp(one.place) <= most or one.place.size < 2 * FEWEST:
        yield one
        return
    middle = one.place.size // 2
    for at in (slice(middle), slice(middle, None)):
        half = Seen(one.place[at], one.torque[at], one.beyond[at], one.factor[at], one.together)
        yield from _parts(half, most)


def _sharpened(whole: Sequence[Seen], frequency: float, apart: float) -> float:
    """Return the frequency within a distance of one that is strongest with one phase along each whole."""
    span = max(float(np.ptp(one.place)) for one in whole)
    count = int(np.ceil(2.0 * FINER * apart * span))
    if count <= 2.0 * FINER:
        return frequency
    near = frequency + apart * np.linspace(-1.0, 1.0, 2 * (min(count, MOST_LINES) // 2) + 1)
    near = near[near > 0.0]
    power = sum(spectrum(one.place - one.place[0], one.beyond, one.factor, near) for one in whole)
    return float(near[int(np.argmax(power))])


def _joined(seen: Sequence[Seen]) -> list[Seen]:
    """Return stretches that share a phase as one."""
    groups = {one.together: [each for each in seen if each.together == one.together] for one in seen}
    return [
        Seen(
            np.concatenate([one.place for one in group]),
            np.concatenate([one.torque for one in group]),
            np.concatenate([one.beyond for one in group]),
            np.concatenate([one.factor for one in group]),
            together,
        )
        for together, group in groups.items()
    ]
