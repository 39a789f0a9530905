"""Effects in a transmission."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np

from friction_ocp.drive.parts import Drive, Hysteresis, KinematicError, Transmission
from friction_ocp.effects.effect import (
    SHARP,
    AbstractEffect,
    Augmentation,
    Clues,
    Trial,
    change_transmission,
    transmission,
    upwards,
)
from friction_ocp.effects.periodic import AbstractWaveEffect
from friction_ocp.friction.wave import Wave
from friction_ocp.parameters import Free, is_off


class BacklashEffect(AbstractEffect):
    """Free play."""

    name: ClassVar[str] = "backlash"
    sentence: ClassVar[str] = "free play between the flanks"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if not item.rigid and item.backlash == 0.0]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        item, path = transmission(drive, place), f"{place}.backlash"
        torque = clues.typical_torque[item.to_shaft]
        twist = torque / max(clues.numbers[f"{place}.stiffness"], 1e-300)
        plays = [0.1 * twist, 0.5 * twist, 2.0 * twist]
        added = change_transmission(drive, place, backlash=upwards(twist))
        return Augmentation(added, {path: 0.0}, tuple(Trial(({path: play},)) for play in plays))


class ComplianceEffect(AbstractEffect):
    """Elastic where the model says rigid."""

    name: ClassVar[str] = "compliance"
    sentence: ClassVar[str] = "elastic where the model says rigid"
    resembles: ClassVar[tuple[str, ...]] = ("structural_mode",)

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if item.rigid]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        item, path = transmission(drive, place), f"{place}.stiffness"
        ratio = abs(clues.numbers.get(f"{place}.ratio", 1.0))
        near = clues.numbers[f"{item.from_shaft}.inertia"] * ratio**2
        far = clues.numbers[f"{item.to_shaft}.inertia"]
        inertia = near * far / max(near + far, 1e-300) or max(near, far)
        step = float(np.median(np.diff(clues.tracks[0].time)))
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
        return Augmentation(added, {path: np.inf}, trials)


def _twist(item: Transmission, clues: Clues) -> tuple[float, float]:
    """Return typical torque, N m, and twist, rad, of an elastic transmission on its output side."""
    torque = clues.typical_torque[item.to_shaft]
    return torque, torque / max(clues.numbers[f"{item.name}.stiffness"], 1e-300)


class StiffeningEffect(AbstractEffect):
    """Stiffness grows with the twist."""

    name: ClassVar[str] = "stiffening"
    sentence: ClassVar[str] = "stiffness grows with the twist"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if not item.rigid and is_off(item.stiffening)]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        torque, twist = _twist(transmission(drive, place), clues)
        size, path = 0.1 * torque / twist**3, f"{place}.stiffening"
        added = change_transmission(drive, place, stiffening=Free(size, 0.0, 1e4 * size))
        return Augmentation(added, {path: 0.0}, (Trial(({path: size},)),))


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

    def size_and_periods(self, drive: Drive, place: str, clues: Clues) -> tuple[float, list[float]]:
        item = transmission(drive, place)
        _, twist = _twist(item, clues)
        found = [*clues.periods(item.from_shaft, "theta")[:2], *clues.periods(item.to_shaft, "theta")[:2]]
        ratio = abs(clues.numbers.get(f"{place}.ratio", 1.0))
        return 0.1 * twist, [*found[:2], *(ratio * one for one in found[2:]), 2.0 * np.pi, np.pi]
