"""Draw the cases of a seed: kinds in fixed shares, effects in turn, places at random, sizes by what noise hides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from plant import PlantTransmission

from blind.cases import EFFECTS, HANDBOOK, TRAIN, Case, Planted, case_of, read_answer, write_answer, write_case
from blind.catalogue import CATALOGUE
from blind.document import handbook
from blind.machines import MACHINES
from blind.outside import OUTSIDE
from blind.recording import Hidden
from blind.site import Effect, Site
from blind.visibility import Excited, View, size_for

BLOCK = ("none",) * 9 + ("one",) * 10 + ("two",) * 2 + ("outside",) * 3
"""Kinds of 24 neighbouring cases, in random order: three in eight have no effect."""
VISIBLE, GRAVE = 3.0, 60.0
"""Noise ratios of the gap between which sizes are drawn (log-uniform)."""
LOST, EXCESSIVE = 0.75 * VISIBLE, 2.0 * GRAVE
"""Noise ratios beyond which a place is given up: the effect does not show there, or cannot be held small."""
CLASHES = (
    ("stribeck", "polyline_break", "quadratic_drag", "asymmetry", "presliding", "load_dependence"),
    ("inertia_error", "structural_mode"),
    ("parameter_error", "backlash", "stiffening", "transmission_hysteresis"),
)
"""Effects of which a part has one at most: they rewrite the same numbers of the plant."""
BEYOND = 4.0
"""Deviations of its prior from which a fitted number is wrong for certain; a diagnosis names it from three."""
KIND_STREAM, TURN_STREAM = 10_000, 20_000


def draw(seed: int, index: int) -> Case:
    """Draw a case."""
    kind, position = drawn_kind(seed, index)
    rng = np.random.default_rng([seed, index, 0])
    if kind == "none":
        return Case(seed, index, kind, str(rng.choice(list(MACHINES))))
    names = list(OUTSIDE if kind == "outside" else CATALOGUE)
    count = 2 if kind == "two" else 1
    first = [] if kind == "two" else [cycled(names, seed, position)]
    for machine in map(str, rng.permutation(list(MACHINES))):
        case = _filled(Case(seed, index, kind, machine), first, count, rng)
        if case is not None:
            return case
    for machine in map(str, rng.permutation(list(MACHINES))):
        case = _filled(Case(seed, index, kind, machine), list(map(str, rng.permutation(names))), count, rng)
        if case is not None:
            return case
    raise RuntimeError(f"case {index} of seed {seed}: nothing is visible in any machine")


def drawn_kind(seed: int, index: int) -> tuple[str, int]:
    """Return the kind of a case and how many of that kind precede it."""
    block, at = divmod(index, len(BLOCK))
    kinds = [str(kind) for kind in np.random.default_rng([seed, KIND_STREAM, block]).permutation(BLOCK)]
    return kinds[at], block * BLOCK.count(kinds[at]) + kinds[:at].count(kinds[at])


def cycled(names: Sequence[str], seed: int, position: int) -> str:
    """Return the name at a position of a sequence that goes through all of them, in another order every time."""
    turn, at = divmod(position, len(names))
    return str(np.random.default_rng([seed, TURN_STREAM, turn, len(names)]).permutation(names)[at])


def _filled(case: Case, names: Sequence[str], count: int, rng: np.random.Generator) -> Case | None:
    """Return the case with the first `count` of the effects that are visible in its machine and go together."""
    for name in names:
        found = plant(case, EFFECTS[name], rng)
        if found is not None and not any(clash(found, other) for other in case.planted):
            case = replace(case, planted=(*case.planted, found))
        if len(case.planted) == count:
            return case
    return None


def clash(one: Planted, other: Planted) -> bool:
    """Whether two effects rewrite the same numbers of the plant."""
    if one.component != other.component:
        return False
    return one.effect == other.effect or any({one.effect, other.effect} <= set(group) for group in CLASHES)


def plant(case: Case, effect: Effect, rng: np.random.Generator) -> Planted | None:
    """Return the effect at a random place of the machine, its size drawn by its visibility; None where it has none."""
    machine = case.make_machine()
    places = list(effect.places(machine))
    if not places:
        return None
    component, form = str(rng.choice(places)), int(rng.integers(2**31))
    target = float(np.exp(rng.uniform(np.log(VISIBLE), np.log(GRAVE))))
    scales = case.scales()
    runs = [Excited(kind, (case.seed, case.index, TRAIN, k)) for k, kind in enumerate(case.kinds()[:3])]

    def build(size: float) -> Hidden:
        site = Site(machine, scales, Hidden(machine.plant()), component, size)
        return effect.inject(site, np.random.default_rng(form))

    size, ratio = size_for(View(machine, tuple(runs)), build, target)
    found = Planted(effect.name, component, size, form, ratio)
    return found if LOST <= ratio <= EXCESSIVE and contradicts(case, found) else None


def contradicts(case: Case, found: Planted) -> bool:
    """Whether a wrong value is one: stands fixed in the file, or lies beyond what its prior allows.

    A number that is fitted takes the true value; with less than that many deviations nothing is wrong with the file.
    """
    machine = case.make_machine()
    template, document = machine.document["drive"], handbook(machine.document, case.stream(HANDBOOK))["drive"]
    site = Site(machine, case.scales(), Hidden(machine.plant()), found.component, found.size)
    plant = EFFECTS[found.effect].inject(site, np.random.default_rng(found.seed)).plant
    pairs: list[tuple[Any, float]] = []
    if found.effect == "inertia_error":
        places = zip(document["shafts"], plant.shafts, strict=True)
        pairs = [(item["inertia"], shaft.inertia) for item, shaft in places if shaft.name == found.component]
    elif found.effect == "parameter_error" and found.component == template["motor"]["name"]:
        pairs = [(document["motor"]["torque_constant"], plant.motors[0].torque_constant)]
    elif found.effect == "parameter_error" and "-" in found.component:
        places = zip(document["transmissions"], plant.transmissions, strict=True)
        pairs = [(item["stiffness"], joint.stiffness) for item, joint in places if _name(joint) == found.component]
    return all(_is_off(stated, true) for stated, true in pairs)


def _name(joint: PlantTransmission) -> str:
    return f"{joint.from_shaft}-{joint.to_shaft}"


def _is_off(stated: Any, true: float) -> bool:
    if not isinstance(stated, Mapping):
        return True
    spread = stated.get("prior_std")
    return spread is not None and abs(true - stated["guess"]) > BEYOND * spread


def make(seed: int, index: int, folder: Path) -> Case:
    """Write a case and, in another folder, its answer; what exists is read back. The problem file is written last."""
    name = Case(seed, index, "", "").name
    if (folder / "cases" / name / "problem.yaml").exists():
        return case_of(read_answer(folder, name))
    case = draw(seed, index)
    write_answer(case, folder)
    write_case(case, folder / "cases")
    return case
