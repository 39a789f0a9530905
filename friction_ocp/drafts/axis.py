"""What a draft says about an axis, and the templates: typical numbers of five kinds of drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError

WIDE = 100.0
"""Factor by which a guess may be wrong in both directions."""


@dataclass(frozen=True)
class Axis:
    """The numbers of a drive before anything is fitted; SI units, each on its own shaft's side."""

    kind: str
    motor_inertia: float | None
    """None where the motor turns with the load as one shaft."""
    load: str
    """Name of the shaft that the motor moves."""
    load_inertia: float
    ratio: float = 1.0
    stiffness: float | None = None
    """None for a rigid joint."""
    torque_constant: float = 0.1
    resistance: float | None = None
    law: str = "coulomb_viscous"
    tau_c: float = 0.01
    viscous: float = 0.001
    """Friction of the shaft that bears the motor."""
    load_friction: tuple[float, float] | None = None
    """Coulomb and viscous friction of the load."""
    gravity: tuple[float, float] | None = None
    """Torque and phase of an unbalanced load."""
    linear: bool = False
    held: bool = False
    """Whether something else makes the load move, and what that takes is measured; sizes come from the recordings."""
    notes: tuple[str, ...] = ()

    @property
    def motor_shaft(self) -> str:
        """Name of the shaft that bears the motor."""
        return self.load if self.motor_inertia is None else "motor"


TEMPLATES: Mapping[str, Axis] = {
    "telescope_axis": Axis(
        kind="telescope axis",
        motor_inertia=0.002,
        load="structure",
        load_inertia=5.0e4,
        ratio=15_000.0,
        stiffness=5.0e7,
        torque_constant=0.35,
        tau_c=0.1,
        viscous=0.004,
        load_friction=(500.0, 5.0e4),
        notes=("Slow axis on a stiff reducer: record slow tracking, slews and reversals.",),
    ),
    "servo": Axis(
        kind="servo",
        motor_inertia=None,
        load="servo",
        load_inertia=0.003,
        torque_constant=0.4,
        resistance=4.0,
        tau_c=0.02,
        viscous=0.005,
        gravity=(0.1, 0.0),
        notes=("Geared servo as one shaft, all numbers at its output; gravity is that of what it lifts.",),
    ),
    "robot_joint": Axis(
        kind="robot joint",
        motor_inertia=1.0e-4,
        load="link",
        load_inertia=1.0,
        ratio=100.0,
        stiffness=2.0e4,
        torque_constant=0.1,
        law="stribeck",
        tau_c=0.02,
        viscous=1.0e-4,
        load_friction=(2.0, 5.0),
        gravity=(10.0, 0.0),
        notes=("Strain-wave or planetary gear: the spring shows only where the link is measured too.",),
    ),
    "feed_drive": Axis(
        kind="feed drive",
        motor_inertia=1.0e-3,
        load="table",
        load_inertia=100.0,
        ratio=628.3185307,
        torque_constant=0.5,
        tau_c=0.1,
        viscous=1.0e-3,
        load_friction=(50.0, 500.0),
        linear=True,
        notes=("Ball screw: ratio = 2 pi / lead in rad/m; here a lead of 10 mm.",),
    ),
    "test_bench": Axis(
        kind="test bench",
        motor_inertia=None,
        load="sample",
        load_inertia=1.0e-3,
        held=True,
        notes=(
            "Tribometer or dynamometer: the motion is prescribed, and the torque or force that it takes is measured.",
            "Sizes are those of the recordings.",
        ),
    ),
}
"""By name on the command line."""


def template(name: str) -> Axis:
    """Return a template; raises FrictionOcpError for an unknown one."""
    if name not in TEMPLATES:
        allowed = f"templates: {', '.join(TEMPLATES)}; or a model in MJCF (.xml) or URDF (.urdf)"
        raise FrictionOcpError(Finding("init", f"there is no template '{name}'", allowed))
    return TEMPLATES[name]


def drive_section(axis: Axis, driven_by: str) -> dict[str, Any]:
    """Return the section `drive` of a draft; what is not certain has a guess and wide bounds."""
    if axis.held:
        return {"shafts": [_load(axis)]}
    motor: dict[str, Any] = {"name": "motor", "shaft": axis.motor_shaft}
    if driven_by != "torque":
        motor["torque_constant"] = float(axis.torque_constant)
    if driven_by == "voltage":
        motor["resistance"] = _guess(axis.resistance or 1.0)
    load = _load(axis)
    if axis.motor_inertia is None:
        return {"motors": [motor], "shafts": [load]}
    if axis.load_friction is not None:
        load["friction"] = _friction("coulomb_viscous", *axis.load_friction)
    friction = _friction(axis.law, axis.tau_c, axis.viscous)
    shaft = {"name": "motor", "inertia": _guess(axis.motor_inertia), "friction": friction}
    joint: dict[str, Any] = {"from": "motor", "to": axis.load, "ratio": float(axis.ratio), "stiffness": "rigid"}
    if axis.stiffness is not None:
        joint |= {"stiffness": _guess(axis.stiffness), "damping": _guess(1e-3 * axis.stiffness)}
    return {"motors": [motor], "shafts": [shaft, load], "transmissions": [joint]}


def _load(axis: Axis) -> dict[str, Any]:
    load: dict[str, Any] = {"name": axis.load, "inertia": _guess(axis.load_inertia)}
    if axis.linear:
        load["motion"] = "linear"
    if axis.gravity is not None:
        load["gravity"] = {"torque": _guess(axis.gravity[0]), "phase": float(axis.gravity[1])}
    if axis.motor_inertia is None:
        load["friction"] = _friction(axis.law, axis.tau_c, axis.viscous)
    return load


def constraints(axis: Axis) -> list[str]:
    """Return the constraints that the friction law of a draft needs."""
    path = f"{axis.motor_shaft}.friction"
    return [f"{path}.tau_s >= {path}.tau_c"] if axis.law in ("stribeck", "lugre") else []


def _friction(law: str, tau_c: float, viscous: float) -> dict[str, Any]:
    speed = tau_c / viscous if viscous > 0 else 1.0
    numbers = {
        "tau_c": _guess(tau_c, 0.0),
        "tau_s": _guess(1.5 * tau_c, 0.0),
        "omega_s": _guess(0.05 * speed),
        "viscous": _guess(viscous, 0.0),
        "sigma0": _guess(1.0e3 * tau_c),
        "sigma1": _guess(0.1 * viscous, 0.0),
        "sigma2": _guess(viscous, 0.0),
    }
    keys = {
        "coulomb": ("tau_c",),
        "viscous": ("viscous",),
        "coulomb_viscous": ("tau_c", "viscous"),
        "stribeck": ("tau_c", "tau_s", "omega_s", "viscous"),
        "lugre": ("tau_c", "tau_s", "omega_s", "sigma0", "sigma1", "sigma2"),
    }
    if law not in keys:
        raise FrictionOcpError(Finding("init", f"no draft for the law '{law}'", f"available: {', '.join(keys)}"))
    return {"law": law, **{key: numbers[key] for key in keys[law]}}


def _guess(value: float, least: float | None = None) -> dict[str, float]:
    """Return a number that is to be fitted, with bounds a factor away."""
    low = value / WIDE if least is None else least
    return {"guess": rounded(value), "min": rounded(low), "max": rounded(value * WIDE)}


def rounded(value: float) -> float:
    """Return a number with four digits: a draft knows no more."""
    return float(f"{value:.4g}")


def positive(axis: Axis) -> Axis:
    """Return an axis whose guesses can be fitted: what a model leaves at zero gets a small share of what it moves."""
    scale = max(axis.load_inertia, 1e-9)
    friction = axis.load_friction
    return replace(
        axis,
        tau_c=axis.tau_c if axis.tau_c > 0 else 0.1 * scale,
        viscous=axis.viscous if axis.viscous > 0 else 0.1 * scale,
        load_friction=None if friction is None else (friction[0] or 0.1 * scale, friction[1] or 0.1 * scale),
    )
