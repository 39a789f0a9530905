"""Friction that drifts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.effects.beginnings import begins_apart
from friction_ocp.effects.effect import (
    AbstractEffect,
    Augmentation,
    Clues,
    Trial,
    change_shaft,
    fitted_friction,
    moving_shafts,
)
from friction_ocp.effects.friction_curve import is_dry
from friction_ocp.friction.composite import plain_law, viscous_part
from friction_ocp.friction.modifiers import WarmUp
from friction_ocp.friction.static import NoFriction
from friction_ocp.parameters import Free

TIMES = (0.1, 0.3, 1.0)
"""Time constants over the longest recording at which it is tried."""
MOST = 5.0
"""Relative change of friction at its typical loss, at most: where that warms it, no loss can take friction away
altogether, since it goes with it."""
BEGUN = Free(0.1, -2.0, 2.0, prior_std=0.5, prior_mean=0.0, scope="recording")
"""How far friction has settled where a recording begins. Between a level and all of these a shift says nothing: what is
likely beforehand holds them."""


class WarmUpEffect(AbstractEffect):
    """Friction drifts with time or with what it loses, or with the temperature where that is recorded.

    Without a temperature the viscous part need not drift as the dry part does: a lubricant gets thin before a contact
    gets smooth; and what warms it are its own losses, something else, or both. Recordings begin as warm as one another,
    or each in its own way where they show that; also once it was accepted. What a base model has fitted in its place
    may look like that, too: where they seem to, it is tried from beginnings alike as well.
    """

    name: ClassVar[str] = "warm_up"
    sentence: ClassVar[str] = "friction drifts with time, its own losses or temperature"

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            if not isinstance(plain_law(shaft.friction.law), NoFriction) and shaft.friction.warm_up is None:
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        shaft, path = drive.shaft(place), _path(place)
        if any(item.measures == "temperature" for item in drive.inputs):
            part = WarmUp(per_kelvin=Free(-0.01, -0.2, 0.2), reference_temperature=25.0)
            off, trials = {f"{path}.per_kelvin": 0.0}, (Trial(({f"{path}.per_kelvin": -0.005},)),)
        else:
            longest = max(float(track.time[-1] - track.time[0]) for track in clues.tracks)
            times = [share * longest for share in TIMES]
            begun = begins_apart(drive, place, clues)
            sizes = {f"{path}.amplitude": -0.05}
            part = WarmUp(
                amplitude=Free(-0.1, -MOST, MOST),
                time_constant=Free(times[1], 0.01 * longest, 100 * longest),
                loss_share=Free(0.5, 0.0, 1.0),
                power=_typical_loss(drive, place, clues),
            )
            if is_dry(shaft) and viscous_part(shaft.friction.law) is not None:
                part = replace(part, viscous_excess=Free(0.0, -MOST, MOST))
                sizes[f"{path}.viscous_excess"] = -0.05
            off = dict.fromkeys(sizes, 0.0)
            if begun is not None:
                part = replace(part, begun=BEGUN)
                times = sorted(times, key=lambda one: abs(np.log(one / begun.time_constant)))
            own = {} if begun is None else begun.by_path(path)
            starts = [own] if begun is None else [own, dict.fromkeys(own, 0.0)]
            amplitudes = tuple({name: size} for name, size in sizes.items())
            trials = tuple(
                Trial(amplitudes, {f"{path}.time_constant": one, f"{path}.loss_share": share, **start})
                for start in starts
                for one in times
                for share in (0.0, 1.0)
            )
        added = change_shaft(drive, place, friction=replace(shaft.friction, warm_up=part))
        return Augmentation(added, off, trials, inside=tuple(off))

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        part, path = drive.shaft(place).friction.warm_up, _path(place)
        if part is None or part.amplitude is None or part.begun is not None:
            return None
        if begins_apart(drive, place, clues) is None:
            return None
        off = {f"{path}.begun@{name}": 0.0 for name in clues.recordings}
        moved = replace(drive.shaft(place).friction, warm_up=replace(part, begun=BEGUN))
        trial = Trial(tuple({name: BEGUN.guess} for name in off))
        return Augmentation(change_shaft(drive, place, friction=moved), off, (trial,))


def _path(place: str) -> str:
    return f"{place}.friction.warm_up"


def _typical_loss(drive: Drive, place: str, clues: Clues) -> float:
    """Return what the friction of a shaft loses at its mean speed, W."""
    speed = max(float(np.mean(np.abs(clues.speeds(place)))), 1e-12)
    return max(speed * float(fitted_friction(drive, place, clues).magnitude("positive", speed, 0.0)), 1e-12)
