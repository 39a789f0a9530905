"""Friction that drifts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar

from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Trial, change_shaft, moving_shafts
from friction_ocp.friction.composite import plain_law, viscous_part
from friction_ocp.friction.modifiers import WarmUp
from friction_ocp.friction.static import NoFriction
from friction_ocp.parameters import Free


class WarmUpEffect(AbstractEffect):
    """Friction drifts with time, or with the temperature where it is recorded."""

    name: ClassVar[str] = "warm_up"
    sentence: ClassVar[str] = "friction drifts with time or temperature"

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            if not isinstance(plain_law(shaft.friction.law), NoFriction) and shaft.friction.warm_up is None:
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        shaft, path = drive.shaft(place), f"{place}.friction.warm_up"
        if any(item.measures == "temperature" for item in drive.inputs):
            part = WarmUp(per_kelvin=Free(-0.01, -0.2, 0.2), reference_temperature=25.0)
            off, trials = {f"{path}.per_kelvin": 0.0}, (Trial(({f"{path}.per_kelvin": -0.005},)),)
        else:
            longest = max(float(track.time[-1] - track.time[0]) for track in clues.tracks)
            times = [0.1 * longest, 0.3 * longest, longest]
            part = WarmUp(amplitude=Free(-0.1, -0.95, 5.0), time_constant=Free(times[1], 0.01 * longest, 100 * longest))
            off = {f"{path}.amplitude": 0.0}
            trials = tuple(Trial(({f"{path}.amplitude": -0.05},), {f"{path}.time_constant": one}) for one in times)
        element = replace(shaft.friction, warm_up=part)
        return Augmentation(change_shaft(drive, place, friction=element), off, trials)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        element, path = drive.shaft(place).friction, f"{place}.friction.warm_up.viscous_excess"
        drift = element.warm_up
        if drift is None or not isinstance(drift.amplitude, Free) or drift.viscous_excess is not None:
            return None
        if viscous_part(element.law) is None:
            return None
        changed = replace(element, warm_up=replace(drift, viscous_excess=Free(-0.1, -5.0, 5.0)))
        return Augmentation(change_shaft(drive, place, friction=changed), {path: 0.0}, (Trial(({path: -0.05},)),))
