"""Effects periodic in an angle or in time; their periods come from the spectrum of the torque that is missing."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, ClassVar

from friction_ocp.drive.parts import Cogging, Disturbance, Drive, Eccentricity, Motor, TorqueRipple
from friction_ocp.effects.effect import (
    AbstractEffect,
    Augmentation,
    Clues,
    Trial,
    change_channel,
    change_motor,
    change_shaft,
    channel,
    either_way,
    motor_of,
    moving_shafts,
)
from friction_ocp.effects.friction_curve import SHARE, is_dry
from friction_ocp.effects.periods import Likely
from friction_ocp.friction.modifiers import Ripple
from friction_ocp.friction.wave import Wave
from friction_ocp.parameters import Free, start_of


def wave(
    stem: str, size: float, waves: Sequence[Likely], apart: Sequence[str] = ()
) -> tuple[dict[str, Any], dict[str, float], tuple[Trial, ...]]:
    """Return the numbers of a wave by name, their off values by path and a trial for each of some likely waves.

    `stem` is what the paths of its numbers begin with; `apart` are recordings that have a phase each, if they have: the
    wave then has one size, and is counted from a crest in each.
    """
    periods, parts = [one.period for one in waves], ("cosine",) if apart else ("cosine", "sine")
    numbers: dict[str, Any] = dict.fromkeys(parts, either_way(size))
    numbers["period"] = Free(periods[0], 0.5 * min(periods), 2.0 * max(periods))
    if apart:
        numbers |= {"sine": 0.0, "origin": _of_each(periods[0])}
    names = [f"{stem}{part}" for part in parts]
    fixed = [
        {f"{stem}period": one.period, **{f"{stem}origin@{name}": one.crests.get(name, 0.0) for name in apart}}
        for one in waves
    ]
    trials = tuple(Trial(tuple({name: size} for name in names), values) for values in fixed)
    return numbers, dict.fromkeys(names, 0.0), trials


def _of_each(period: float) -> Free:
    """Return the place from which each recording counts a wave of about some period."""
    return Free(STEP * period, scope="recording")


def has_own(part: Wave) -> bool:
    """Whether a wave has a phase in each recording."""
    return isinstance(part.origin, Free) and part.origin.scope == "recording"


STEP = 0.1
"""Share of a period by which the place from which a wave is counted is moved to see what comes of it."""
FURTHER = 0.1
"""Size of a trial overtone, or of a wave of another period, over the wave's own."""
SUBHARMONIC = 2.0
"""Period over that of a wave that a further one begins with, where nothing of another period is seen to be missing."""
ORDERS = (1, 2, 3)
"""Of a wave and its overtones: where what is missing most of these has another phase in each recording, all have."""
SAME_PERIOD = 0.1
"""Relative difference up to which a period of what is missing is taken for that of the wave, or of an overtone."""


def set_apart(
    part: Any, path: str, clues: Clues, period: float, apart: Sequence[str]
) -> tuple[Any, dict[str, float], tuple[Trial, ...]]:
    """Return a wave that has a phase in each recording, the values of the one that it had, and a trial."""
    now = _found(part, path, clues)
    size = math.hypot(*now.values()) or FURTHER
    crest = math.atan2(now["sine"], now["cosine"]) * period / (2.0 * math.pi)
    origins = {f"{path}.origin@{name}": crest for name in apart}
    trial = Trial(tuple({name: value + STEP * period} for name, value in origins.items()))
    moved = replace(part, cosine=either_way(size), sine=0.0, origin=_of_each(period))
    return moved, {**origins, f"{path}.cosine": size}, (trial,)


def overtones(part: Any, path: str, clues: Clues) -> tuple[Any, dict[str, float], tuple[Trial, ...]]:
    """Return a wave with free overtones, at half and at a third of its period, their off values and a trial."""
    size = _further_size(part, path, clues)
    kinds = [f"{order}_{kind}" for order in ("second", "third") for kind in ("cosine", "sine")]
    names = [f"{path}.{kind}" for kind in kinds]
    trial = Trial(tuple({name: size} for name in names))
    return replace(part, **dict.fromkeys(kinds, either_way(size))), dict.fromkeys(names, 0.0), (trial,)


def other_wave(
    part: Any, path: str, clues: Clues, waves: Sequence[Likely], apart: Sequence[str] = ()
) -> tuple[Any, dict[str, float], tuple[Trial, ...]]:
    """Return a wave with a free one of another period beside it, off values and a trial for each likely one."""
    numbers, off, trials = wave(f"{path}.other_", _further_size(part, path, clues), waves, apart)
    return replace(part, **{f"other_{name}": value for name, value in numbers.items()}), off, trials


def _further_size(part: Any, path: str, clues: Clues) -> float:
    return FURTHER * math.hypot(*_found(part, path, clues).values()) or FURTHER


def _found(part: Any, path: str, clues: Clues) -> dict[str, float]:
    """Return the fitted cosine and sine parts of a wave, by name."""
    return {kind: clues.numbers.get(f"{path}.{kind}", start_of(getattr(part, kind))) for kind in ("cosine", "sine")}


class AbstractWaveEffect(AbstractEffect):
    """A wave that a part of the drive lacks; once one was accepted, with overtones and a wave of another period.

    It has a phase in each recording where these show that; also once one was accepted. A wave of another period has one
    of its own only where `over_time`: that of an angle is counted from the same zero.
    """

    kind: ClassVar[type[Wave]]
    over_time: ClassVar[bool] = False

    @abstractmethod
    def there(self, drive: Drive, place: str) -> tuple[Any, str]:
        """Return the wave at a place, None where there is none, and the path of its numbers."""

    @abstractmethod
    def with_wave(self, drive: Drive, place: str, part: Any) -> Drive:
        """Return the drive with a wave at a place."""

    @abstractmethod
    def size_and_waves(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[Likely]]:
        """Return the size of a trial and the waves that are tried."""

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        path, (size, found) = self.there(drive, place)[1], self.size_and_waves(drive, place, clues)
        numbers, off, trials = wave(f"{path}.", size, found, clues.apart(found))
        return Augmentation(self.with_wave(drive, place, self.kind(**numbers)), off, trials)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        part, path = self.there(drive, place)
        if part is None or (part.has_overtones and part.has_other):
            return None
        period = clues.numbers.get(f"{path}.period", start_of(part.period))
        _, found = self.size_and_waves(drive, place, clues)
        own = [one for one in found if any(abs(order * one.period / period - 1.0) < SAME_PERIOD for order in ORDERS)]
        apart = clues.apart(own) if own else ()
        plain = not (has_own(part) or part.has_overtones or part.has_other)
        if plain and apart:
            part, off, trials = set_apart(part, path, clues, period, apart)
            return Augmentation(self.with_wave(drive, place, part), off, trials)
        off, trials = dict[str, float](), tuple[Trial, ...]()
        if not part.has_overtones:
            part, off, trials = overtones(part, path, clues)
        if not part.has_other:
            strange = [one for one in found if one not in own] or [Likely(SUBHARMONIC * period)]
            each = clues.recordings if has_own(part) and self.over_time else ()
            part, none, further = other_wave(part, path, clues, strange, each)
            off, trials = off | none, trials + further
        return Augmentation(self.with_wave(drive, place, part), off, trials)


class PositionRippleEffect(AbstractWaveEffect):
    """Friction varies with the angle."""

    name: ClassVar[str] = "position_ripple"
    sentence: ClassVar[str] = "friction varies with the angle"
    kind: ClassVar[type[Wave]] = Ripple

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in moving_shafts(drive) if is_dry(item) and item.friction.ripple is None]

    def there(self, drive: Drive, place: str) -> tuple[Any, str]:
        return drive.shaft(place).friction.ripple, f"{place}.friction.ripple"

    def with_wave(self, drive: Drive, place: str, part: Any) -> Drive:
        return change_shaft(drive, place, friction=replace(drive.shaft(place).friction, ripple=part))

    def size_and_waves(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[Likely]]:
        return SHARE, clues.waves(place, "theta", against_motion=True)


def _driven(drive: Drive) -> dict[str, Motor]:
    """Return the motor on every moving shaft that has one."""
    motors = {motor.shaft: motor for motor in drive.motors}
    return {shaft.name: motors[shaft.name] for shaft in moving_shafts(drive) if shaft.name in motors}


def _motor_at(drive: Drive, shaft: str) -> Motor:
    motor = motor_of(drive, shaft)
    assert motor is not None
    return motor


class AbstractMotorWaveEffect(AbstractWaveEffect):
    """A wave over the angle of a motor, in the field of the motor that has the effect's name."""

    def places(self, drive: Drive) -> Iterable[str]:
        return [name for name, motor in _driven(drive).items() if getattr(motor, self.name) is None]

    def there(self, drive: Drive, place: str) -> tuple[Any, str]:
        motor = _motor_at(drive, place)
        return getattr(motor, self.name), f"{motor.name}.{self.name}"

    def with_wave(self, drive: Drive, place: str, part: Any) -> Drive:
        return change_motor(drive, _motor_at(drive, place).name, **{self.name: part})


class CoggingEffect(AbstractMotorWaveEffect):
    """Torque periodic in the motor angle."""

    name: ClassVar[str] = "cogging"
    sentence: ClassVar[str] = "a torque periodic in the motor angle, with or without current"
    includes: ClassVar[tuple[str, ...]] = ("unbalance",)
    kind: ClassVar[type[Wave]] = Cogging

    def size_and_waves(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[Likely]]:
        return SHARE * clues.typical_torque[place], clues.waves(place, "theta")


class TorqueRippleEffect(AbstractMotorWaveEffect):
    """Torque periodic in the motor angle and proportional to current."""

    name: ClassVar[str] = "torque_ripple"
    sentence: ClassVar[str] = "the motor's torque ripples with its angle, in proportion to the current"
    kind: ClassVar[type[Wave]] = TorqueRipple

    def size_and_waves(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[Likely]]:
        return SHARE, clues.waves(place, "theta", against_torque=_motor_at(drive, place).name)


class PeriodicDisturbanceEffect(AbstractWaveEffect):
    """External torque periodic in time."""

    name: ClassVar[str] = "periodic_disturbance"
    sentence: ClassVar[str] = "an external torque periodic in time"
    kind: ClassVar[type[Wave]] = Disturbance
    over_time: ClassVar[bool] = True

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in moving_shafts(drive) if item.disturbance is None]

    def there(self, drive: Drive, place: str) -> tuple[Any, str]:
        return drive.shaft(place).disturbance, f"{place}.disturbance"

    def with_wave(self, drive: Drive, place: str, part: Any) -> Drive:
        return change_shaft(drive, place, disturbance=part)

    def size_and_waves(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[Likely]]:
        return SHARE * clues.typical_torque[place], clues.waves_in_time(place)


LARGEST = 0.5
"""Once-per-turn error, rad, beyond which a sensor is broken rather than eccentric."""


class SensorEccentricityEffect(AbstractEffect):
    """A once-per-turn error of an angle sensor, whose zero then is where the disc was mounted: unknown, too."""

    name: ClassVar[str] = "sensor_eccentricity"
    sentence: ClassVar[str] = "the angle sensor has a once-per-turn error"

    def places(self, drive: Drive) -> Iterable[str]:
        rotary = {shaft.name for shaft in drive.shafts if shaft.motion == "rotary"}
        angles = [item for item in drive.outputs if item.signal == "theta" and item.part in rotary]
        return [item.name for item in angles if item.eccentricity is None]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        size, path, offset = 1e-3, f"{place}.eccentricity", f"{place}.offset"
        amplitude = Free(size, -LARGEST, LARGEST)
        sizes = {f"{path}.cosine": size, f"{path}.sine": size}
        waves = tuple(sizes)
        added = change_channel(drive, place, eccentricity=Eccentricity(amplitude, amplitude))
        if channel(drive, place).offset == 0.0:
            added, sizes = change_channel(added, place, offset=either_way(size)), {**sizes, offset: size}
        trial = Trial(tuple({name: value} for name, value in sizes.items()))
        return Augmentation(added, dict.fromkeys(sizes, 0.0), (trial,), inside=waves)
