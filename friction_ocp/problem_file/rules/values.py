"""Rules about the numbers of a drive: bounds, signs, orders, and the expressions that tie them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.expressions import closest, parse, resolve_ties
from friction_ocp.friction.composite import SHARES
from friction_ocp.friction.law import AbstractFrictionLaw, Direction
from friction_ocp.parameters import Free, Tie
from friction_ocp.problem_file.rules.case import Case, Rule, quantity_text

_POSITIVE = {
    *("resistance", "inductance", "stiffness", "omega_s", "delta", "sigma0", "omega_zero"),
    *("width", "period", "other_period", "time_constant", "twist", "saturation_sharpness", "power"),
}
_NOT_NEGATIVE = {"tau_c", "tau_s", "sigma1", "damping", "backlash", "lag", "dead_time"}
_MAY_BE_ZERO = ".second_stage.stiffness"
"""A stiffness that adds to another."""
_RANGES: tuple[tuple[Collection[str], Callable[[float], bool], str], ...] = (
    ({"ratio", "torque_constant", "gain"}, lambda number: number != 0, "must not be zero"),
    ({"lag_hidden", "loss_share", "saturation_in_emf"}, lambda number: 0 <= number <= 1, "must be between 0 and 1"),
    (set(SHARES.values()), lambda number: number > -1, "must be above -1"),
    ({"saturation_tail"}, lambda number: number >= -1, "must be at least -1"),
    ({"rounding"}, lambda number: 0 <= number < 1, "must be at least 0 and below 1"),
)
"""Names of numbers, which of these are possible, and what to say of others."""
_SOLVER_TOLERANCE = 1e-6
"""Relative; a fit with tau_s >= tau_c may end that far on the other side, and its answer is a problem again."""
_DIRECTIONS: tuple[Direction, ...] = ("positive", "negative")


def bounds_are_in_order(case: Case) -> Iterator[Finding]:
    """The lower bound lies below the upper one."""
    for path, value, unit in _fitted(case):
        if value.min >= value.max:
            low, high = quantity_text(value.min, unit), quantity_text(value.max, unit)
            swapped = "is above" if value.min > value.max else "equals"
            remedy = "write a plain number to keep it fixed"
            if value.min > value.max:
                remedy = "swap them" if value.max <= value.guess <= value.min else "correct one of them"
            yield Finding(case.at(case.place(path)), f"min = {low} {swapped} max = {high}", "min below max", remedy)


def guesses_are_inside_bounds(case: Case) -> Iterator[Finding]:
    """The fit starts inside the bounds."""
    for path, value, unit in _fitted(case):
        if value.min < value.max and not value.min <= value.guess <= value.max:
            outside = f"guess = {quantity_text(value.guess, unit)} is outside its bounds"
            allowed = f"{quantity_text(value.min, unit)} to {quantity_text(value.max, unit)}"
            yield Finding(case.at(case.place(path)), outside, allowed, "move the guess or the bounds")


def numbers_have_possible_signs(case: Case) -> Iterator[Finding]:
    """Stiffness is positive, damping not negative, a ratio not zero."""
    for path, number in case.numbers.items():
        key = next(part for part in reversed(path.split(".")) if part not in _DIRECTIONS and not part.isdigit())
        may_be_zero = path.endswith(_MAY_BE_ZERO) or case.leaves[path].kind == "saturation"
        impossible = [
            (key in _POSITIVE and not may_be_zero and number <= 0, "must be positive"),
            ((key in _NOT_NEGATIVE or may_be_zero) and number < 0, "must not be negative"),
            *((key in names and not possible(number), allowed) for names, possible, allowed in _RANGES),
        ]
        for _, allowed in (item for item in impossible if item[0]):
            yield Finding(case.at(case.place(path)), case.written(path), allowed)


def inertias_are_positive(case: Case) -> Iterator[Finding]:
    """A body has inertia, unless it is rigidly joined to one that has."""
    for shaft in case.drive.shafts:
        path = f"{shaft.name}.inertia"
        group = case.topology.members(case.topology.group_of[shaft.name])
        carried = sum(case.numbers[f"{name}.inertia"] for name in group) > 0
        if case.numbers[path] < 0 or (case.numbers[path] == 0 and not carried):
            yield Finding(case.at(case.place(path)), case.written(path), "an inertia is positive")


def breakaway_is_above_coulomb(case: Case) -> Iterator[Finding]:
    """tau_s, the torque at standstill, is not below tau_c."""
    for path in case.numbers:
        stem, found, direction = path.partition(".tau_s")
        for coulomb in _same_direction(case, f"{stem}.tau_c", direction) if found else ():
            if case.numbers[path] < case.numbers[coulomb] * (1.0 - _SOLVER_TOLERANCE):
                what = f"{case.written(path)} is below {case.written(coulomb)}"
                allowed = "breakaway must be >= Coulomb torque"
                yield Finding(case.at(case.place(path).partition(".tau_s")[0]), what, allowed)


def _same_direction(case: Case, stem: str, direction: str) -> list[str]:
    """Return the paths of a number that hold in one direction (".positive"), or in any where it is ""."""
    found = [path for path in (stem, f"{stem}.positive", f"{stem}.negative") if path in case.numbers]
    return [path for path in found if not direction or path in (stem, stem + direction)]


def polylines_have_their_breaks(case: Case) -> Iterator[Finding]:
    """k slopes meet at k - 1 break speeds, which rise."""
    for k, law in enumerate(shaft.friction.law for shaft in case.bound.shafts):
        inner = getattr(law, "polyline", None)
        line = law if inner is None else inner
        if not hasattr(line, "slopes") or not hasattr(line, "breaks"):
            continue
        where = case.at(f"drive.shafts[{k}].friction.{'' if inner is None else 'polyline.'}breaks")
        slopes, breaks = len(getattr(line, "slopes")), len(getattr(line, "breaks"))  # noqa: B009
        if breaks != slopes - 1:
            what = f"there are {breaks} breaks for {slopes} slopes"
            yield Finding(where, what, f"{max(slopes - 1, 0)} breaks: one fewer than slopes")
        speeds = {tuple(_breaks(line, direction)) for direction in _DIRECTIONS}
        for several in speeds:
            if any(not after > before for before, after in zip((0.0, *several), several, strict=False)):
                shown = ", ".join(f"{speed:g}" for speed in several)
                yield Finding(where, f"the breaks are {shown}", "positive speeds that rise")


def _breaks(law: AbstractFrictionLaw, direction: Direction) -> tuple[float, ...]:
    breaks: tuple[float, ...] = getattr(law.along(direction), "breaks")  # noqa: B009
    return () if np.isnan(breaks).any() else breaks


def load_dependence_has_a_load(case: Case) -> Iterator[Finding]:
    """Only a shaft beside a transmission, or with a motor, transmits a torque on which its friction could depend."""
    driven = {motor.shaft for motor in case.drive.motors}
    ends = driven | {name for item in case.drive.transmissions for name in (item.from_shaft, item.to_shaft)}
    for k, shaft in enumerate(case.drive.shafts):
        if shaft.friction.load is not None and shaft.name not in ends:
            what = f"friction of '{shaft.name}' depends on load, and it has neither a transmission nor a motor"
            yield Finding(case.at(f"drive.shafts[{k}].friction.load"), what, remedy="add the shaft that loads it")


def load_stribeck_has_a_speed(case: Case) -> Iterator[Finding]:
    """A Stribeck part that grows with load needs a law with a Stribeck speed."""
    for k, shaft in enumerate(case.drive.shafts):
        load, law = shaft.friction.load, type(shaft.friction.law)
        if load is None or load.omega_s is not None or load.stribeck == 0.0:
            continue
        if law.weakening is AbstractFrictionLaw.weakening:
            what = f"law '{law.name}' has no Stribeck speed for load.stribeck"
            allowed = "load.omega_s, or laws with omega_s: stribeck, lugre"
            yield Finding(case.at(f"drive.shafts[{k}].friction.load.stribeck"), what, allowed)


def ties_can_be_computed(case: Case) -> Iterator[Finding]:
    """A tie is an expression over numbers that exist, and no ties go in a circle."""
    ties = {path: leaf.value.expr for path, leaf in case.leaves.items() if isinstance(leaf.value, Tie)}
    plain = {path: number for path, number in case.numbers.items() if path not in ties}
    readable: dict[str, str] = {}
    for path, text in ties.items():
        try:
            parse(text, tuple(case.leaves), case.at(f"{case.place(path)}.expr"))
            readable[path] = text
        except FrictionOcpError as error:
            yield from error.findings
    if len(readable) == len(ties):
        yield from _unresolved(case, ties, plain)


def _unresolved(case: Case, ties: Mapping[str, str], plain: Mapping[str, float]) -> Iterator[Finding]:
    try:
        resolve_ties(ties, plain)
    except FrictionOcpError as error:
        for finding in error.findings:
            where = case.at(f"{case.place(finding.where)}.expr")
            yield Finding(where, finding.what, finding.allowed, finding.remedy)


def constraints_compare_numbers(case: Case) -> Iterator[Finding]:
    """A constraint is an inequality between numbers that exist."""
    scoped = [path for path, value, _ in _fitted(case) if value.scope == "recording"]
    names = [*case.leaves, *(f"{path}@{use.name}" for path in scoped for use in case.problem.fitted)]
    for k, text in enumerate(case.problem.constraints):
        where = case.at(f"constraints[{k}]")
        try:
            if not parse(text, names, where).comparison:
                yield Finding(where, f"'{text}' is not an inequality", "two values joined by <= or >=")
        except FrictionOcpError as error:
            yield from error.findings


def settings_name_numbers(case: Case) -> Iterator[Finding]:
    """What is `set` beside a recording is a number of the drive."""
    for place, use in (*case.uses(), *case.static_uses()):
        for path in use.set:
            if path not in case.leaves:
                where, names = case.at(f"{place}.set"), list(case.leaves)
                yield Finding(where, f"unknown parameter '{path}'", "paths such as load.inertia", closest(path, names))


def settings_are_possible(case: Case) -> Iterator[Finding]:
    """With what is `set` beside a recording the numbers of the drive are possible as well."""
    known = set(_impossible_numbers(case))
    for place, use in (*case.uses(), *case.static_uses()):
        for finding in _impossible_numbers(Case(case.problem, use.set)) if use.set else ():
            if finding not in known:
                yield replace(finding, where=case.at(f"{place}.set: {finding.where.removeprefix(case.at(''))}"))


def _impossible_numbers(case: Case) -> Iterator[Finding]:
    for rule in (numbers_have_possible_signs, inertias_are_positive, breakaway_is_above_coulomb):
        yield from rule(case)


def _fitted(case: Case) -> Iterator[tuple[str, Free, str]]:
    for path, leaf in case.leaves.items():
        if isinstance(leaf.value, Free):
            yield path, leaf.value, case.unit(path)


VALUES: tuple[Rule, ...] = (
    bounds_are_in_order,
    guesses_are_inside_bounds,
    numbers_have_possible_signs,
    inertias_are_positive,
    breakaway_is_above_coulomb,
    polylines_have_their_breaks,
    load_stribeck_has_a_speed,
    settings_are_possible,
)
WHOLE: tuple[Rule, ...] = (
    load_dependence_has_a_load,
    ties_can_be_computed,
    constraints_compare_numbers,
    settings_name_numbers,
)
"""Rules about what has to be there."""
