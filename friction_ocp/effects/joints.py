"""Effects in a transmission."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from friction_ocp.drive.parts import ROUNDING, Drive, Hysteresis, KinematicError, LoopSprings, SecondStage, Transmission
from friction_ocp.drive.topology import topology
from friction_ocp.effects.effect import (
    SHARP,
    AbstractEffect,
    Augmentation,
    Clues,
    Trial,
    change_shaft,
    change_transmission,
    springs_beside,
    transmission,
    upwards,
)
from friction_ocp.effects.friction_curve import PARTS, halved, is_dry
from friction_ocp.effects.periodic import AbstractWaveEffect
from friction_ocp.effects.periods import Likely
from friction_ocp.friction.static import CoulombViscous, NoFriction
from friction_ocp.friction.wave import Wave
from friction_ocp.parameters import Free, is_off

RUBS = 0.05
"""Friction on the other side of a joint over the typical torque there, for its bounds."""
HARD = 0.1
"""Frequency at which a drive swings on flanks of a joint that the model says is rigid, over that of the samples."""
RUNG, LARGEST_PLAY = 5.0, 0.03
"""How far apart the plays are at which backlash is tried beyond the twist of the spring, and the largest one over the
travel: flanks that are hard twist much less than they are apart."""
OF_TWIST, NEARLY_ALL = 2.0 / 3.0, 0.9
"""Large play over the range of the twist: what is left of it twists the flanks. Where it is nearly all of it, a model
without play has made its spring as much softer as it takes to twist as far."""
STAGES = (0.1, 0.3, 0.8, 2.0)
"""Twists from which a second stage is tried, over the largest one."""
RARE = 0.01
"""Share of the samples at either end that does not count for a range."""


class BacklashEffect(AbstractEffect):
    """Free play."""

    name: ClassVar[str] = "backlash"
    sentence: ClassVar[str] = "free play between the flanks"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if item.rigid or item.backlash == 0.0]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        item = transmission(drive, place)
        return _play_of_rigid(drive, item, clues) if item.rigid else self._play(drive, item, clues)

    def _play(self, drive: Drive, item: Transmission, clues: Clues) -> Augmentation:
        place, path = item.name, f"{item.name}.backlash"
        _, twist = _twist(item, clues)
        plays = [0.1 * twist, 0.5 * twist, 2.0 * twist]
        while plays[-1] * RUNG <= LARGEST_PLAY * _travel(item, clues):
            plays.append(plays[-1] * RUNG)
        added = change_transmission(drive, place, backlash=upwards(twist))
        stiffness, seen = f"{place}.stiffness", _range_of_twist(item, clues)
        harder = _stiffness(item, clues) / (1.0 - NEARLY_ALL)
        large = ({path: OF_TWIST * seen}, {path: NEARLY_ALL * seen, stiffness: harder})
        trials = tuple(Trial(({path: play},)) for play in plays)
        return Augmentation(added, {path: 0.0}, trials, outright=large)


def _range_of_twist(item: Transmission, clues: Clues) -> float:
    """Return the range over which a joint twists along a recording, rad on its output side."""
    ratio = clues.numbers.get(f"{item.name}.ratio", 1.0)
    twists = [track.theta[item.from_shaft] / ratio - track.theta[item.to_shaft] for track in clues.tracks]
    return max(float(np.ptp(np.quantile(twist, [RARE, 1.0 - RARE]))) for twist in twists)


def _travel(item: Transmission, clues: Clues) -> float:
    return max(float(np.ptp(track.theta[item.to_shaft])) for track in clues.tracks)


def _play_of_rigid(drive: Drive, item: Transmission, clues: Clues) -> Augmentation:
    """Return the drive with play between flanks as hard as the samples can tell, where there was no twist at all."""
    rate, inertia = 2.0 * np.pi * HARD / _interval(clues), _swinging(item, clues)
    spring, loss = inertia * rate**2, 2.0 * inertia * rate
    plays = [LARGEST_PLAY * _travel(item, clues) / RUNG**k for k in range(4)]
    path, contact = f"{item.name}.backlash", {f"{item.name}.stiffness": spring, f"{item.name}.damping": loss}
    added = change_transmission(
        drive,
        item.name,
        stiffness=Free(spring, 1e-3 * spring, 1e2 * spring),
        damping=Free(loss, 0.0, 1e2 * loss),
        backlash=upwards(plays[-1]),
    )
    off = {path: 0.0, f"{item.name}.stiffness": np.inf}
    trials = tuple(Trial(({path: play},), contact) for play in plays)
    return _rubbing_apart(drive, item, clues, Augmentation(added, off, trials))


def _rubbing_apart(drive: Drive, item: Transmission, clues: Clues, apart: Augmentation) -> Augmentation:
    """Return an addition to a joint that was rigid with friction on both sides of it, tried as it is and half on each.

    While a joint is rigid it makes no difference on which side of it something rubs, and a model may have all on one.
    """
    ends, joints = (item.from_shaft, item.to_shaft), topology(apart.drive)
    sides = [joints.members(joints.group_of[name]) for name in ends]
    for name, side, others in zip(ends, sides, reversed(sides), strict=True):
        dry = [other for other in others if is_dry(drive.shaft(other))]
        if not dry or not all(isinstance(drive.shaft(own).friction.law, NoFriction) for own in side):
            continue
        torque, speed = clues.typical_torque[name], clues.typical_speed(name)
        law = CoulombViscous(upwards(RUBS * torque), upwards(RUBS * torque / speed))
        added = change_shaft(apart.drive, name, friction=replace(drive.shaft(name).friction, law=law))
        off = {f"{name}.friction.{part}": 0.0 for part in PARTS}
        half = halved(drive, dry, name, clues)
        split = [replace(trial, fixed={**trial.fixed, **half}) for trial in apart.trials]
        apart = replace(apart, drive=added, off={**apart.off, **off}, trials=(*apart.trials, *split))
    return apart


def _interval(clues: Clues) -> float:
    return float(np.median(np.diff(clues.tracks[0].time)))


def _swinging(item: Transmission, clues: Clues) -> float:
    """Return the inertia that swings on a spring between both sides of a joint, on the output side."""
    near = clues.numbers[f"{item.from_shaft}.inertia"] * abs(clues.numbers.get(f"{item.name}.ratio", 1.0)) ** 2
    far = clues.numbers[f"{item.to_shaft}.inertia"]
    return near * far / max(near + far, 1e-300) or max(near, far)


class ComplianceEffect(AbstractEffect):
    """Elastic where the model says rigid."""

    name: ClassVar[str] = "compliance"
    sentence: ClassVar[str] = "elastic where the model says rigid"
    resembles: ClassVar[tuple[str, ...]] = ("structural_mode",)

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if item.rigid]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        item, path = transmission(drive, place), f"{place}.stiffness"
        inertia, step = _swinging(item, clues), _interval(clues)
        rates = [float(rate) for rate in 2.0 * np.pi * np.geomspace(0.01 / step, 0.2 / step, 5)]
        springs = [inertia * rate**2 for rate in rates]
        damping = [0.2 * inertia * rate for rate in rates]
        heard = clues.ringing(item.from_shaft, 0.1 * rates[0], rates[-1])
        added = change_transmission(
            drive,
            place,
            stiffness=Free(springs[2], 1e-2 * springs[0], 1e2 * springs[-1]),
            damping=Free(damping[2], 0.0, 1e2 * damping[-1]),
        )
        tried = [*zip(springs, damping, strict=True), *((inertia * w**2, SHARP * inertia * w) for w in heard)]
        trials = tuple(Trial(({path: spring},), {f"{place}.damping": loss}, inverse=True) for spring, loss in tried)
        found = _rubbing_apart(drive, item, clues, Augmentation(added, {path: np.inf}, trials))
        likely = [*range(len(rates), len(trials)), *sorted(range(len(rates)), key=lambda k: abs(k - len(rates) // 2))]
        apart = found.trials[-len(trials) :]
        large = tuple({**apart[k].fixed, **apart[k].amplitudes[0]} for k in likely)
        return replace(found, outright=large)


def _twist(item: Transmission, clues: Clues) -> tuple[float, float]:
    """Return typical torque, N m, and twist, rad, of an elastic transmission on its output side."""
    torque = clues.typical_torque[item.to_shaft]
    return torque, torque / _stiffness(item, clues)


def _stiffness(item: Transmission, clues: Clues) -> float:
    """Return the stiffness of an elastic transmission; of one that a fit has lost, what twists as far as it travels."""
    least = clues.typical_torque[item.to_shaft] / max(_travel(item, clues), 1e-300)
    return max(clues.numbers[f"{item.name}.stiffness"], least, 1e-300)


class StiffeningEffect(AbstractEffect):
    """Stiffness grows with the twist."""

    name: ClassVar[str] = "stiffening"
    sentence: ClassVar[str] = "stiffness grows with the twist"

    def places(self, drive: Drive) -> Iterable[str]:
        elastic = [item for item in drive.transmissions if not item.rigid and is_off(item.stiffening)]
        return [item.name for item in elastic if item.second_stage is None]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        item, path = transmission(drive, place), f"{place}.second_stage"
        size, largest = 0.3 * _stiffness(item, clues), 0.5 * _range_of_twist(item, clues)
        twists = [max(share * largest, 1e-300) for share in STAGES]
        stage = SecondStage(upwards(size), Free(twists[1], 0.1 * twists[0], 10.0 * twists[-1]))
        added = change_transmission(drive, place, second_stage=stage)
        trials = tuple(Trial(({f"{path}.stiffness": size},), {f"{path}.twist": one}) for one in twists)
        return Augmentation(added, {f"{path}.stiffness": 0.0}, trials)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive whose second stage begins more suddenly, or less."""
        stage, path = transmission(drive, place).second_stage, f"{place}.second_stage.rounding"
        if stage is None or stage.rounding != ROUNDING:
            return None
        added = change_transmission(drive, place, second_stage=replace(stage, rounding=Free(ROUNDING, 0.02, 0.98)))
        return Augmentation(added, {path: ROUNDING}, (Trial(({path: 0.9 * ROUNDING},)),))


class TransmissionHysteresisEffect(AbstractEffect):
    """The twist has a loop."""

    name: ClassVar[str] = "transmission_hysteresis"
    sentence: ClassVar[str] = "the twist has a loop: friction inside the transmission"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if not item.rigid and item.hysteresis is None]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        torque, twist = _twist(transmission(drive, place), clues)
        path, size = f"{place}.hysteresis", 0.05 * torque
        twists = [0.05 * twist, 0.3 * twist, 2.0 * twist]
        loop = Hysteresis(upwards(size), Free(twists[1], 0.1 * twists[0], 10.0 * twists[-1]))
        added = change_transmission(drive, place, hysteresis=loop)
        trials = tuple(Trial(({f"{path}.torque": size},), {f"{path}.twist": one}) for one in twists)
        return Augmentation(added, {f"{path}.torque": 0.0}, trials)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive with springs that slip beside the bristle of its loop."""
        loop = transmission(drive, place).hysteresis
        if loop is None or loop.springs is not None or not isinstance(loop.twist, Free):
            return None
        path, now = f"{place}.hysteresis.springs", clues.numbers.get(f"{place}.hysteresis.twist", loop.twist.guess)

        def added(springs: LoopSprings) -> Drive:
            return change_transmission(drive, place, hysteresis=replace(loop, springs=springs))

        return springs_beside(LoopSprings, added, path, "twist", loop.twist, now)


class KinematicErrorEffect(AbstractWaveEffect):
    """The ratio ripples with the angle."""

    name: ClassVar[str] = "kinematic_error"
    sentence: ClassVar[str] = "the ratio ripples with the angle of the input shaft"
    kind: ClassVar[type[Wave]] = KinematicError

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if not item.rigid and item.kinematic_error is None]

    def there(self, drive: Drive, place: str) -> tuple[Any, str]:
        return transmission(drive, place).kinematic_error, f"{place}.kinematic_error"

    def with_wave(self, drive: Drive, place: str, part: Any) -> Drive:
        return change_transmission(drive, place, kinematic_error=part)

    def size_and_waves(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[Likely]]:
        item = transmission(drive, place)
        _, twist = _twist(item, clues)
        found = [*clues.periods(item.from_shaft, "theta")[:2], *clues.periods(item.to_shaft, "theta")[:2]]
        ratio = abs(clues.numbers.get(f"{place}.ratio", 1.0))
        turns = [] if item.from_shaft in clues.linear else [2.0 * np.pi, np.pi]
        periods = [*found[:2], *(ratio * one for one in found[2:]), *turns]
        return 0.1 * twist, [Likely(period) for period in periods]
