"""Stated values that are wrong."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Trial, moving_shafts
from friction_ocp.parameters import Free

_NUMBERS = {
    "shaft": ("friction", "gravity", "external_torque"),
    "transmission": ("ratio", "stiffness", "damping", "backlash"),
    "motor": ("torque_constant", "resistance", "inductance"),
}


LIKELY, LIKELY_RATIO = 10.0, 1.2
"""Factors by which a stated number may be wrong. Teeth are counted and rollers measured: a larger error of a ratio is
another gear, which every simulation shows at once, and bends the angle of the other side as no torque would."""


def freed(drive: Drive, paths: Iterable[str]) -> Drive:
    """Return the drive with fixed numbers made free, their values the guesses."""
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    for path in paths:
        guess = float(values[path])
        most = LIKELY_RATIO if _is_ratio(path) else LIKELY
        low, high = sorted((guess / most, guess * most))
        values[path] = Free(guess, low, high)
    return bind_drive(drive, values)


def _trial(drive: Drive, paths: list[str]) -> Augmentation:
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    off = {path: float(values[path]) for path in paths}
    trial = Trial(tuple({path: 1.05 * value} for path, value in off.items()))
    return Augmentation(freed(drive, paths), off, (trial,))


def _fixed(drive: Drive) -> dict[str, float]:
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    return {path: float(v) for path, v in values.items() if isinstance(v, (int, float)) and v != 0.0}


class InertiaErrorEffect(AbstractEffect):
    """The stated inertia is wrong."""

    name: ClassVar[str] = "inertia_error"
    sentence: ClassVar[str] = "the stated inertia is wrong"

    def places(self, drive: Drive) -> Iterable[str]:
        fixed = _fixed(drive)
        return [shaft.name for shaft in moving_shafts(drive) if f"{shaft.name}.inertia" in fixed]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        return _trial(drive, [f"{place}.inertia"])


class ParameterErrorEffect(AbstractEffect):
    """Another stated value of a part is wrong."""

    name: ClassVar[str] = "parameter_error"
    sentence: ClassVar[str] = "a stated value of the part is wrong"

    def places(self, drive: Drive) -> Iterable[str]:
        fixed = _fixed(drive)
        return [part for part, keys in _parts(drive).items() if _numbers(fixed, part, keys)]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        keys = _parts(drive)[place]
        whole = [_trial(drive, [path]) for path in _numbers(_fixed(drive), place, keys)]
        off = {path: value for item in whole for path, value in item.off.items()}
        trials = tuple(trial for item in whole for trial in item.trials)
        # Beside a stiffness a ratio may be anything where the other side is not seen: its bound then says nothing.
        alone = tuple(off) if all(map(_is_ratio, off)) else ()
        return Augmentation(freed(drive, off), off, trials, inside=alone)


def _is_ratio(path: str) -> bool:
    return path.endswith(".ratio")


def _parts(drive: Drive) -> dict[str, tuple[str, ...]]:
    """Return which numbers count by part; a motor that bears its shaft's name is one part with it."""
    found: dict[str, tuple[str, ...]] = {}
    for kind, parts in (("motor", drive.motors), ("transmission", drive.transmissions), ("shaft", drive.shafts)):
        for part in parts:
            found[part.name] = found.get(part.name, ()) + _NUMBERS[kind]
    return found


def _numbers(fixed: dict[str, float], part: str, keys: tuple[str, ...]) -> list[str]:
    stems = tuple(f"{part}.{key}" for key in keys)
    shapes = (".delta", ".omega_zero", ".phase", "period", "origin", ".reference_temperature")
    return [path for path in fixed if path.startswith(stems) and not path.endswith(shapes)]


STATED = (InertiaErrorEffect.name, ParameterErrorEffect.name)
"""Effects that take back values which a problem states."""
