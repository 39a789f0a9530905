"""URDF: one joint with `dynamics damping friction`; rotor inertia stands in the inertia of its link."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

from friction_ocp.targets.joints import Joint, JointDrive, Loss
from friction_ocp.targets.mjcf import GRAVITY, xml_comment


def urdf_losses(drive: JointDrive) -> tuple[Loss, ...]:
    """Return what URDF cannot express beyond what the joints have lost already."""
    losses = list(drive.losses)
    for joint in drive.joints:
        if joint.armature > 0.0:
            losses.append(Loss(f"armature of {joint.name}", f"{joint.armature:.4g} added to the inertia of its link"))
        if joint.constant:
            losses.append(Loss(f"constant torque on {joint.name}", "left out: apply it as an effort"))
    for item in drive.actuators:
        back_emf = f" - {-item.bias * item.gear**2:.6g} x speed" if item.bias else ""
        effort = f"effort = {item.gear * item.gain:.6g} x {item.command}{back_emf}"
        losses.append(Loss(f"motor {item.name}", f"left out: {effort}"))
        if item.lag:
            losses.append(Loss(f"{item.name}.lag", f"left out: the torque follows within {item.lag:.3g} s"))
    return tuple(losses)


def urdf_text(drive: JointDrive, name: str, doubts: Sequence[str] = ()) -> str:
    """Return a robot of one link a coordinate; what it cannot express, and `doubts`, stand in its comment."""
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- {name}: joint dynamics identified from recordings.",
        *(f"     Doubtful: {xml_comment(doubt)}." for doubt in doubts),
        *(f"     Left out: {xml_comment(str(loss))}." for loss in urdf_losses(drive)),
        "-->",
        f"<robot name={quoteattr(name)}>",
        '  <link name="base"/>',
        *(line for joint in drive.joints for line in _joint(joint)),
        "</robot>",
    ]
    return "\n".join(lines) + "\n"


def _joint(joint: Joint) -> list[str]:
    link = joint.name + "_link"
    kind, axis = ("continuous", "0 1 0") if joint.motion == "rotary" else ("prismatic", "1 0 0")
    x, z, mass, inertia = _inertial(joint)
    inertias = " ".join(f'{key}="{inertia!r}"' for key in ("ixx", "iyy", "izz"))
    limits = [] if joint.motion == "rotary" else ['    <limit lower="-1e9" upper="1e9" effort="1e9" velocity="1e9"/>']
    return [
        f"  <link name={quoteattr(link)}>",
        "    <inertial>",
        f'      <origin xyz="{x!r} 0 {z!r}"/>',
        f'      <mass value="{mass!r}"/>',
        f'      <inertia {inertias} ixy="0" ixz="0" iyz="0"/>',
        "    </inertial>",
        "  </link>",
        f'  <joint name={quoteattr(joint.name)} type="{kind}">',
        '    <parent link="base"/>',
        f"    <child link={quoteattr(link)}/>",
        f'    <axis xyz="{axis}"/>',
        f'    <dynamics damping="{joint.damping!r}" friction="{joint.friction!r}"/>',
        *limits,
        "  </joint>",
    ]


def _inertial(joint: Joint) -> tuple[float, float, float, float]:
    """Return x and z of the centre of mass, the mass, and the inertia about the centre."""
    whole = joint.inertia + joint.armature
    if joint.motion == "linear":
        return 0.0, 0.0, whole, 1e-3
    weight = 0.0 if joint.gravity is None else joint.gravity[0] / GRAVITY
    if joint.gravity is None or weight == 0.0:
        return 0.0, 0.0, 1.0, whole
    lever = 0.5 * whole / abs(weight)
    phase = joint.gravity[1] + (math.pi if weight < 0.0 else 0.0)
    return -lever * math.sin(phase), -lever * math.cos(phase), abs(weight) / lever, 0.5 * whole
