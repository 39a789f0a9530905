"""Where in a machine an effect can sit: names of shafts, transmissions and channels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from blind.machines import Machine


def shafts(machine: Machine) -> Iterator[str]:
    yield from (item["name"] for item in machine.document["drive"]["shafts"])


def rubbing(machine: Machine) -> Iterator[str]:
    """Yield the shafts whose friction the problem file knows."""
    yield from (item["name"] for item in machine.document["drive"]["shafts"] if "friction" in item)


def first(machine: Machine) -> Iterator[str]:
    yield machine.document["drive"]["shafts"][0]["name"]


def joints(machine: Machine, rigid: bool) -> Iterator[str]:
    for part in machine.plant().transmissions:
        if np.isinf(part.stiffness) == rigid:
            yield part.name


def passing(machine: Machine) -> Iterator[str]:
    """Yield the shafts with friction that drive another one."""
    starts = {part.from_shaft for part in machine.plant().transmissions}
    yield from (name for name in rubbing(machine) if name in starts)


def balanced(machine: Machine) -> Iterator[str]:
    """Yield the turning shafts on which the file knows no gravity."""
    for item in machine.document["drive"]["shafts"]:
        if "gravity" not in item and item.get("motion") != "linear":
            yield item["name"]


def stated(machine: Machine) -> Iterator[str]:
    """Yield the parts with a stated number that `parameter_error` falsifies."""
    yield machine.document["drive"]["motor"]["name"]
    yield from joints(machine, rigid=False)
    yield from (item["name"] for item in machine.document["drive"]["shafts"] if "gravity" in item)


def sensors(machine: Machine) -> Iterator[str]:
    for name, item in machine.document["channels"].items():
        if item.get("role") != "input" and not item["measures"].endswith("current"):
            yield name


def wheels(machine: Machine) -> Iterator[str]:
    """Yield the encoders of angle on the first shaft, which turns often enough to show an eccentricity."""
    wheel = next(first(machine))
    for name, item in machine.document["channels"].items():
        if item["measures"] == f"{wheel}.theta":
            yield name


def last(machine: Machine) -> Iterator[str]:
    yield machine.document["drive"]["shafts"][-1]["name"]


def amplified(machine: Machine) -> Iterator[str]:
    """Yield the first shaft where the motor is driven by a current."""
    if "resistance" not in machine.document["drive"]["motor"]:
        yield from first(machine)
