"""Which shafts move together, and by what ratios."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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
    path: dict[str, tuple[tuple[Transmission, bool], ...]]
    """Rigid joints from the first shaft of a group to each shaft, and whether each is passed from input to output."""

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
    paths: dict[str, tuple[tuple[Transmission, bool], ...]] = {}
    roots: list[str] = []
    for shaft in drive.shafts:
        if shaft.name not in group_of:
            _grow(shaft.name, len(roots), rigid, group_of, ratios, paths)
            roots.append(shaft.name)
    if len(rigid) != len(drive.shafts) - len(roots):
        names = ", ".join(item.name for item in rigid)
        raise FrictionOcpError(
            Finding("drive.transmissions", f"rigid joints {names} form a loop", remedy="give one of them a stiffness")
        )
    elastic = tuple(item for item in drive.transmissions if not item.rigid)
    if findings := list(_backward_errors(paths)):
        raise FrictionOcpError(findings)
    return Topology(tuple(roots), group_of, ratios, elastic, rigid, paths)


def _backward_errors(paths: Mapping[str, tuple[tuple[Transmission, bool], ...]]) -> Iterator[Finding]:
    """Yield the rigid joints whose input angle, and with it their error, would follow from the output angle."""
    backward = {joint.name: joint for path in paths.values() for joint, forward in path if not forward}
    for name, joint in backward.items():
        if joint.kinematic_error is not None:
            what = f"'{joint.to_shaft}' comes before '{joint.from_shaft}' in its group of rigidly joined shafts"
            remedy = f"list '{joint.from_shaft}' before '{joint.to_shaft}', or state a stiffness"
            yield Finding(f"{name}.kinematic_error", what, "a rigid joint with an error leads away from it", remedy)


def _grow(
    root: str,
    group: int,
    rigid: tuple[Transmission, ...],
    group_of: dict[str, int],
    ratios: dict[str, Any],
    paths: dict[str, tuple[tuple[Transmission, bool], ...]],
) -> None:
    group_of[root], ratios[root], paths[root] = group, 1.0, ()
    todo = [root]
    while todo:
        here = todo.pop()
        for joint in rigid:
            if joint.from_shaft == here and joint.to_shaft not in group_of:
                there, ratio, forward = joint.to_shaft, ratios[here] / joint.ratio, True
            elif joint.to_shaft == here and joint.from_shaft not in group_of:
                there, ratio, forward = joint.from_shaft, ratios[here] * joint.ratio, False
            else:
                continue
            group_of[there], ratios[there], paths[there] = group, ratio, (*paths[here], (joint, forward))
            todo.append(there)
