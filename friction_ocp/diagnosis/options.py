"""What a problem's `diagnosis:` asks for: the level of significance, and which effects compete where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.stated_keys import stated_keys
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import Key
from friction_ocp.effects.registry import candidates, effects
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.expressions import closest

SIGNIFICANCE = 0.01
EFFORT = 1.0
AT = " at "
"""Between an effect and the component that an entry of `effects` or `exclude` is about."""


@dataclass(frozen=True)
class Considered:
    """Effects that compete, and where."""

    only: Mapping[str, frozenset[str] | None]
    """Components by effect; None where all are meant."""
    excluded: frozenset[Key] = frozenset()
    parts: frozenset[str] | None = None
    """The parts of the stated drive, None where all parts count: what an effect has added is no place for another."""

    @property
    def names(self) -> list[str]:
        """Effects that compete somewhere."""
        return list(self.only)

    @property
    def entries(self) -> list[str]:
        """Effects that compete, with their components where the file names some."""
        return [
            entry
            for effect, components in self.only.items()
            for entry in ([effect] if components is None else [effect + AT + item for item in sorted(components)])
        ]

    def holds(self, effect: str, component: str) -> bool:
        """Whether an effect competes at a component."""
        if effect not in self.only or (effect, component) in self.excluded:
            return False
        components = self.only[effect]
        return components is None or component in components

    def candidates(self, drive: Drive) -> list[Key]:
        """Return what competes in a drive."""
        found = [(effect.name, place) for effect, place in candidates(drive, self.names)]
        added = frozenset[str]() if self.parts is None else _parts(drive) - self.parts
        return [key for key in found if self.holds(*key) and key[1] not in added]


NONE = Considered({})
"""Nothing competes."""


def level_of(problem: Problem) -> float:
    """Return the level of significance; raises FrictionOcpError where it is none."""
    level = problem.diagnosis.get("significance", SIGNIFICANCE)
    if not isinstance(level, (int, float)) or not 0.0 < level < 0.5:
        raise FrictionOcpError(
            Finding(f"{_where(problem)}.significance", f"this is {level!r}", "a number between 0 and 0.5")
        )
    return float(level)


def effort_of(problem: Problem) -> float:
    """Return how long the search goes on, over what it usually does; raises FrictionOcpError where it is no number."""
    stated = problem.diagnosis.get("effort", EFFORT)
    if not isinstance(stated, (int, float)) or isinstance(stated, bool) or not 0.0 < stated < np.inf:
        raise FrictionOcpError(
            Finding(f"{_where(problem)}.effort", f"this is {stated!r}", "a number above 0, 1 is the usual effort")
        )
    return float(stated)


def considered(problem: Problem) -> Considered:
    """Return what competes: the catalogue, as far as the file does not narrow it.

    Raises FrictionOcpError for effects that nobody knows, and components where an effect makes no sense.
    """
    stated: Mapping[str, Any] = problem.diagnosis
    findings: list[Finding] = []
    wanted = _entries(problem, "effects", stated.get("effects") or list(effects()), findings)
    left_out = _entries(problem, "exclude", stated.get("exclude") or [], findings)
    if findings:
        raise FrictionOcpError(findings)
    everywhere = {effect for effect, component in left_out if component is None}
    only = dict[str, frozenset[str] | None]()
    for effect, component in wanted:
        if effect in everywhere:
            continue
        known = only.get(effect, frozenset[str]())
        only[effect] = None if component is None or known is None else known | {component}
    excluded = ((effect, component) for effect, component in left_out if component is not None)
    return Considered(only, frozenset(excluded), _parts(problem.drive))


def places(current: FittedModel, meant: Considered) -> list[Key]:
    """Return what competes; static points also show friction of shafts whose motion an input prescribes."""
    drive = current.model.problem.drive
    found = meant.candidates(drive)
    driven = drive.prescribed
    if current.model.static and driven:
        found += [key for key in meant.candidates(released(drive)) if key[1] in driven]
    return list(dict.fromkeys(found))


def _parts(drive: Drive) -> frozenset[str]:
    return frozenset(part.name for part in (*drive.shafts, *drive.transmissions, *drive.motors))


def released(drive: Drive) -> Drive:
    """Return a drive whose motion no input prescribes."""
    driven = drive.prescribed
    return replace(
        drive, channels=tuple(replace(item, role="output") if item.part in driven else item for item in drive.channels)
    )


def _entries(problem: Problem, key: str, stated: object, findings: list[Finding]) -> list[tuple[str, str | None]]:
    """Return effects, each with the component that it is meant at, None where all are."""
    where = f"{_where(problem)}.{key}"
    if not isinstance(stated, list):
        findings.append(Finding(where, f"this is {stated!r}", "a list of effects"))
        return []
    catalogue, found = effects(), list[tuple[str, str | None]]()
    drives, from_values = (problem.drive, released(problem.drive)), stated_keys(problem.drive)
    for entry in map(str, cast(list[Any], stated)):
        effect, at, component = entry.partition(AT)
        if effect not in catalogue:
            available = f"available: {', '.join(catalogue)}"
            name, _, place = effect.partition("@")
            remedy = f"write '{name}{AT}{place}'" if name in catalogue else closest(effect, list(catalogue))
            findings.append(Finding(where, f"unknown effect {effect!r}", available, remedy))
            continue
        known = {place: None for drive in drives for place in catalogue[effect].places(drive)}
        known |= {place: None for name, place in from_values if name == effect}
        if at and component not in known:
            expected = f"one of {', '.join(known)}" if known else "an effect that this drive can have"
            findings.append(Finding(where, f"{effect} makes no sense at {component!r} of this drive", expected))
            continue
        found.append((effect, component if at else None))
    return found


def _where(problem: Problem) -> str:
    return f"{problem.path or problem.title}: diagnosis"
