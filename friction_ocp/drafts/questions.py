"""An axis from answers: each question shows what is typical, which an empty answer takes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from friction_ocp.drafts.axis import TEMPLATES, Axis

Ask = Callable[[str], str]
LAWS = ("coulomb_viscous", "stribeck", "lugre")
TRIES = 3


def axis_of_answers(ask: Ask) -> Axis:
    """Ask for the kind of drive and its numbers."""
    kind = _choice(ask, "Kind of drive", tuple(TEMPLATES), "robot_joint")
    axis = TEMPLATES[kind]
    unit, load_unit = ("kg", "N/m") if axis.linear else ("kg m^2", "N m/rad")
    if axis.motor_inertia is not None:
        axis = replace(
            axis,
            ratio=_number(ask, "Gear ratio, speed of the motor over that of the load", axis.ratio),
            motor_inertia=_number(ask, "Inertia of the motor, kg m^2", axis.motor_inertia),
        )
        rigid = "rigid" if axis.stiffness is None else "elastic"
        chosen = _choice(ask, "Is the transmission rigid or elastic", ("rigid", "elastic"), rigid)
        stiffness = None
        if chosen == "elastic":
            stiffness = _number(ask, f"Its stiffness at the load, {load_unit}", axis.stiffness or 1.0e4)
        axis = replace(axis, stiffness=stiffness)
    return replace(
        axis,
        load_inertia=_number(ask, f"Inertia of the load, {unit}", axis.load_inertia),
        torque_constant=_number(ask, "Torque constant of the motor, N m/A", axis.torque_constant),
        law=_choice(ask, "Friction law of the motor's shaft", LAWS, axis.law),
    )


def _choice(ask: Ask, question: str, allowed: tuple[str, ...], default: str) -> str:
    for _ in range(TRIES):
        answer = ask(f"{question} ({', '.join(allowed)}) [{default}]: ").strip() or default
        if answer in allowed:
            return answer
    return default


def _number(ask: Ask, question: str, default: float) -> float:
    """Return a number above 0, the typical one after three answers that are none."""
    for _ in range(TRIES):
        answer = ask(f"{question} [{default:g}]: ").strip()
        try:
            value = float(answer) if answer else default
        except ValueError:
            continue
        if math.isfinite(value) and value > 0.0:
            return value
    return default
