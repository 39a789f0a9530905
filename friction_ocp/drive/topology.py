"""Which shafts move together, and by what ratios."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from friction_ocp.drive.parts import Drive, Transmission
from friction_ocp.errors import Finding, FrictionOcpError


@dataclass(frozen=True)
class Topology:
    """Shafts grouped by rigid joints; a group has one coordinate, that of its first shaft."""

    roots: tuple[str, ...]
    group_of: dict[str, int]
    """Index of the group of each shaft."""
    speed_ratio: dict[str, Any]
    """Speed of each shaft over the speed of its group's first shaft."""
    elastic: tuple[Transmission, ...]
    rigid: tuple[Transmission, ...]

    def members(self, group: int) -> tuple[str, ...]:
        """Return the shafts of a group."""
        return tuple(name for name, index in self.group_of.items() if index == group)

    def beyond(self, joint: Transmission) -> tuple[str, ...]:
        """Return the shafts of the same group on the output side of a rigid joint."""
        reached, todo = {joint.to_shaft}, [joint.to_shaft]
        while todo:
            here = todo.pop()
            for other in self.rigid:
                ends = (other.from_shaft, other.to_shaft)
                if other.name == joint.name or here not in ends:
                    continue
                there = ends[1 - ends.index(here)]
                if there not in reached:
                    reached.add(there)
                    todo.append(there)
        return tuple(name for name in self.group_of if name in reached)


def topology(drive: Drive) -> Topology:
    """Group the shafts of a drive; raises FrictionOcpError when rigid joints form a loop."""
    rigid = tuple(item for item in drive.transmissions if item.rigid)
    group_of: dict[str, int] = {}
    ratios: dict[str, Any] = {}
    roots: list[str] = []
    for shaft in drive.shafts:
        if shaft.name not in group_of:
            _grow(shaft.name, len(roots), rigid, group_of, ratios)
            roots.append(shaft.name)
    if len(rigid) != len(drive.shafts) - len(roots):
        names = ", ".join(item.name for item in rigid)
        raise FrictionOcpError(
            Finding("drive.transmissions", f"rigid joints {names} form a loop", remedy="give one of them a stiffness")
        )
    elastic = tuple(item for item in drive.transmissions if not item.rigid)
    return Topology(tuple(roots), group_of, ratios, elastic, rigid)


def _grow(
    root: str, group: int, rigid: tuple[Transmission, ...], group_of: dict[str, int], ratios: dict[str, Any]
) -> None:
    group_of[root], ratios[root] = group, 1.0
    todo = [root]
    while todo:
        here = todo.pop()
        for joint in rigid:
            if joint.from_shaft == here and joint.to_shaft not in group_of:
                there, ratio = joint.to_shaft, ratios[here] / joint.ratio
            elif joint.to_shaft == here and joint.from_shaft not in group_of:
                there, ratio = joint.from_shaft, ratios[here] * joint.ratio
            else:
                continue
            group_of[there], ratios[there] = group, ratio
            todo.append(there)
