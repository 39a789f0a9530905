"""A case of the suite: a machine, what is hidden in it, and everything that can be recorded from it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from blind.catalogue import CATALOGUE
from blind.document import handbook, varied
from blind.folder import write_json, write_problem, write_recordings
from blind.machines import MACHINES, Machine
from blind.motions import KINDS
from blind.outside import OUTSIDE
from blind.recording import Hidden, run, silent
from blind.scales import Scales, measure
from blind.site import Site

EFFECTS = CATALOGUE | OUTSIDE
NUMBERS, SCALES, MOTIONS, LAST_MOTION, TRAIN, CHECK, FRESH, HANDBOOK = range(1, 9)
"""Purposes of random numbers: none shares any with another."""
SHAFT_BY_ITS_ANGLE = ("unbalance", "load_dependence", "parameter_error")
"""Effects that tell rigidly joined shafts apart: by their angle, by what they pass on, by the number that is wrong."""


@dataclass(frozen=True)
class Planted:
    """One hidden effect."""

    effect: str
    component: str
    size: float
    seed: int
    """Of its form: periods, harmonics, signs."""
    noise_ratio: float
    """Of the gap that it leaves by itself once the base model is fitted, to first order."""


@dataclass(frozen=True)
class Case:
    """A case, from which everything about it can be made again."""

    seed: int
    index: int
    kind: str
    """none, one, two or outside."""
    machine: str
    planted: tuple[Planted, ...] = ()

    @property
    def name(self) -> str:
        """The name of its folder; it says nothing about what is hidden."""
        return f"case-{self.seed}-{self.index:03d}"

    def stream(self, purpose: int) -> np.random.Generator:
        """Return the random numbers for a purpose."""
        return np.random.default_rng([self.seed, self.index, purpose])

    def make_machine(self) -> Machine:
        """Return the machine: one of its kind, with numbers of its own."""
        machine = MACHINES[self.machine]()
        return replace(machine, document=varied(machine.document, self.stream(NUMBERS)))

    def scales(self) -> Scales:
        """Return what the sizes of effects refer to."""
        return measure(self.make_machine(), "steps", (self.seed, self.index, SCALES))

    def hidden(self) -> Hidden:
        """Return the machine with all that is hidden in it."""
        machine = self.make_machine()
        hidden = Hidden(machine.plant())
        if not self.planted:
            return hidden
        scales = self.scales()
        for item in self.planted:
            site = Site(machine, scales, hidden, item.component, item.size)
            hidden = EFFECTS[item.effect].inject(site, np.random.default_rng(item.seed))
        return hidden

    def kinds(self) -> list[str]:
        """Return the motions of three training and two validation recordings: steps, and others at random."""
        others = [str(kind) for kind in self.stream(MOTIONS).permutation([kind for kind in KINDS if kind != "steps"])]
        return ["steps", *others[:2], others[2], str(self.stream(LAST_MOTION).choice(["steps", *others[:2]]))]

    def equivalents(self, item: Planted) -> list[tuple[str, str]]:
        """Return the answers that no measurement could tell from a hidden effect, itself first.

        Shafts that are joined rigidly move as one; a constant torque on the motor and an offset of a current that is an
        input stand in one term of the equation of motion, as do torque constant and gain of such a current. A number of
        the motor may be called one of the motor or of its shaft.
        """
        machine, found = self.make_machine(), [(item.effect, item.component)]
        shafts = [shaft.name for shaft in machine.plant().shafts]
        if item.component in shafts and item.effect not in SHAFT_BY_ITS_ANGLE:
            found += [(item.effect, name) for name in rigid_group(machine, item.component) if name != item.component]
        channels = machine.document["channels"].items()
        inputs = [name for name, channel in channels if channel["measures"].endswith("current") and "role" in channel]
        if item.effect == "constant_torque" and shafts[0] in [place for _, place in found]:
            found += [("sensor_offset", channel) for channel in inputs]
        if item.effect == "parameter_error" and item.component == machine.document["drive"]["motor"]["name"]:
            found += [("parameter_error", shafts[0]), *(("sensor_gain", channel) for channel in inputs)]
        return found


def rigid_group(machine: Machine, shaft: str) -> list[str]:
    """Return the shafts that always move with one, itself included."""
    group = {shaft}
    for part in (*machine.plant().transmissions, *reversed(machine.plant().transmissions)):
        if np.isinf(part.stiffness) and group & {part.from_shaft, part.to_shaft}:
            group |= {part.from_shaft, part.to_shaft}
    return sorted(group)


def recordings(
    case: Case, hidden: Hidden, motions: Mapping[str, str], purpose: int
) -> dict[str, Mapping[str, np.ndarray]]:
    """Return the channels of recordings by name."""
    machine = case.make_machine()
    seeds = {name: (case.seed, case.index, purpose, k) for k, name in enumerate(motions)}
    return {name: run(machine, hidden, motion, seeds[name])[0] for name, motion in motions.items()}


def write_case(case: Case, folder: Path) -> Path:
    """Write problem file and recordings of a case; return the path of the problem file."""
    machine, hidden, kinds = case.make_machine(), case.hidden(), case.kinds()
    train = recordings(case, hidden, {f"train{k}": kind for k, kind in enumerate(kinds[:3])}, TRAIN)
    check = recordings(case, hidden, {f"check{k}": kind for k, kind in enumerate(kinds[3:])}, CHECK)
    document = handbook(machine.document, case.stream(HANDBOOK))
    return write_problem(folder / case.name, machine, document, train, check)


def write_fresh(case: Case, folder: Path) -> list[Path]:
    """Write two recordings of the same machine that nobody has seen."""
    motions = {f"fresh{k}": str(kind) for k, kind in enumerate(case.stream(FRESH).choice(KINDS, 2, replace=False))}
    return write_recordings(folder, case.make_machine(), recordings(case, case.hidden(), motions, FRESH))


def write_quiet(case: Case, folder: Path) -> list[Path]:
    """Write the training recordings as they would be without noise and quantisation."""
    hidden = case.hidden()
    motions = {f"train{k}": kind for k, kind in enumerate(case.kinds()[:3])}
    quiet = recordings(case, replace(hidden, plant=silent(hidden.plant)), motions, TRAIN)
    return write_recordings(folder, case.make_machine(), quiet)


def answer_of(case: Case) -> dict[str, Any]:
    """Return what the scorer needs to know."""
    return asdict(case) | {"equivalents": [case.equivalents(item) for item in case.planted]}


def case_of(answer: Mapping[str, Any]) -> Case:
    """Return the case of an answer."""
    planted = tuple(Planted(**item) for item in answer["planted"])
    return Case(answer["seed"], answer["index"], answer["kind"], answer["machine"], planted)


def write_answer(case: Case, folder: Path) -> None:
    """Write an answer, away from the case."""
    write_json(folder / "answers" / f"{case.name}.json", answer_of(case))


def read_answer(folder: Path, name: str) -> dict[str, Any]:
    """Return the answer of a case."""
    return json.loads((folder / "answers" / f"{name}.json").read_text(encoding="utf-8"))
