"""Angles and speeds of all groups of a drive, from those that are states and those that are inputs."""

from __future__ import annotations

from typing import Any

import casadi as ca

from friction_ocp.drive.mechanism import Mechanism, column


def group_angles(mech: Mechanism, angles: ca.SX) -> ca.SX:
    """Return the angles of all groups from those that are states; the others are inputs."""
    where_is = {g: k for k, g in enumerate(mech.angle_groups)}
    groups = range(len(mech.topology.roots))
    return column([angles[where_is[g]] if g in where_is else prescribed_motion(mech, g, "theta") for g in groups])


def group_speeds(mech: Mechanism, speeds: ca.SX) -> ca.SX:
    """Return the speeds of all groups from those that are states; the others are inputs."""
    where_is = {g: k for k, g in enumerate(mech.free_groups)}
    groups = range(len(mech.topology.roots))
    return column([speeds[where_is[g]] if g in where_is else prescribed_motion(mech, g, "omega") for g in groups])


def prescribed_motion(mech: Mechanism, group: int, signal: str) -> Any:
    """Return the angle or speed of a driven group, in terms of its first shaft."""
    channel = next(
        item
        for item in mech.drive.inputs
        if item.signal == mech.prescribed[group] and mech.topology.group_of.get(item.part) == group
    )
    ratio = mech.topology.speed_ratio[channel.part]
    if signal == "omega" and channel.signal == "theta":
        return mech.inputs[f"{channel.name}'"] / channel.gain / ratio
    return (mech.inputs[channel.name] - channel.offset) / channel.gain / ratio


def pick(vector: ca.SX, groups: tuple[int, ...]) -> ca.SX:
    """Return the entries of a vector over all groups that belong to some of them."""
    return column([vector[g] for g in groups])
