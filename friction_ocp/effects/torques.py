"""Effects that put a torque on a shaft, or a further body beside it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from friction_ocp.drive.parts import Drive, ExternalTorque, Gravity, Shaft, Transmission
from friction_ocp.effects.effect import (
    SHARP,
    AbstractEffect,
    Augmentation,
    Clues,
    Trial,
    change_shaft,
    either_way,
    moving_shafts,
)
from friction_ocp.effects.friction_curve import SHARE
from friction_ocp.parameters import Free


class UnbalanceEffect(AbstractEffect):
    """Gravity torque on the shaft."""

    name: ClassVar[str] = "unbalance"
    sentence: ClassVar[str] = "gravity pulls at the shaft: an unbalanced mass"
    resembles: ClassVar[tuple[str, ...]] = ("cogging",)

    def places(self, drive: Drive) -> Iterable[str]:
        known = {shaft.name for shaft in drive.shafts if shaft.gravity is not None and shaft.gravity.torque != 0.0}
        return [item.name for item in moving_shafts(drive) if item.motion == "rotary" and item.name not in known]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        size, torque, phase = SHARE * clues.typical_torque[place], f"{place}.gravity.torque", f"{place}.gravity.phase"
        gravity = Gravity(either_way(size), Free(0.0, -2.0 * np.pi, 2.0 * np.pi))
        added = change_shaft(drive, place, gravity=gravity)
        trials = tuple(Trial(({torque: size},), {phase: angle}) for angle in np.pi * np.arange(8) / 8)
        return Augmentation(added, {torque: 0.0, phase: 0.0}, trials)


class ConstantTorqueEffect(AbstractEffect):
    """A constant torque."""

    name: ClassVar[str] = "constant_torque"
    sentence: ClassVar[str] = "a constant torque pulls at the shaft"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in moving_shafts(drive) if item.external_torque is None]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        size, path = SHARE * clues.typical_torque[place], f"{place}.external_torque.constant"
        added = change_shaft(drive, place, external_torque=ExternalTorque(either_way(size)))
        return Augmentation(added, {path: 0.0}, (Trial(({path: size},)),))


BLUNT = 0.1
"""Damping over inertia and angular frequency of modes on a coarse grid."""
MOST_HUNG = 0.7
"""Share of the inertia that hangs on the spring where most of it does: the resonance is then twice the zero."""
LIGHTEST = 0.01
"""Inertia that stays rigid over the one that is stated, at least."""


def mode_of(shaft: str) -> str:
    """Return the name of the inertia that hangs on a shaft by a spring once that effect is in."""
    return f"{shaft}_mode"


class StructuralModeEffect(AbstractEffect):
    """A further inertia on a spring, or some of that which is stated.

    One that nothing damps is none: what rings for ever is driven, and no part of the machine.
    """

    name: ClassVar[str] = "structural_mode"
    sentence: ClassVar[str] = "a further inertia hangs on the shaft by a spring"
    resembles: ClassVar[tuple[str, ...]] = ("compliance",)

    def places(self, drive: Drive) -> Iterable[str]:
        taken = {shaft.name for shaft in drive.shafts}
        for shaft in moving_shafts(drive):
            if not shaft.name.endswith(mode_of("")) and mode_of(shaft.name) not in taken:
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        shaft, mode = drive.shaft(place), mode_of(place)
        inertia = 0.1 * clues.numbers[f"{place}.inertia"]
        step = float(np.median(np.diff(clues.tracks[0].time)))
        longest = max(float(track.time[-1] - track.time[0]) for track in clues.tracks)
        rates = [float(rate) for rate in 2.0 * np.pi * np.geomspace(5.0 / longest, 0.1 / step, 12)]
        stiffness, damping = f"{place}-{mode}.stiffness", f"{place}-{mode}.damping"
        springs = [inertia * rate**2 for rate in rates]
        joint = Transmission(
            place,
            mode,
            1.0,
            stiffness=Free(springs[6], 0.1 * springs[0], 10.0 * springs[-1]),
            damping=Free(0.1 * inertia * rates[6], 0.0, 10.0 * inertia * rates[-1]),
        )
        body = Shaft(mode, Free(inertia, 1e-3 * inertia, 1e2 * inertia), motion=shaft.motion)
        host, off = _lightened(shaft), {f"{mode}.inertia": 0.0}
        if host is not shaft:
            off[f"{place}.inertia"] = float(shaft.inertia)
        grown = change_shaft(drive, place, inertia=host.inertia)
        added = replace(grown, shafts=(*grown.shafts, body), transmissions=(*drive.transmissions, joint))
        tried = [(rate, BLUNT) for rate in rates]
        tried += [(rate, SHARP) for rate in clues.ringing(place, rates[0], rates[-1])]
        trials = tuple(
            Trial(({f"{mode}.inertia": inertia, stiffness: inertia * rate**2, damping: ratio * inertia * rate},))
            for rate, ratio in tried
        )
        joint_paths = (stiffness, damping)

        def large(small: Mapping[str, float]) -> Mapping[str, float]:
            whole = clues.numbers[f"{place}.inertia"]
            grown = MOST_HUNG * whole / max(small[f"{mode}.inertia"], 1e-300)
            hung = {f"{mode}.inertia": MOST_HUNG * whole, **{path: grown * small[path] for path in joint_paths}}
            return {**small, **hung, f"{place}.inertia": (1.0 - MOST_HUNG) * whole}

        return Augmentation(added, off, trials, large, inside=(damping,))


def _lightened(shaft: Shaft) -> Shaft:
    """Return the shaft with an inertia that may be less than stated: the statement may count what hangs on a spring."""
    if not isinstance(shaft.inertia, (int, float)) or not shaft.inertia > 0:
        return shaft
    return replace(shaft, inertia=Free(shaft.inertia, LIGHTEST * shaft.inertia, shaft.inertia))
