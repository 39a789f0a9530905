"""MuJoCo MJCF: one body a coordinate, springs as fixed tendons, motors as actuators whose command is theirs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

from friction_ocp.targets.joints import Actuator, Joint, JointDrive, Spring

GRAVITY = 9.81
STEP = 5e-4
"""Time step of the exported model, s."""
STIFF = 0.9999
"""Impedance of dry friction: the largest that MuJoCo takes, so that a joint that sticks creeps least."""
APART = 1.0
"""Distance between bodies, m, for the eye alone."""


def mjcf_text(drive: JointDrive, name: str, step: float = STEP, doubts: Sequence[str] = ()) -> str:
    """Return a model that runs as it is; what it cannot express, and `doubts`, stand in its comment."""
    lines = [
        f"<!-- {name}: joint dynamics identified from recordings.",
        "     The command of an actuator is the torque, current or voltage of its motor, in SI units.",
        *(f"     Doubtful: {xml_comment(doubt)}." for doubt in doubts),
        *(f"     Left out: {xml_comment(str(loss))}." for loss in drive.losses),
        "-->",
        f"<mujoco model={quoteattr(name)}>",
        '  <compiler angle="radian" autolimits="true"/>',
        f'  <option timestep="{step!r}" integrator="implicitfast" gravity="0 0 -{GRAVITY!r}"/>',
        "  <worldbody>",
        *(line for k, joint in enumerate(drive.joints) for line in _body(joint, k, step)),
        "  </worldbody>",
        *_tendons(drive.springs),
        *_actuators(drive),
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"


def xml_comment(text: str) -> str:
    """Return text that a comment may hold."""
    return text.replace("--", "- -")


def _body(joint: Joint, index: int, step: float) -> list[str]:
    kind, axis = ("hinge", "0 1 0") if joint.motion == "rotary" else ("slide", "1 0 0")
    inertial = _inertial(joint)
    attributes = {
        "name": joint.name,
        "type": kind,
        "axis": axis,
        "armature": joint.armature,
        "damping": joint.damping,
        "frictionloss": joint.friction,
        "solreffriction": f"{2.0 * step!r} 1",
        "solimpfriction": f"{STIFF} {STIFF} 0.001 0.5 2",
    }
    return [
        f'    <body name={quoteattr(joint.name + "_body")} pos="0 {index * APART!r} 0">',
        f"      <joint {_attributes(attributes)}/>",
        f"      <inertial {_attributes(inertial)}/>",
        "    </body>",
    ]


def _inertial(joint: Joint) -> dict[str, object]:
    """Return mass, place and inertia of a body with the gravity torque of the joint.

    A mass m at the lever l makes m g l of gravity and m l^2 of inertia, of which half of the inertia is made here.
    """
    if joint.motion == "linear":
        return {"pos": "0 0 0", "mass": joint.inertia, "diaginertia": " ".join(["1e-3"] * 3)}
    weight = 0.0 if joint.gravity is None else joint.gravity[0] / GRAVITY
    if joint.gravity is None or weight == 0.0:
        return {"pos": "0 0 0", "mass": 1.0, "diaginertia": " ".join([repr(joint.inertia)] * 3)}
    lever = 0.5 * joint.inertia / abs(weight)
    phase = joint.gravity[1] + (math.pi if weight < 0.0 else 0.0)
    place = f"{-lever * math.sin(phase)!r} 0 {-lever * math.cos(phase)!r}"
    return {
        "pos": place,
        "mass": abs(weight) / lever,
        "diaginertia": " ".join([repr(0.5 * joint.inertia)] * 3),
    }


def _tendons(springs: Sequence[Spring]) -> list[str]:
    if not springs:
        return []
    lines = ["  <tendon>"]
    for item in springs:
        attributes = {
            "name": item.name,
            "stiffness": item.stiffness,
            "damping": item.damping,
            "springlength": f"{-0.5 * item.play!r} {0.5 * item.play!r}",
        }
        lines.append(f"    <fixed {_attributes(attributes)}>")
        lines += [f'      <joint joint={quoteattr(name)} coef="{value!r}"/>' for name, value in item.coefficients]
        lines.append("    </fixed>")
    return [*lines, "  </tendon>"]


def _actuators(drive: JointDrive) -> list[str]:
    lines = [f"    <general {_attributes(_general(item, k))}/>" for k, item in enumerate(drive.actuators)]
    for joint in drive.joints:
        if joint.constant:
            constant = {
                "name": f"{joint.name}_constant",
                "joint": joint.name,
                "gainprm": "0",
                "biastype": "affine",
                "biasprm": f"{joint.constant!r} 0 0",
            }
            lines.append(f"    <general {_attributes(constant)}/>")
    return ["  <actuator>", *lines, "  </actuator>"] if lines else []


def _general(item: Actuator, index: int) -> dict[str, object]:
    attributes: dict[str, object] = {
        "name": item.name,
        "joint": item.joint,
        "gear": item.gear,
        "gainprm": item.gain,
        "biastype": "affine",
        "biasprm": f"0 0 {item.bias!r}",
        "group": index,
    }
    if item.lag > 0.0:
        attributes |= {"dyntype": "filterexact", "dynprm": item.lag}
    return attributes


def _attributes(values: Mapping[str, object]) -> str:
    return " ".join(f"{key}={quoteattr(item if isinstance(item, str) else repr(item))}" for key, item in values.items())
