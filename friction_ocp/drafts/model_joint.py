"""One joint of an MJCF or URDF model as an axis: MuJoCo reads the model and says what the joint moves."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.drafts.axis import Axis, positive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.optional_library import optional_library

MAX_BYTES = 20_000_000
TURNS = 24
"""Angles at which the gravity torque is looked at."""
HINGE, SLIDE = 3, 2
"""Types of joints in MuJoCo that an axis can be."""


def axis_of_joint(path: Path, joint: str | None) -> Axis:
    """Return the axis of a joint at the model's start pose; raises FrictionOcpError with the joints that there are."""
    mujoco = optional_library("mujoco", "mujoco", "mujoco", str(path), "reading a model")
    model = _load(mujoco, path)
    index = _find(model, joint, path)
    dof, address = int(model.jnt_dofadr[index]), int(model.jnt_qposadr[index])
    name = re.sub(r"[\s./@]+", "_", str(model.joint(index).name or "joint"))
    linear = int(model.jnt_type[index]) == SLIDE
    notes = [f"Joint '{model.joint(index).name}' of {path.name}, the others at their start angles."]
    if model.jnt_stiffness[index]:
        notes.append(f"Its spring to the frame, {float(model.jnt_stiffness[index]):.4g}, is not taken over.")
    actuators = [k for k in range(model.nu) if int(model.actuator_trnid[k][0]) == index]
    gear = float(model.actuator_gear[actuators[0]][0]) if actuators else 1.0
    if gear not in (0.0, 1.0):
        notes.append(f"gear = {gear:.6g} of actuator '{model.actuator(actuators[0]).name}' is in the torque constant.")
    return positive(
        Axis(
            kind="joint",
            motor_inertia=None,
            load=name or "joint",
            load_inertia=float(_inertia(mujoco, model, dof)),
            torque_constant=abs(gear) or 1.0,
            tau_c=float(model.dof_frictionloss[dof]),
            viscous=float(model.dof_damping[dof]),
            gravity=None if linear else _gravity(mujoco, model, dof, address),
            linear=linear,
            notes=tuple(notes),
        )
    )


def _load(mujoco: Any, path: Path) -> Any:
    where = str(path)
    if not path.is_file():
        raise FrictionOcpError(Finding(where, "there is no such file", remedy="correct the path"))
    if path.stat().st_size > MAX_BYTES:
        raise FrictionOcpError(Finding(where, "the file is too large", f"at most {MAX_BYTES} bytes"))
    try:
        text = path.read_text(encoding="utf-8")
        if "<!ENTITY" in text:
            raise FrictionOcpError(Finding(where, "it declares entities", "plain XML", "write them out"))
        if path.suffix.lower() == ".urdf":
            return mujoco.MjModel.from_xml_string(_without_shapes(text))
        return mujoco.MjModel.from_xml_path(where)
    except (ValueError, ElementTree.ParseError, UnicodeDecodeError, OSError) as error:
        what = f"MuJoCo cannot read it ({' '.join(str(error).split())[:200]})"
        raise FrictionOcpError(Finding(where, what, "an MJCF or URDF model that MuJoCo loads")) from error


def _without_shapes(text: str) -> str:
    """Return a URDF without what it looks like: meshes lie in packages that are not here."""
    root = ElementTree.fromstring(text)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    return ElementTree.tostring(root, encoding="unicode")


def _find(model: Any, joint: str | None, path: Path) -> int:
    usable = [k for k in range(model.njnt) if int(model.jnt_type[k]) in (HINGE, SLIDE)]
    names = [str(model.joint(k).name) for k in usable]
    allowed = f"joints: {', '.join(names)}" if names else "a hinge or a slide"
    if joint is None and len(usable) == 1:
        return usable[0]
    if joint is None:
        what = f"the model has {len(usable)} joints that turn or slide"
        raise FrictionOcpError(Finding(str(path), what, allowed, "choose one with --joint" if names else ""))
    if joint not in names:
        raise FrictionOcpError(Finding(str(path), f"there is no joint '{joint}' that turns or slides", allowed))
    return usable[names.index(joint)]


def _inertia(mujoco: Any, model: Any, dof: int) -> float:
    """Return the inertia that a torque on the joint sees while the others are held, armature included."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    whole = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, data, whole)
    except TypeError:  # before MuJoCo 4 it took the sparse matrix
        mujoco.mj_fullM(model, whole, data.qM)
    return float(whole[dof, dof])


def _gravity(mujoco: Any, model: Any, dof: int, address: int) -> tuple[float, float] | None:
    """Return torque and phase of -torque sin(theta + phase), by least squares over a turn; None for no torque."""
    data = mujoco.MjData(model)
    angles = 2.0 * np.pi * np.arange(TURNS) / TURNS
    torques: list[float] = []
    for angle in angles:
        data.qpos[address] = angle
        mujoco.mj_forward(model, data)
        torques.append(-float(data.qfrc_bias[dof]))
    sine, cosine = (-2.0 / TURNS * float(np.dot(torques, wave(angles))) for wave in (np.sin, np.cos))
    size = float(np.hypot(sine, cosine))
    return (size, float(np.arctan2(cosine, sine))) if size > 1e-9 else None
