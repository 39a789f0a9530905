"""Turn parts into the arrays that the kernels read, and refuse what they cannot simulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from .layout import (
    BREAKS,
    BRISTLE,
    COLUMNS,
    CURRENT,
    DELTA,
    GMS,
    LOAD_C,
    LOAD_S,
    LOAD_V,
    LOOP,
    OMEGA_S,
    PIECES,
    QUADRATIC,
    SIGMA0,
    SIGMA1,
    SLOPES,
    STATIC,
    TAU_C,
    TAU_S,
    TORQUE,
    VISCOUS,
    VOLTAGE,
)
from .parts import Directional, PlantFriction, PlantMotor, PlantShaft, PlantTransmission

USES = {
    "none": (),
    "coulomb": ("tau_c",),
    "viscous": ("viscous",),
    "coulomb_viscous": ("tau_c", "viscous"),
    "stribeck": ("tau_c", "tau_s", "omega_s", "delta", "viscous"),
    "polyline": ("tau_c", "slopes", "breaks"),
    "quadratic": ("tau_c", "viscous", "quadratic"),
    "dahl": ("tau_c", "sigma0", "viscous"),
    "lugre": ("tau_c", "tau_s", "omega_s", "delta", "viscous", "sigma0", "sigma1"),
    "gms": ("tau_c", "tau_s", "omega_s", "delta", "viscous", "elements"),
    "polyline_hysteresis": ("tau_c", "slopes", "breaks", "width"),
}
LOADS = ("load_coulomb", "load_stribeck", "load_viscous")
SCALARS = {
    TAU_C: "tau_c",
    TAU_S: "tau_s",
    OMEGA_S: "omega_s",
    DELTA: "delta",
    VISCOUS: "viscous",
    QUADRATIC: "quadratic",
    SIGMA0: "sigma0",
    SIGMA1: "sigma1",
    LOAD_C: "load_coulomb",
    LOAD_S: "load_stribeck",
    LOAD_V: "load_viscous",
}
DRIVES = {"current": CURRENT, "torque": TORQUE, "voltage": VOLTAGE}


def _toward(value: Directional, direction: int) -> float:
    return float(value[direction] if isinstance(value, tuple) else value)


def _law_code(friction: PlantFriction) -> int:
    return {"dahl": BRISTLE, "lugre": BRISTLE, "gms": GMS, "polyline_hysteresis": LOOP}.get(friction.law, STATIC)


def _friction_columns(where: str, friction: PlantFriction) -> np.ndarray:
    for item in fields(friction)[1:]:
        if getattr(friction, item.name) != item.default and item.name not in (*USES[friction.law], *LOADS):
            raise ValueError(f"{where}: law '{friction.law}' does not use {item.name}; it uses {USES[friction.law]}")
    columns = np.zeros((2, COLUMNS))
    slopes, breaks = friction.slopes, (*friction.breaks, float("inf"))
    if friction.law == "gms":
        slopes, breaks = tuple(e[0] for e in friction.elements), tuple(e[1] for e in friction.elements)
    elif slopes and len(slopes) != len(breaks):
        raise ValueError(f"{where}: {len(slopes)} slopes need {len(slopes) - 1} breaks, not {len(friction.breaks)}")
    for direction in (0, 1):
        row = columns[direction]
        for column, name in SCALARS.items():
            value = getattr(friction, name)
            row[column] = _toward(friction.tau_c if value is None else value, direction)
        if friction.law == "polyline_hysteresis":
            row[SIGMA0] = 2.0 * row[TAU_C] / _toward(friction.width, direction)
        row[PIECES] = len(slopes)
        row[SLOPES : SLOPES + len(slopes)] = [_toward(value, direction) for value in slopes]
        row[BREAKS : BREAKS + len(slopes)] = [_toward(value, direction) for value in breaks[: len(slopes)]]
    _check_friction(where, friction, columns)
    return columns


def _check_friction(where: str, friction: PlantFriction, columns: np.ndarray) -> None:
    if np.any(columns[:, PIECES] > BREAKS - SLOPES):
        raise ValueError(f"{where}: more than {BREAKS - SLOPES} slopes or elements")
    if friction.law in ("dahl", "lugre", "gms", "polyline_hysteresis") and np.any(columns[:, TAU_C] <= 0):
        raise ValueError(f"{where}: law '{friction.law}' needs tau_c > 0")
    weakens = friction.tau_s is not None or friction.load_stribeck != 0.0
    if weakens and np.any(columns[:, OMEGA_S] <= 0):
        raise ValueError(f"{where}: tau_s and load_stribeck need omega_s > 0")


@dataclass(frozen=True)
class Mechanics:
    """The mechanical part of the kernels' constants; fields as in `layout.Model`."""

    first: np.ndarray
    shaft: np.ndarray
    parent: np.ndarray
    forward: np.ndarray
    scale: np.ndarray
    group: np.ndarray
    inertia: np.ndarray
    group_inertia: np.ndarray
    law: np.ndarray
    friction: np.ndarray
    applied: np.ndarray
    joint: np.ndarray
    elastic: np.ndarray


def _index(shafts: Sequence[PlantShaft], name: str) -> int:
    names = [shaft.name for shaft in shafts]
    if name not in names:
        raise ValueError(f"plant: no shaft '{name}'; there are {', '.join(names)}")
    return names.index(name)


def _grow_groups(count: int, rigid: list[tuple[int, int, float]]) -> tuple[list[list[int]], np.ndarray, ...]:
    """Return the groups, parents first, with parent, forward and scale of every shaft."""
    parent, forward, scale = np.full(count, -1), np.zeros(count, dtype=np.int64), np.ones(count)
    groups: list[list[int]] = []
    left, seen = list(rigid), set()
    for root in range(count):
        if root in seen:
            continue
        members = [root]
        seen.add(root)
        for at in members:
            for edge in [edge for edge in left if at in edge[:2]]:
                left.remove(edge)
                i, j, ratio = edge
                child = j if at == i else i
                if child in seen:
                    raise ValueError("plant: rigid transmissions form a closed loop")
                seen.add(child)
                members.append(child)
                parent[child], forward[child] = at, int(at == i)
                scale[child] = scale[at] / ratio if at == i else scale[at] * ratio
        groups.append(members)
    return groups, parent, forward, scale


def assemble_mechanics(shafts: Sequence[PlantShaft], transmissions: Sequence[PlantTransmission]) -> Mechanics:
    """Join shafts into groups and lay out friction, gravity and elastic joints."""
    rigid, joint, elastic = [], [], []
    for part in transmissions:
        i, j = _index(shafts, part.from_shaft), _index(shafts, part.to_shaft)
        if part.ratio == 0 or part.backlash < 0:
            raise ValueError(f"{part.name}: ratio must not be 0 and backlash not negative")
        if np.isinf(part.stiffness):
            if part.backlash > 0 or part.cubic or any(part.second_stage) or part.loop or part.kinematic_error:
                raise ValueError(f"{part.name}: backlash, stiffening, loop and kinematic error need a finite stiffness")
            rigid.append((i, j, part.ratio))
        else:
            joint.append((i, j))
            elastic.append((part.ratio, part.stiffness, part.damping, 0.5 * part.backlash))
    ends = {name for part in transmissions for name in (part.from_shaft, part.to_shaft)}
    groups, parent, forward, scale = _grow_groups(len(shafts), rigid)
    inertia = np.array([float(shaft.inertia) for shaft in shafts])
    group = np.zeros(len(shafts), dtype=np.int64)
    for g, members in enumerate(groups):
        group[members] = g
    return Mechanics(
        first=np.concatenate(([0], np.cumsum([len(members) for members in groups]))),
        shaft=np.concatenate(groups).astype(np.int64),
        parent=parent,
        forward=forward,
        scale=scale,
        group=group,
        inertia=inertia,
        group_inertia=np.bincount(group, inertia * scale**2),
        law=np.array([_law_code(shaft.friction) for shaft in shafts]),
        friction=np.array([_friction_columns(shaft.name, shaft.friction) for shaft in shafts]),
        applied=np.array(
            [(*shaft.gravity, shaft.external_torque, shaft.name not in ends) for shaft in shafts], dtype=float
        ),
        joint=np.array(joint, dtype=np.int64).reshape(-1, 2),
        elastic=np.array(elastic, dtype=float).reshape(-1, 4),
    )


def group_traits(mechanics: Mechanics, prescribed: Mapping[int, int], added: Sequence[bool]) -> np.ndarray:
    """Return (g, 3): can stick, torque through a rigid joint matters, input of the prescribed speed or -1.

    `added` names the shafts to which an input adds dry friction.
    """
    m = mechanics
    traits = np.zeros((m.group_inertia.size, 3), dtype=np.int64)
    traits[:, 2] = -1
    for i in range(m.law.size):
        breakaway = m.friction[i][:, [TAU_C, TAU_S, LOAD_C, LOAD_S]]
        if m.law[i] == STATIC and (np.any(breakaway != 0) or added[i]):
            traits[m.group[i], 0] = 1
        if np.any(m.friction[i][:, [LOAD_C, LOAD_S, LOAD_V]] != 0):
            if np.any((m.parent == i) & (m.forward == 1)):
                traits[m.group[i], 1] = 1
            elif not np.any(m.joint[:, 0] == i) and m.applied[i, 3] == 0.0:
                raise ValueError(f"plant: shaft {i} has load-dependent friction but passes no torque on downstream")
    for i, column in prescribed.items():
        root = int(m.shaft[m.first[m.group[i]]])
        if root != i:
            raise ValueError(f"plant: prescribe the speed of shaft {root}, to which shaft {i} is rigidly joined")
        traits[m.group[i], 2] = column
    free = traits[:, 2] < 0
    if np.any(m.group_inertia[free] <= 0):
        raise ValueError("plant: a shaft that moves freely has no inertia")
    return traits


def check_step(mechanics: Mechanics, traits: np.ndarray, step: float, extra: np.ndarray, bumper: np.ndarray) -> None:
    """Refuse a step that is too long for the natural frequency or damping of a joint or a bumper.

    `extra` is the stiffness of loops and second stages by joint.
    """
    m = mechanics
    mobility = np.where(traits[:, 2] >= 0, 0.0, 1.0 / np.where(m.group_inertia > 0, m.group_inertia, 1.0))
    for (i, j), (ratio, stiffness, damping, _), more in zip(m.joint, m.elastic, extra, strict=True):
        gi, gj = m.group[i], m.group[j]
        compliance = mobility[gi] * (m.scale[i] / ratio) ** 2 + mobility[gj] * m.scale[j] ** 2
        _refuse_long_step(step, max(np.sqrt((stiffness + more) * compliance), damping * compliance), "joint")
    for i, (_, _, stiffness, damping) in enumerate(bumper):
        compliance = mobility[m.group[i]] * m.scale[i] ** 2
        _refuse_long_step(step, max(np.sqrt(stiffness * compliance), damping * compliance), "bumper")


def _refuse_long_step(step: float, rate: float, what: str) -> None:
    if step * rate > 0.3:
        raise ValueError(f"plant: step {step} s is too long for a {what} of {rate:.4g} 1/s; use {0.2 / rate:.2g} s")


def motor_rows(
    motors: Sequence[PlantMotor], shafts: Sequence[PlantShaft], columns: Mapping[str, int], controllers: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the integer and the float rows of the motors; `columns` gives the place of each input."""
    rows, winding = [], []
    for motor in motors:
        source = columns.get(f"{motor.name}.{motor.drive}", -1)
        loop = -1
        if motor.controller is not None:
            if motor.controller not in controllers:
                raise ValueError(
                    f"{motor.name}: no controller '{motor.controller}'; there are {', '.join(controllers)}"
                )
            loop, source = controllers.index(motor.controller), -1
        elif source < 0:
            raise ValueError(f"{motor.name}: no input '{motor.name}.{motor.drive}' and no controller")
        if motor.drive == "voltage" and motor.resistance <= 0:
            raise ValueError(f"{motor.name}: a voltage-driven motor needs resistance > 0, not {motor.resistance} ohm")
        enable = columns.get(f"{motor.name}.enable", -1)
        rows.append((_index(shafts, motor.shaft), DRIVES[motor.drive], source, loop, enable))
        winding.append((motor.torque_constant, motor.resistance, motor.inductance, motor.share, motor.bias))
    return np.array(rows, dtype=np.int64).reshape(-1, 5), np.array(winding, dtype=float).reshape(-1, 5)
