"""Rules about the parts of a drive and how they are joined. The other rules rely on them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from friction_ocp.drive.inputs import moved_from_behind
from friction_ocp.drive.parts import Transmission
from friction_ocp.drive.topology import topology
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.expressions import closest
from friction_ocp.parameters import is_off
from friction_ocp.problem_file.rules.case import Case, Rule


def parts_have_names_of_their_own(case: Case) -> Iterator[Finding]:
    """No two shafts, motors or transmissions share a name: it is what results call their numbers."""
    drive = case.problem.drive
    for kind, parts in (("shafts", drive.shafts), ("motors", drive.motors), ("transmissions", drive.transmissions)):
        for name, count in Counter(part.name for part in parts).items():
            if count > 1:
                yield Finding(case.at(f"drive.{kind}"), f"{count} {kind} are called '{name}'", remedy="rename one")


def transmissions_join_shafts(case: Case) -> Iterator[Finding]:
    """A transmission lies between two shafts that exist."""
    names = [shaft.name for shaft in case.drive.shafts]
    for k, item in enumerate(case.problem.drive.transmissions):
        for key, name in (("from", item.from_shaft), ("to", item.to_shaft)):
            if name not in names:
                yield _unknown_shaft(case.at(f"drive.transmissions[{k}].{key}"), name, names)
        if item.from_shaft == item.to_shaft:
            what = f"the transmission joins '{item.to_shaft}' to itself"
            yield Finding(case.at(f"drive.transmissions[{k}]"), what, "two shafts")


def motors_sit_on_shafts(case: Case) -> Iterator[Finding]:
    """A motor turns a shaft that exists."""
    names = [shaft.name for shaft in case.drive.shafts]
    for k, motor in enumerate(case.problem.drive.motors):
        if motor.shaft not in names:
            yield _unknown_shaft(case.at(f"{case.place_of_motor(k)}.shaft"), motor.shaft, names)


def shafts_hang_together(case: Case) -> Iterator[Finding]:
    """Every shaft is joined to the first one; a second machine needs a file of its own."""
    reached = {case.drive.shafts[0].name}
    for _ in case.drive.shafts:
        for item in case.drive.transmissions:
            if reached & {item.from_shaft, item.to_shaft}:
                reached |= {item.from_shaft, item.to_shaft}
    for k, shaft in enumerate(case.drive.shafts):
        if shaft.name not in reached:
            what = f"nothing joins shaft '{shaft.name}' to '{case.drive.shafts[0].name}'"
            yield Finding(case.at(f"drive.shafts[{k}]"), what, remedy="add a transmission")


def rigid_joints_form_no_loop(case: Case) -> Iterator[Finding]:
    """Shafts in a loop of rigid joints could not move; those with kinematic errors are moved from the front."""
    try:
        findings = tuple(moved_from_behind(case.live, topology(case.live)))
    except FrictionOcpError as error:
        findings = error.findings
    for finding in findings:
        yield Finding(case.at(finding.where), finding.what, finding.allowed, finding.remedy)


def rigid_joints_have_no_play(case: Case) -> Iterator[Finding]:
    """Damping, backlash and what else shapes the twist need a spring to act beside; a kinematic error does not."""
    for k, item in enumerate(case.drive.transmissions):
        if item.rigid:
            for key in _idle_numbers(item):
                what = f"{key} of a rigid transmission has no effect"
                yield Finding(
                    case.at(f"drive.transmissions[{k}].{key}"), what, remedy="state a stiffness or leave it out"
                )


def _idle_numbers(item: Transmission) -> list[str]:
    numbers = [key for key in ("damping", "backlash", "stiffening") if not is_off(getattr(item, key))]
    return [*numbers, *(key for key in ("second_stage", "hysteresis") if getattr(item, key) is not None)]


def _unknown_shaft(where: str, name: str, names: list[str]) -> Finding:
    return Finding(where, f"unknown shaft '{name}'", f"there are {', '.join(names)}", closest(name, names))


NAMES: tuple[Rule, ...] = (parts_have_names_of_their_own, transmissions_join_shafts, motors_sit_on_shafts)
"""Without these it is not known what else is meant."""

STRUCTURE: tuple[Rule, ...] = (rigid_joints_have_no_play,)
WHOLE: tuple[Rule, ...] = (shafts_hang_together, rigid_joints_form_no_loop)
"""Rules about what has to be there."""
