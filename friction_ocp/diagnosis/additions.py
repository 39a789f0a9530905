"""The drive with what was accepted, put together again from other additions than those that it has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.options import released
from friction_ocp.diagnosis.select import Round
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import Clues, Key
from friction_ocp.effects.registry import effects
from friction_ocp.parameters import Free

Forms = Mapping[Key, Sequence[Clues]]
"""By addition: what the recordings showed each time that it was accepted, first by itself, then in more general shapes.
It decides on a form: a wave has one phase for all recordings, or one for each."""


def forms_of(rounds: Sequence[Round], instead: Mapping[Key, Key] | None = None) -> Forms:
    """Return the forms of what some rounds have accepted, or of other additions `instead` of some of it."""
    found = dict[Key, list[Clues]]()
    for item in rounds:
        if item.accepted is not None:
            key = (instead or {}).get(item.accepted.key, item.accepted.key)
            found.setdefault(key, []).append(clues_of(item.before))
    return found


def with_additions(base: FittedModel, keys: Sequence[Key], forms: Forms | None = None) -> Drive:
    """Return the drive of the base model with some effects, as they would be added in this order.

    What is named again gets a more general shape. What no round has brought takes the form that it would have in the
    first one.
    Values that were taken back are no part of it: they are fitted in the base model already.
    """
    drive, there = base.model.problem.drive, list[Key]()
    for key in keys:
        effect, place = key
        known = (forms or {}).get(key, ())[there.count(key) :]
        kind, clues = effects()[effect], _seeing(known[0] if known else clues_of(base), drive)
        if key in there:
            shape = kind.reshaped(drive, place, clues)
            drive = drive if shape is None else shape.drive
            there.append(key)
        elif place in kind.places(drive) or (place in drive.prescribed and place in kind.places(released(drive))):
            drive = kind.augment(drive, place, clues).drive
            there.append(key)
    return drive


def _seeing(clues: Clues, drive: Drive) -> Clues:
    """Return clues that know what was added to a drive: at its guess."""
    free = {leaf.path: leaf.value.guess for leaf in drive_leaves(drive) if isinstance(leaf.value, Free)}
    added = {path: guess for path, guess in free.items() if path not in clues.numbers}
    return replace(clues, numbers={**clues.numbers, **added}) if added else clues
