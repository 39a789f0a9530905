"""Effects in a transmission."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Trial, change_transmission, transmission
from friction_ocp.parameters import Free


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
        added = change_transmission(drive, place, backlash=Free(twist, 0.0, 1e3 * twist))
        return Augmentation(added, {path: 0.0}, tuple(Trial(({path: play},)) for play in plays))


class ComplianceEffect(AbstractEffect):
    """Elastic where the model says rigid."""

    name: ClassVar[str] = "compliance"
    sentence: ClassVar[str] = "elastic where the model says rigid"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in drive.transmissions if item.rigid]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        item, path = transmission(drive, place), f"{place}.stiffness"
        ratio = abs(clues.numbers.get(f"{place}.ratio", 1.0))
        near = clues.numbers[f"{item.from_shaft}.inertia"] * ratio**2
        far = clues.numbers[f"{item.to_shaft}.inertia"]
        inertia = near * far / max(near + far, 1e-300) or max(near, far)
        step = float(np.median(np.diff(clues.tracks[0].time)))
        rates = 2.0 * np.pi * np.geomspace(0.01 / step, 0.2 / step, 5)
        springs = [float(inertia * rate**2) for rate in rates]
        damping = [float(0.2 * inertia * rate) for rate in rates]
        added = change_transmission(
            drive,
            place,
            stiffness=Free(springs[2], 1e-2 * springs[0], 1e2 * springs[-1]),
            damping=Free(damping[2], 0.0, 1e2 * damping[-1]),
        )
        trials = tuple(
            Trial(({path: spring},), {f"{place}.damping": loss}, inverse=True)
            for spring, loss in zip(springs, damping, strict=True)
        )
        return Augmentation(added, {path: np.inf}, trials)
