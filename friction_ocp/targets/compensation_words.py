"""What the exported friction compensation is, and what of the friction it leaves out."""

from __future__ import annotations

from collections.abc import Iterator

from friction_ocp.drive.parts import Shaft
from friction_ocp.drive.steady import reference_shaft, steady_speeds
from friction_ocp.friction.static import NoFriction
from friction_ocp.quantities import si_unit
from friction_ocp.targets.fitted import Fitted


def compensation_text(fitted: Fitted, width: float) -> str:
    """Return what NAME_compensate returns, its arguments, and what it does not cancel, in a few lines.

    `width` is the speed within which it should go through zero."""
    drive = fitted.drive
    first = reference_shaft(drive)
    motion, joined = drive.shaft(first).motion, steady_speeds(drive)
    cancelled = [item.name for item in drive.shafts if _rubs(item) and item.name in joined]
    lines = [
        f"Compensation: {fitted.name}_compensate(speed, width, {fitted.name}_identified) returns the torque, "
        f"{si_unit('torque', motion)}, at {first} that cancels the friction of {', '.join(cancelled) or 'no shaft'} in "
        "steady motion",
        f"  speed: wanted, of {first}, {si_unit('speed', motion)}",
        f"  width: {si_unit('speed', motion)}, within which it goes through zero; {width:.3g} suits the recordings",
    ]
    return "\n".join([*lines, *(f"  left out: {text}" for text in left_out(fitted))])


def left_out(fitted: Fitted) -> Iterator[str]:
    """Yield what a steady torque over the speed does not hold of the friction and the other torques of a drive."""
    joined = steady_speeds(fitted.drive)
    for shaft in fitted.drive.shafts:
        element = shaft.friction
        if _rubs(shaft) and shaft.name not in joined:
            yield f"friction of {shaft.name}, which turns at no fixed ratio to the motor"
            continue
        if element.law.has_bristle:
            yield f"presliding of {shaft.name}: its level once it slides is taken at once"
        if element.load is not None:
            yield f"growth of the friction of {shaft.name} with the load: it is that without load"
        if element.ripple is not None:
            yield f"ripple of the friction of {shaft.name}: its mean over the angle is taken"
        if element.warm_up is not None:
            yield f"warm-up of {shaft.name}: it is the friction before any"
        forces = (
            ("gravity", shaft.gravity),
            ("external torque", shaft.external_torque),
            ("disturbance", shaft.disturbance),
        )
        for name, part in forces:
            if part is not None:
                yield f"{name} on {shaft.name}, which is no friction"
    for item in fitted.drive.transmissions:
        if item.hysteresis is not None:
            yield f"hysteresis of {item.name}"
    for motor in fitted.drive.motors:
        if motor.cogging is not None:
            yield f"cogging of {motor.name}, which is no friction"


def _rubs(shaft: Shaft) -> bool:
    return not isinstance(shaft.friction.law, NoFriction)
