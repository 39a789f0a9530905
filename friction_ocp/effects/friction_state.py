"""Effects of friction beyond its curve over speed: bristles, load."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import (
    AbstractEffect,
    Augmentation,
    Clues,
    Trial,
    change_shaft,
    moving_shafts,
    springs_beside,
)
from friction_ocp.effects.friction_curve import is_dry, stribeck_speed
from friction_ocp.friction.composite import Bristle, Bristled, BristleSprings, with_bristle
from friction_ocp.friction.element import LoadDependence
from friction_ocp.parameters import Free

REACHES, RUNG = (1e-4, 1e-3, 1e-2, 5e-2), 10.0
"""Deflections at breakaway over the travel at which a bristle is tried, and how far apart they are at most."""
DAMPED, OVERDAMPED = 0.2, 100.0
"""Damping of a bristle over that at which its shaft no longer swings on it: as it is tried, and at most."""


class PreslidingEffect(AbstractEffect):
    """Elastic hysteresis before breakaway."""

    name: ClassVar[str] = "presliding"
    sentence: ClassVar[str] = "elastic hysteresis before breakaway (bristles)"

    def places(self, drive: Drive) -> Iterable[str]:
        for shaft in moving_shafts(drive):
            if is_dry(shaft) and not shaft.friction.law.has_bristle:
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        shaft, stem = drive.shaft(place), f"{place}.friction.bristle"
        lifted = _lifted(drive, clues, place)
        breakaway = _breakaway({**clues.numbers, **lifted}, place) or 0.1 * clues.typical_torque[place]
        travel = max(float(np.ptp(track.theta[place])) for track in clues.tracks)
        stiffnesses = [breakaway / max(share * travel, 1e-300) for share in REACHES]
        aperiodic = [2.0 * float(np.sqrt(item * clues.numbers[f"{place}.inertia"])) for item in stiffnesses]
        bristle = Bristle(
            Free(stiffnesses[1], 1e-2 * stiffnesses[-1], 1e3 * stiffnesses[0]),
            Free(DAMPED * aperiodic[1], 0.0, OVERDAMPED * aperiodic[0]),
        )
        law = with_bristle(shaft.friction.law, bristle)
        added = change_shaft(drive, place, friction=replace(shaft.friction, law=law))
        trials = tuple(
            Trial(({f"{stem}.sigma0": stiffness},), {f"{stem}.sigma1": damping, **lifted}, inverse=True)
            for stiffness, most in zip(stiffnesses, aperiodic, strict=True)
            for damping in (0.0, DAMPED * most)
        )
        return Augmentation(added, {f"{stem}.sigma0": np.inf, f"{stem}.sigma1": 0.0}, trials)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive with springs that slip beside its bristle."""
        shaft, stem = drive.shaft(place), f"{place}.friction.bristle"
        law = shaft.friction.law
        if not isinstance(law, Bristled) or law.bristle.springs is not None or not isinstance(law.bristle.sigma0, Free):
            return None
        stiffness = law.bristle.sigma0
        now = clues.numbers.get(f"{stem}.sigma0", stiffness.guess)

        def added(springs: BristleSprings) -> Drive:
            own = replace(law, bristle=replace(law.bristle, springs=springs))
            return change_shaft(drive, place, friction=replace(shaft.friction, law=own))

        return springs_beside(BristleSprings, added, f"{stem}.springs", "stiffness", stiffness, now)


def _breakaway(numbers: Mapping[str, float], place: str) -> float:
    """Return the Coulomb torque of a shaft; 0 where its law has none."""
    stem = f"{place}.friction.tau_c"
    return next((value for path, value in numbers.items() if path.startswith(stem) and value > 0), 0.0)


def _lifted(drive: Drive, clues: Clues, place: str) -> dict[str, float]:
    """Return the guesses of dry friction of which the fit has left next to nothing, by path.

    Friction that gives way like a spring looks like none to a model in which it jumps with the sign of the speed; then
    a bristle has nothing to carry, whatever its stiffness. Where it is off by less than a rung, another reach makes up
    for it.
    """
    leaves = {leaf.path: leaf.value for leaf in drive_leaves(drive) if leaf.path.startswith(f"{place}.friction.tau_")}
    guesses = {path: value.guess for path, value in leaves.items() if isinstance(value, Free)}
    return {path: guess for path, guess in guesses.items() if guess > RUNG * clues.numbers.get(path, guess)}


LOADED = 0.05
"""Friction over transmitted torque at which load dependence is tried: gears lose a few percent."""
MOST = 100.0
"""Largest load dependence over that: a drive that holds itself needs 20 times as much."""


class LoadDependenceEffect(AbstractEffect):
    """Friction grows with the transmitted torque."""

    name: ClassVar[str] = "load_dependence"
    sentence: ClassVar[str] = "friction grows with the transmitted torque"

    def places(self, drive: Drive) -> Iterable[str]:
        ends = {name for item in drive.transmissions for name in (item.from_shaft, item.to_shaft)}
        ends |= {motor.shaft for motor in drive.motors}
        for shaft in moving_shafts(drive):
            if shaft.name in ends and is_dry(shaft) and shaft.friction.load is None:
                yield shaft.name

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        shaft, path = drive.shaft(place), f"{place}.friction.load.coulomb"
        element = replace(shaft.friction, load=LoadDependence(Free(LOADED, 0.0, MOST * LOADED)))
        added = change_shaft(drive, place, friction=element)
        return Augmentation(added, {path: 0.0}, (Trial(({path: LOADED},)),))

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive whose drag grows with the torque, too, or whose loaded friction falls with the speed.

        Source: Duclusaud et al. 2025, the load-dependent Stribeck friction of geared servos.
        """
        friction, path = drive.shaft(place).friction, f"{place}.friction.load"
        if friction.load is None or friction.load.viscous != 0.0 or friction.load.stribeck != 0.0:
            return None
        drag, (guess, speeds) = LOADED / clues.typical_speed(place), stribeck_speed(clues, place)
        falling, growing = Free(LOADED, 0.0, MOST * LOADED), Free(drag, 0.0, MOST * drag)
        load = replace(friction.load, viscous=growing, stribeck=falling, omega_s=guess)
        added = change_shaft(drive, place, friction=replace(friction, load=load))
        off = {f"{path}.viscous": 0.0, f"{path}.stribeck": 0.0}
        trials = [Trial(({f"{path}.viscous": drag},))]
        trials += [Trial(({f"{path}.stribeck": LOADED},), {f"{path}.omega_s": omega_s}) for omega_s in speeds]
        return Augmentation(added, off, tuple(trials))
