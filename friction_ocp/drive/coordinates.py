"""Angles and speeds of all groups of a drive, from those that are states and those that are inputs."""

from __future__ import annotations

from typing import Any

import casadi as ca

from friction_ocp.drive.mechanism import Mechanism, column

ORDERS = ("theta", "omega", "alpha")
"""Signals of a shaft's motion, by how often its angle is differentiated."""


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
    """Return the angle, speed or acceleration of a driven group, in terms of its first shaft."""
    channel = next(
        item
        for item in mech.drive.inputs
        if item.signal == mech.prescribed[group] and mech.topology.group_of.get(item.part) == group
    )
    ratio = mech.topology.speed_ratio[channel.part]
    order = ORDERS.index(signal) - ORDERS.index(channel.signal)
    value = mech.inputs[channel.name + order * "'"]
    return (value if order else value - channel.offset) / channel.gain / ratio


def group_accelerations(mech: Mechanism, free: ca.SX) -> ca.SX:
    """Return `free`, the accelerations of all groups by the torques on them, with those of driven groups in place.

    The acceleration of a driven group is 0 where no output sees it.
    """
    groups = range(len(mech.topology.roots))
    return column([_driven_acceleration(mech, g) if g in mech.prescribed else free[g] for g in groups])


def _driven_acceleration(mech: Mechanism, group: int) -> Any:
    channels = [item for item in mech.drive.inputs if mech.topology.group_of.get(item.part) == group]
    seen = any(item.name + ("''" if item.signal == "theta" else "'") in mech.inputs for item in channels)
    return prescribed_motion(mech, group, "alpha") if seen else 0.0


def pick(vector: ca.SX, groups: tuple[int, ...]) -> ca.SX:
    """Return the entries of a vector over all groups that belong to some of them."""
    return column([vector[g] for g in groups])
