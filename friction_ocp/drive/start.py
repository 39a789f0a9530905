"""The state in which a drive starts, as its measured motion suggests it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from friction_ocp.drive.coordinates import pick, prescribed_motion
from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.mechanism import Mechanism, Motion, column, deflection_names
from friction_ocp.drive.motors import at_rest, seen_by_controller
from friction_ocp.drive.parts import Channel, Shaft
from friction_ocp.drive.torques import applied_torques
from friction_ocp.friction.bristle import AbstractBristleLaw
from friction_ocp.friction.static import NoFriction


def start_state(mech: Mechanism, y: ca.SX, dy: ca.SX, ddy: ca.SX) -> ca.SX:
    """Return the state that measured motion suggests: no twist, bristles as steady motion or a balance has them."""
    q, v = _measured_motion(mech, y, dy)
    at = Motion(q, v, ca.SX.zeros(len(mech.extra_names)), ca.SX.zeros(len(mech.memory_names)))
    following = at_rest(mech, at)
    at = replace(at, following=following)
    acceleration = _measured_accelerations(mech, dy, ddy)
    deflections = [_deflection(mech, shaft, at, acceleration) for shaft in mech.bristles]
    memory = [_first_memory(mech, at, name) for name in mech.memory_names]
    return ca.vertcat(
        pick(q, mech.angle_groups),
        pick(v, mech.free_groups),
        column(deflections),
        at.extra,
        following,
        ca.SX.zeros(len(mech.loop_names)),
        column([warm_up.risen(mech.inputs[TIME]) for warm_up in mech.warming.values()]),
        column(memory),
    )


def unseen_states(mech: Mechanism) -> tuple[int, ...]:
    """Return the numbers of the states of which `start_state` knows too little to begin there in a motion.

    All but angles, speeds and bristles of shafts that a channel shows: how far a spring is wound up, where in its play
    a load is and what a controller has summed up hangs on all that was before.
    """
    roots, shown = mech.topology.roots, set[str]()
    for channel in mech.drive.outputs:
        group = mech.topology.group_of.get(channel.part)
        if group is not None and channel.signal in ("theta", "omega"):
            shown |= {f"{roots[group]}.omega", f"{roots[group]}.{channel.signal}"}
    shown |= {f"{roots[group]}.omega" for group in mech.prescribed}
    for shaft in mech.bristles:
        if f"{roots[mech.topology.group_of[shaft.name]]}.omega" in shown:
            shown.update(deflection_names(shaft))
    return tuple(k for k, name in enumerate(mech.state_names) if name not in shown)


def _deflection(mech: Mechanism, shaft: Shaft, at: Motion, acceleration: dict[int, Any]) -> Any:
    """Return the deflection of steady motion; near rest the one that balances the torques on a rigid drive."""
    element = shaft.friction.under(mech.surroundings(shaft, at))
    omega = mech.shaft_speed(shaft.name, at)
    steady, group = element.steady_deflection(omega), mech.topology.group_of[shaft.name]
    single = isinstance(element.law, AbstractBristleLaw) and len(element.law.deflections) == 1
    alone = single and _rubs_alone(mech, shaft)
    if not alone or mech.topology.elastic or group in mech.prescribed or group not in acceleration:
        return steady
    torques = applied_torques(mech, at, 0.0)
    driving = sum(mech.speed_ratio(name, at) * torques[name] for name in mech.topology.members(group))
    inertia, ratio = mech.inertia(group, at), mech.speed_ratio(shaft.name, at)
    driving -= mech.inertial_torque(group, at) + inertia * acceleration[group]
    balance, trust = element.sticking_deflection(omega, driving / ratio, inertia / ratio**2)
    return steady + trust * (balance - steady)


def _rubs_alone(mech: Mechanism, shaft: Shaft) -> bool:
    """Whether no other shaft that turns with this one has friction."""
    group_of = mech.topology.group_of
    others = [item for item in mech.drive.shafts if item != shaft and group_of[item.name] == group_of[shaft.name]]
    return all(isinstance(item.friction.law, NoFriction) for item in others)


def _measured_accelerations(mech: Mechanism, dy: ca.SX, ddy: ca.SX) -> dict[int, Any]:
    """Return the accelerations of groups that a channel sees, from the second derivative of angles first."""
    found: dict[int, Any] = {}
    for signal, slopes in (("theta", ddy), ("omega", dy)):
        for k, channel in enumerate(mech.drive.outputs):
            group = mech.topology.group_of.get(channel.part)
            if group is not None and channel.signal == signal:
                found.setdefault(group, slopes[k] / channel.gain / mech.topology.speed_ratio[channel.part])
    return found


def _first_memory(mech: Mechanism, at: Motion, name: str) -> Any:
    if not name.startswith("controller.previous"):
        return 0.0
    controller, seen = mech.drive.controller, seen_by_controller(mech, at)
    assert controller is not None and controller.sample_time is not None
    return seen.theta - (1.0 if name.endswith("1") else 2.0) * controller.sample_time * seen.omega


def _measured_motion(mech: Mechanism, y: ca.SX, dy: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return group angles and speeds from the channels that see them, else through the transmissions."""
    q, v = dict[int, Any](), dict[int, Any]()
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part)
        if group is None or channel.signal == "alpha":
            continue
        if channel.signal == "theta":
            root = mech.root_motion(channel.part, *_seen_motion(channel, y[k], dy[k]))
            q.setdefault(group, root[0])
            v[group] = root[1]
        else:
            ratio = mech.topology.speed_ratio[channel.part]
            v.setdefault(group, (y[k] - channel.offset) / channel.gain / ratio)
    for group in mech.prescribed:
        v[group] = prescribed_motion(mech, group, "omega")
        if mech.prescribed[group] == "theta":
            q[group] = prescribed_motion(mech, group, "theta")
    for known in (q, v):
        _spread(mech, known)
    groups = range(len(mech.topology.roots))
    return column([q.get(g, 0.0) for g in groups]), column([v.get(g, 0.0) for g in groups])


def _seen_motion(channel: Channel, y: ca.SX, dy: ca.SX) -> tuple[Any, Any]:
    """Return true angle and speed of a shaft from a channel that measures its angle."""
    theta, omega = (y - channel.offset) / channel.gain, dy / channel.gain
    return (theta, omega) if channel.eccentricity is None else channel.eccentricity.undone(theta, omega)


def _spread(mech: Mechanism, known: dict[int, Any]) -> None:
    """Carry angles or speeds over elastic transmissions to groups that no channel sees."""
    ratio, group_of = mech.topology.speed_ratio, mech.topology.group_of
    for _ in mech.topology.elastic:
        for item in mech.topology.elastic:
            a, b = group_of[item.from_shaft], group_of[item.to_shaft]
            whole = item.ratio * ratio[item.to_shaft] / ratio[item.from_shaft]
            if a in known and b not in known:
                known[b] = known[a] / whole
            elif b in known and a not in known:
                known[a] = known[b] * whole
