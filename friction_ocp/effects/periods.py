"""Periods of waves in a torque that is missing: from parts short enough to look through, then along all of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.effects.spectrum import LINES, MOST_LINES, NEIGHBOURS, left_by_means, peaks, spectrum
from friction_ocp.simulation.grid import FloatArray

stats: Any = _stats  # its own types are incomplete

FEWEST = 8
"""Places that tell anything."""
SHARED, CHANCE = 0.75, 1e-3
"""Share of what waves with phases of their own take, up to which one phase for all recordings does not do, and the
chance with which a difference is none. Under a large misfit periods are a little off, and phases then seem to differ:
where one phase takes most it is tried, and set apart once that is accepted."""
ALIKE, TWICE = 0.5 * (0.25 * np.pi + 1.0), 2.0
"""Share of what waves of any sizes take, from which one size for all recordings that pass them twice is likely: noise
alone, of Rayleigh's distribution, comes to pi / 4, and a wave to 1. What a model lacks that is no wave at all looks
like one of another size, too, in every recording."""
SLOW = 0.25
"""Share of the places, of those where anything moves, at which waves that are only seen there are still looked for."""
PEAKS, SHORT_PEAKS = 6, 2
"""Periods that are tried, and those so short."""
MOVING = 1e-3
"""Share of the highest speed below which nothing moves."""
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
    recording: str = ""
    """Its name; a wave has one phase in all stretches of one."""

    @cached_property
    def across(self) -> FloatArray:
        """Return (n,) how far each place, over which the torque is a mean, reaches; rad or s."""
        return np.abs(np.gradient(self.place))

    def power(self, torque: FloatArray, frequencies: FloatArray) -> FloatArray:
        """Return what waves of evenly spaced frequencies, each with the phase that suits it, take of a torque."""
        return spectrum(self.place - self.place[0], self.across, torque, self.factor, frequencies)

    def weight(self, frequency: float) -> FloatArray:
        """Return (n,) what is seen of a wave of a frequency."""
        return self.factor * left_by_means(frequency, self.across)


@dataclass(frozen=True)
class Likely:
    """A wave that may be missing."""

    period: float
    """rad or s."""
    apart: bool = False
    """Whether each recording has it with a phase of its own: the zero of an encoder may lie anywhere when that is
    switched on, and what comes from outside does not wait for a recording to begin."""
    crests: Mapping[str, float] = field(default_factory=dict[str, float])
    """By recording: the place amid it at which the wave is highest with a phase of its own, rad or s."""
    share: float = 0.0
    """Of the squares of what is missing, beyond parameters, that it takes; 0 where nothing is."""

    def beginning(self, recording: str) -> float:
        """Return where periods begin along a recording: at a crest where phases differ."""
        return self.crests.get(recording, 0.0) if self.apart else 0.0


def likeliest(seen: Sequence[Seen], lowest: float) -> list[Likely]:
    """Return the likeliest waves, longer ones than 1/`lowest` left out; none where nothing is missing.

    Frequencies are looked at up to half a cycle from place to place at typical speed, and up to half a cycle where most
    moves slowly: the likeliest of those come last. What they show is sharpened along all recordings with one phase, and
    along each, and told by an F test, by how much it takes and by its sizes whether they have one.
    """
    seen = [one for one in seen if one.place.size >= FEWEST]
    if not seen:
        return []
    typical = float(np.mean([np.sqrt(np.mean(np.diff(one.place) ** 2)) for one in seen]))
    usual, each = _band(seen, lowest, 0.5 / max(typical, 1e-300)), _by_recording(seen)
    if not np.any(usual.power):
        return []
    bands, slow = [(usual, PEAKS)], _slow_step(seen)
    if 0.5 / slow > usual.frequencies[-1] + NEIGHBOURS * usual.step:
        bands.append((_band(seen, usual.frequencies[-1], 0.5 / slow), SHORT_PEAKS))
    sharp = [
        _sharpened(each, float(band.frequencies[k]), band.step)
        for band, most in bands
        for k in peaks(band.power, band.beyond, most)
    ]
    return [
        Likely(1.0 / frequency, apart, {one.recording: _crest(one, frequency) for one in each}, share)
        for frequency, apart, share in dict.fromkeys(sharp)
    ]


def _slow_step(seen: Sequence[Seen]) -> float:
    """Return how far slow places reach, of stretches that move."""
    across = np.concatenate([one.across for one in seen])
    return float(np.quantile(across[across > MOVING * np.max(across)], SLOW))


@dataclass(frozen=True)
class _Band:
    """What waves of frequencies up to a highest one, with phases of their own in every stretch, are missing."""

    frequencies: FloatArray
    power: FloatArray
    """In what is missing."""
    beyond: FloatArray
    """And beyond parameters."""
    step: float
    """Between frequencies."""


def _band(seen: Sequence[Seen], lowest: float, highest: float) -> _Band:
    """Return a band of frequencies half a cycle apart over the longest stretch.

    Where these are too many, stretches are cut until they are not: a long way has many cycles, and a few of them show a
    period nearly as well.
    """
    parts = [part for one in seen for part in _parts(one, MOST_LINES / 2.0 / max(highest, 1e-300))]
    travel = max(float(np.ptp(part.place)) for part in parts)
    lines = int(np.clip(2.0 * travel * highest, LINES, MOST_LINES))
    frequencies = np.linspace(0.5, lines / 2.0, lines) / max(travel, 1e-300)
    frequencies = frequencies[frequencies >= lowest]
    power, beyond = np.zeros(frequencies.size), np.zeros(frequencies.size)
    for part in parts:
        power += part.power(part.torque, frequencies)
        beyond += part.power(part.beyond, frequencies)
    return _Band(frequencies, power, beyond, 0.5 / max(travel, 1e-300))


def _parts(one: Seen, most: float) -> Iterator[Seen]:
    """Yield a stretch in halves, and these, until each goes no further than `most`."""
    if np.ptp(one.place) <= most or one.place.size < 2 * FEWEST:
        yield one
        return
    middle = one.place.size // 2
    for at in (slice(middle), slice(middle, None)):
        half = Seen(one.place[at], one.torque[at], one.beyond[at], one.factor[at], one.recording)
        yield from _parts(half, most)


def _sharpened(each: Sequence[Seen], frequency: float, step: float) -> tuple[float, bool, float]:
    """Return the strongest frequency within a step of one, whether it is so with a phase for each recording, its share.

    `each` are whole recordings.
    """
    alike, shared = _strongest([_joined(each)], frequency, step)
    whole = max(sum(float(np.sum(one.beyond**2)) for one in each), 1e-300)
    if len(each) == 1:
        return alike, False, shared / whole
    differing, own = _strongest(each, frequency, step)
    more = 2 * (len(each) - 1)
    left = sum(one.place.size for one in each) - more - 3
    apart = are_apart(shared, own, whole, more, left) and _of_one_size(each, differing)
    return (differing, True, own / whole) if apart else (alike, False, shared / whole)


def are_apart(shared: float, own: float, whole: float, more: int, left: int) -> bool:
    """Whether recordings show that what they lack is not the same in all: by an F test, and by how much that takes.

    Of the `whole` sum of squares it takes `shared`, and with `more` parameters, `left` degrees of freedom remaining,
    its `own` in each.
    """
    noise = (whole - own) / max(left, 1)
    chance = float(stats.f.sf((own - shared) / more / max(noise, 1e-300), more, max(left, 1)))
    return chance < CHANCE and shared < SHARED * (own - more * noise)


def _of_one_size(each: Sequence[Seen], frequency: float) -> bool:
    """Whether the waves of a frequency, with a phase in each recording, are likely to be of one size.

    Two recordings at least have to tell. A wave that is hardly shorter than the way along which it is seen takes the
    shape of almost anything with phases of its own.
    """
    passed = [one for one in each if np.ptp(one.place) * frequency >= TWICE]
    if len(passed) < 2:
        return False
    at = np.array([frequency])
    power = np.array([float(one.power(one.beyond, at)[0]) for one in passed])
    weight = np.array([0.5 * float(np.sum(one.weight(frequency) ** 2)) for one in passed])
    alike = float(np.sum(np.sqrt(power * weight))) ** 2 / max(float(np.sum(weight)), 1e-300)
    return alike >= ALIKE * float(np.sum(power))


def _strongest(whole: Sequence[Seen], frequency: float, step: float) -> tuple[float, float]:
    """Return the frequency within a step of one that takes most with one phase along each whole, and what it takes."""
    span = max(float(np.ptp(one.place)) for one in whole)
    count = int(np.ceil(2.0 * FINER * step * span))
    near = np.array([frequency])
    if count > 2.0 * FINER:
        near = frequency + step * np.linspace(-1.0, 1.0, 2 * (min(count, MOST_LINES) // 2) + 1)
        near = near[near > 0.0]
    power = np.zeros(near.size)
    for one in whole:
        power += one.power(one.beyond, near)
    best = int(np.argmax(power))
    return float(near[best]), float(power[best])


def _crest(one: Seen, frequency: float) -> float:
    """Return the place amid a recording at which the wave of a frequency is highest."""
    amid = 0.5 * float(np.min(one.place) + np.max(one.place))
    turns = 2.0 * np.pi * frequency * (one.place - amid)
    basis = one.weight(frequency)[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    cosine, sine = np.linalg.lstsq(basis, one.beyond, rcond=None)[0]
    return amid + float(np.arctan2(sine, cosine) / (2.0 * np.pi * frequency))


def _by_recording(seen: Sequence[Seen]) -> list[Seen]:
    names = dict.fromkeys(one.recording for one in seen)
    return [_joined([one for one in seen if one.recording == name]) for name in names]


def _joined(group: Sequence[Seen]) -> Seen:
    """Return stretches as one."""
    return Seen(
        np.concatenate([one.place for one in group]),
        np.concatenate([one.torque for one in group]),
        np.concatenate([one.beyond for one in group]),
        np.concatenate([one.factor for one in group]),
        group[0].recording,
    )
