"""SI units of every number and every signal of a drive."""

from __future__ import annotations

from friction_ocp.drive.parts import Controller, Drive, Motion
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.parameters import Leaf
from friction_ocp.quantities import si_unit

SHAFT_SIGNALS = {"theta": "angle", "omega": "speed", "alpha": "acceleration"}
"""What can be measured of the motion of a shaft, and the kind of quantity it is."""

DRIVE_TORQUE = "drive_torque"
"""What drives a shaft whose motion is prescribed: the friction force of a tribometer, the torque of a dynamometer."""

MOTOR_SIGNALS = {
    "current": "current",
    "current_command": "current",
    "torque": "torque",
    "voltage": "voltage",
    "supply_voltage": "voltage",
    "enable": "dimensionless",
}
"""What can be measured of a motor, and the kind of quantity it is."""

REFERENCE_SIGNALS = {"theta": "angle", "omega": "speed"}

_KINDS = {"viscous": "damping", "quadratic": "quadratic_damping"}
_FIXED = {"per_kelvin": "1/K", "saturation": "1/A^2"}
"""Units of what is not a quantity that can be recorded."""
_LOAD_VISCOUS: dict[Motion, str] = {"rotary": "s/rad", "linear": "s/m"}


def unit_of(leaf: Leaf, drive: Drive) -> str:
    """Return the SI unit of a number of the drive, such as "N m s/rad"."""
    motion: Motion = "linear" if leaf.motion == "linear" else "rotary"
    part, _, key = leaf.path.partition(".") if leaf.kind == "gain" else leaf.path.rpartition(".")
    match leaf.kind:
        case "gain":
            return _gain_unit(drive, key)
        case "channel":
            return signal_unit(drive, next(item.measures for item in drive.channels if item.name == part))
        case "load_viscous":
            return _LOAD_VISCOUS[motion]
        case "input_angle":
            return _input_angle_unit(drive, leaf.path.partition(".")[0])
        case "dimensionless" if key == "ratio":
            return _ratio_unit(drive, part)
        case kind if kind in _FIXED:
            return _FIXED[kind]
        case kind:
            return si_unit(_KINDS.get(kind, kind), motion)


def signal_unit(drive: Drive, measures: str) -> str:
    """Return the SI unit of a signal such as `load.omega`; raises FrictionOcpError where there is none."""
    part, _, signal = measures.partition(".")
    shafts: dict[str, Motion] = {shaft.name: shaft.motion for shaft in drive.shafts}
    motors: dict[str, Motion] = {motor.name: shafts.get(motor.shaft, "rotary") for motor in drive.motors}
    if measures == "temperature":
        return si_unit("temperature")
    if part == "reference" and signal in REFERENCE_SIGNALS:
        return si_unit(REFERENCE_SIGNALS[signal], feedback_motion(drive))
    if part in shafts and signal in SHAFT_SIGNALS:
        return si_unit(SHAFT_SIGNALS[signal], shafts[part])
    if part in shafts and signal == DRIVE_TORQUE:
        return si_unit("torque", shafts[part])
    if part in motors and signal in MOTOR_SIGNALS:
        return si_unit(MOTOR_SIGNALS[signal], motors[part])
    raise FrictionOcpError(Finding(measures, "the drive has no such signal"))


def feedback_motion(drive: Drive) -> Motion:
    """Return the motion of the shaft that the controller watches, else of the first shaft."""
    watched = "" if drive.controller is None else drive.controller.feedback
    parts = {channel.part for channel in drive.channels if channel.name == watched}
    for shaft in drive.shafts:
        if shaft.name in parts:
            return shaft.motion
    return drive.shafts[0].motion


def _input_angle_unit(drive: Drive, transmission: str) -> str:
    item = next(item for item in drive.transmissions if item.name == transmission)
    return si_unit("angle", drive.shaft(item.from_shaft).motion)


def _ratio_unit(drive: Drive, transmission: str) -> str:
    """A screw turns an angle into a length, so that its ratio is not a plain number."""
    item = next(item for item in drive.transmissions if item.name == transmission)
    ends = [si_unit("angle", drive.shaft(name).motion) for name in (item.from_shaft, item.to_shaft)]
    return "1" if ends[0] == ends[1] else f"{ends[0]}/{ends[1]}"


def _gain_unit(drive: Drive, key: str) -> str:
    controller = drive.controller
    assert controller is not None
    output = command_unit(drive, controller)
    if key.startswith("saturation"):
        return output
    if controller.type == "cascade" and key == "kp":
        return "1/s"
    angle = si_unit("angle", feedback_motion(drive))
    of_speed = key == "kd" or (controller.type == "pi_velocity" and key == "kp")
    if not of_speed:
        return f"{output}/{angle}"
    return f"s/{angle}" if output == "1" else f"{output} s/{angle}"


def command_unit(drive: Drive, controller: Controller) -> str:
    """Return the SI unit of a controller's command."""
    if controller.type == "duty":
        return "1"
    driven = drive.shaft(drive.motors[0].shaft) if drive.motors else drive.shafts[0]
    return si_unit(controller.output, driven.motion)
