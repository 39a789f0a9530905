"""What an unmodelled effect is: a way to add something to a drive, with an off value that gives the drive back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.effects.periods import MOVING, Likely, Seen, likeliest
from friction_ocp.effects.spectrum import without
from friction_ocp.friction.element import FrictionElement
from friction_ocp.parameters import Free, bind

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Key = tuple[str, str]
"""Name of an effect, and the component that it is at."""

SHARP = 0.04
"""Damping over inertia and angular frequency of what is heard ringing."""


@dataclass(frozen=True)
class Missing:
    """The torque that a model lacks along a recording, as the mean over each of some segments."""

    middle: IntArray
    """(segments,) the sample in the middle of each."""
    torque: Mapping[str, FloatArray]
    """By shaft (segments,) the torque if that shaft is where the model lacks one, N m."""
    theta: Mapping[str, FloatArray]
    """By shaft (segments,) rad, where it was with this torque: on its own the model may lose its way."""
    omega: Mapping[str, FloatArray]
    """By shaft (segments,) rad/s, how fast."""
    twist: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])
    """By elastic transmission (segments,) rad on its output side."""
    carried: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])
    """By elastic transmission (segments,) N m on its output side, what its spring and damper make of that."""


@dataclass(frozen=True)
class Track:
    """One recording as the fitted drive passes through it."""

    time: FloatArray
    """(n,) s, since what changes with time began."""
    theta: Mapping[str, FloatArray]
    """By shaft, rad."""
    omega: Mapping[str, FloatArray]
    """By shaft, rad/s."""
    torque: Mapping[str, FloatArray]
    """By motor, on its shaft, N m."""
    missing: Missing
    """Over the segments of the fit: what is slow, and little noise."""
    finely: Missing
    """Over a few samples each: what is fast, too, and more noise."""
    recording: str = ""
    """Its name; pieces of one have the same."""
    alone: Mapping[str, Missing] = field(default_factory=dict[str, Missing])
    """By shaft, over the fine segments: where it alone lacks torque; empty where all turn as one."""

    def ordinary(self, shaft: str) -> FloatArray:
        """Return (segments, 4) what constant torque, friction and inertia of a shaft do over the fine segments."""
        at, omega = self.finely.middle, self.omega[shaft]
        shapes = [np.ones(self.time.size), np.sign(omega), omega, np.gradient(omega, self.time)]
        return np.column_stack([shape[at] for shape in shapes])


@dataclass(frozen=True)
class Clues:
    """What recordings and base fit say about sizes and places, for initial guesses."""

    tracks: tuple[Track, ...]
    numbers: Mapping[str, float]
    """Every number of the drive in the first recording, by path."""
    typical_torque: Mapping[str, float]
    """By shaft, N m: what moves it."""
    steady: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])
    """By shaft, rad/s: speeds at which static points were taken, where there are any."""
    linear: frozenset[str] = frozenset()
    """Shafts that move along a line: nothing of them comes back with a turn."""
    late: Mapping[str, float] = field(default_factory=dict[str, float])
    """By channel: how late it shows what another one shows, s; without those that are not."""
    _known_waves: dict[tuple[str, str, bool, str | None], list[Likely]] = field(
        default_factory=lambda: {}, init=False, repr=False, compare=False
    )

    def speeds(self, shaft: str) -> FloatArray:
        """Return all speeds of a shaft, rad/s."""
        return np.concatenate([track.omega[shaft] for track in self.tracks])

    def angles(self, shaft: str) -> FloatArray:
        """Return all angles of a shaft, rad."""
        return np.concatenate([track.theta[shaft] for track in self.tracks])

    def typical_speed(self, shaft: str) -> float:
        """Return the rms speed of a shaft, rad/s."""
        return max(float(np.sqrt(np.mean(self.speeds(shaft) ** 2))), 1e-12)

    def periods(
        self, shaft: str, over: str, against_motion: bool = False, against_torque: str | None = None
    ) -> list[float]:
        """Return the likeliest periods of the missing torque of a shaft over its angle ("theta") or "time".

        They are seen twice at least, or come back with every turn of what turns: what is longer is a trend.
        `against_motion` looks for a wave times the sign of the speed, `against_torque` times a motor's torque. What
        parameters that are off add to the missing torque goes with speed and acceleration, and these with the angle:
        waves are looked for without that, too. Without a missing torque, harmonics of a turn, or parts of the longest
        travel or recording.
        """
        return [wave.period for wave in self.waves(shaft, over, against_motion, against_torque)]

    def apart(self, waves: Sequence[Likely]) -> tuple[str, ...]:
        """Return the names of all recordings where the wave that takes most has another phase in each, else none.

        Nor where there are static points: no phase is known at those.
        """
        return self.recordings if max(waves, key=lambda one: one.share).apart and not self.steady else ()

    @property
    def recordings(self) -> tuple[str, ...]:
        """The names of all recordings."""
        return tuple(dict.fromkeys(track.recording for track in self.tracks))

    def waves(
        self, shaft: str, over: str, against_motion: bool = False, against_torque: str | None = None
    ) -> list[Likely]:
        """Return the likeliest waves; the arguments are those of `periods`."""
        asked = (shaft, over, against_motion, against_torque)
        if asked not in self._known_waves:
            self._known_waves[asked] = self._looked_for(*asked)
        return self._known_waves[asked]

    def waves_in_time(self, shaft: str) -> list[Likely]:
        """Return the likeliest waves over time at a shaft, and the likeliest one at each other shaft beside them.

        What comes from outside has its period wherever it acts, and shows it best at the shaft whose torque is known
        best: one that takes a larger share there than any does here comes first.
        """
        own = self.waves(shaft, "time")
        elsewhere = [self.waves(name, "time")[0] for name in self.tracks[0].finely.torque if name != shaft]
        more = sorted((one for one in elsewhere if one.share > 0.0), key=lambda one: -one.share)
        first = [one for one in more if one.share > own[0].share]
        return [*first, *own, *(one for one in more if one not in first)]

    def _looked_for(self, shaft: str, over: str, against_motion: bool, against_torque: str | None) -> list[Likely]:
        whole = [track.theta[shaft] if over == "theta" else track.time for track in self.tracks]
        travel = max(float(np.ptp(one)) for one in whole)
        lowest = 2.0 / max(travel, 1e-300)
        turning = over == "theta" and shaft not in self.linear
        if turning:
            lowest = min(lowest, 1.0 / (2.0 * np.pi))
        asked = shaft, over, against_motion, against_torque
        found = likeliest([self._seen(track, track.finely, *asked) for track in self.tracks], lowest)
        if found and all(shaft in track.alone for track in self.tracks):
            alone = likeliest([self._seen(track, track.alone[shaft], *asked) for track in self.tracks], lowest)
            most = max(one.share for one in found)
            found = [*(one for one in alone if one.share > most), *found]
        if found:
            return found
        turns = 2.0 * np.pi / np.array([1.0, 2.0, 4.0, 6.0, 12.0])
        usual = turns if turning else travel / np.array([2.0, 8.0, 32.0])
        return [Likely(float(period)) for period in usual]

    @staticmethod
    def _seen(
        track: Track, item: Missing, shaft: str, over: str, against_motion: bool, against_torque: str | None
    ) -> Seen:
        """Return what is missing along a recording."""
        torque = item.torque[shaft]
        factor = np.ones(torque.size)
        if against_motion:
            factor = np.sign(item.omega[shaft])
        if against_torque is not None:
            factor = track.torque[against_torque][item.middle]
        left = without(torque, track.ordinary(shaft))
        place = item.theta[shaft] if over == "theta" else track.time[item.middle]
        return Seen(place, torque, left, factor, track.recording)

    def ringing(self, shaft: str, slowest: float, fastest: float) -> list[float]:
        """Return angular frequencies, rad/s, at which the missing torque of a shaft is strongest, within limits.

        Little damped parts answer to a narrow band, which a grid of frequencies misses.
        """
        rates = [2.0 * np.pi / period for period in self.periods(shaft, "time")]
        return [rate for rate in rates if slowest < rate < fastest]

    def speed_quantiles(self, shaft: str, shares: Sequence[float]) -> list[float]:
        """Return speeds below which the shaft moves for the given shares of the time that it moves at all.

        Of static points, where there are any: they lie where somebody wanted to see friction.
        """
        speed = np.abs(self.steady.get(shaft, self.speeds(shaft)))
        moving = speed[speed > MOVING * float(np.max(speed, initial=0.0))]
        return [float(value) for value in np.quantile(moving, shares)] if moving.size else [1.0 for _ in shares]


@dataclass(frozen=True)
class Trial:
    """Values at which an addition is tried: one column of the score test for each amplitude."""

    amplitudes: tuple[Mapping[str, float], ...]
    """On-values; the parameters named in one of them grow together."""
    fixed: Mapping[str, float] = field(default_factory=dict[str, float])
    """Values of the other parameters of the addition: a period, a break, a shape."""
    inverse: bool = False
    """Whether 1/value, not value - off, is what grows: a stiffness is off where it is infinite."""

    def values(self, off: Mapping[str, float], sizes: Sequence[float]) -> dict[str, float]:
        """Return all values of the addition where every amplitude is `sizes` times its on-value."""
        at = {**off, **self.fixed}
        for amplitude, size in zip(self.amplitudes, sizes, strict=True):
            for path, on in amplitude.items():
                at[path] = (
                    on / max(size, 1e-3) if self.inverse else at.get(path, 0.0) + size * (on - off.get(path, 0.0))
                )
        return at


@dataclass(frozen=True)
class Augmentation:
    """A drive with an addition."""

    drive: Drive
    """Its added parameters are free, each with bounds and a guess."""
    off: Mapping[str, float]
    """Values of the added parameters at which the drive is the one it was."""
    trials: tuple[Trial, ...]
    large: Callable[[Mapping[str, float]], Mapping[str, float]] | None = None
    """Gives values at which a large effect may begin, from those of a small one; None where size is all that grows."""
    otherwise: Callable[[Mapping[str, float]], Mapping[str, float]] | None = None
    """Gives values that do nearly the same another way, from those where a refit ended; None where there is none."""
    outright: tuple[Mapping[str, float], ...] = ()
    """Values at which a large effect may begin of which small ones tell nothing: no derivative shows a flank out of
    reach. Empty where they do."""
    inside: tuple[str, ...] = ()
    """Paths of added parameters at whose bounds the effect is none, or another one: a fit that ends there has not found
    it."""


@dataclass(frozen=True)
class Hiding:
    """An effect that shows below some speed alone."""

    augmentation: Augmentation
    amplitude: str
    """Path of its size, N m or N."""
    speed: str
    """Path of the speed above which it fades."""
    tried: float
    """Size at which it is simulated: small enough to be linear."""
    usual: float
    """Size that nobody would be surprised at."""

    def values(self, speed: float) -> dict[str, float]:
        """Return the values of the added parameters for a speed."""
        return {**self.augmentation.off, self.amplitude: self.tried, self.speed: speed}


class AbstractEffect(ABC):
    """Something that a model may lack. Instances hold no data: an effect is added at a place of a drive."""

    name: ClassVar[str]
    sentence: ClassVar[str]
    """What it means, for the reader."""
    resembles: ClassVar[tuple[str, ...]] = ()
    """Effects of which one may look like this one, and of which the prediction for a large one says little."""
    includes: ClassVar[tuple[str, ...]] = ()
    """Effects that are this one with some of its numbers as nature has them, such as a period of one turn."""

    @abstractmethod
    def places(self, drive: Drive) -> Iterable[str]:
        """Return the components at which the effect makes sense and is not modelled yet."""

    @abstractmethod
    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        """Return the drive with the effect at a place."""

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive whose effect at a place has a more general shape than `augment` gave it, if there is one.

        What a machine has is never quite of the shape that a catalogue gives it.
        """
        return None

    def hiding(self, drive: Drive, place: str, clues: Clues) -> Hiding | None:
        """Return the effect as one that only slow motion shows; None where it is not of that kind."""
        return None

    def addition(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        """Return the drive with the effect at a place; of a more general shape where it has it there already."""
        return self.reshaped(drive, place, clues) or self.augment(drive, place, clues)


def fitted_friction(drive: Drive, place: str, clues: Clues) -> FrictionElement:
    """Return the friction of a shaft with the numbers of the base fit."""
    return bind(drive.shaft(place).friction, f"{place}.friction", clues.numbers)


def change_shaft(drive: Drive, name: str, **changes: Any) -> Drive:
    """Return the drive with some fields of a shaft replaced."""
    shafts = tuple(replace(item, **changes) if item.name == name else item for item in drive.shafts)
    return replace(drive, shafts=shafts)


def change_transmission(drive: Drive, name: str, **changes: Any) -> Drive:
    """Return the drive with some fields of a transmission replaced."""
    items = tuple(replace(item, **changes) if item.name == name else item for item in drive.transmissions)
    return replace(drive, transmissions=items)


def change_motor(drive: Drive, name: str, **changes: Any) -> Drive:
    """Return the drive with some fields of a motor replaced."""
    return replace(drive, motors=tuple(replace(m, **changes) if m.name == name else m for m in drive.motors))


def change_channel(drive: Drive, name: str, **changes: Any) -> Drive:
    """Return the drive with some fields of a channel replaced."""
    return replace(drive, channels=tuple(replace(c, **changes) if c.name == name else c for c in drive.channels))


def transmission(drive: Drive, name: str) -> Transmission:
    """Return the transmission called `name`."""
    return next(item for item in drive.transmissions if item.name == name)


SHARE, SCALES = 0.5, (0.1, 0.3, 1.0, 3.0, 10.0)
"""Share of springs beside something that relaxes, as they are tried, and their scale over that of the latter. Where
springs alone are the truth, half of them may be better than none though a few are worse: it is begun there, too."""
UNEQUAL = 100.0
"""What one spring carries over another at most."""
RANGE = 1e3
"""Bounds of an added parameter over its first guess."""


def either_way(size: float) -> Free:
    """Return a parameter that may have either sign."""
    return Free(size, -RANGE * size, RANGE * size)


def upwards(size: float) -> Free:
    """Return a parameter that is not negative."""
    return Free(size, 0.0, RANGE * size)


Springs = TypeVar("Springs")


def springs_beside(
    kind: Callable[[Free, Free, Free, Free], Springs],
    added: Callable[[Springs], Drive],
    path: str,
    scale: str,
    relaxing: Free,
    now: float,
) -> Augmentation:
    """Return the drive that has `added` springs that slip beside something that relaxes.

    `scale` names what both have of `relaxing`, which is `now` that of the latter.
    """
    springs = kind(Free(SHARE, 0.0, 1.0), Free(1.0, 0.0, UNEQUAL), Free(1.0, 0.0, UNEQUAL), relaxing)
    equal, carried = {f"{path}.soft": 1.0, f"{path}.stiff": 1.0}, {f"{path}.share": SHARE}
    trials = tuple(Trial((carried,), {**equal, f"{path}.{scale}": factor * now}) for factor in SCALES)
    half = {**carried, **equal, f"{path}.{scale}": now}
    return Augmentation(added(springs), {f"{path}.share": 0.0}, trials, outright=(half,))


def motor_of(drive: Drive, shaft: str) -> Motor | None:
    """Return the motor on a shaft."""
    return next((motor for motor in drive.motors if motor.shaft == shaft), None)


def channel(drive: Drive, name: str) -> Channel:
    """Return the channel called `name`."""
    return next(item for item in drive.channels if item.name == name)


def moving_shafts(drive: Drive) -> list[Shaft]:
    """Return the shafts whose motion is not prescribed by an input, and those of which an output sees what it takes."""
    seen = {item.part for item in drive.outputs}
    held = {motor.shaft for motor in drive.motors if seen & {motor.name}}
    driven = drive.prescribed - held - {item.part for item in drive.outputs if item.signal == DRIVE_TORQUE}
    return [shaft for shaft in drive.shafts if shaft.name not in driven]
