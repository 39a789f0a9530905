"""The drives of the suite: each is a template of a problem file, and what surrounds the drive when it is recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
)

from blind.document import Number, truth

Document = Mapping[str, Any]
LOOP_ENCODER = "loop_encoder"
"""The sensor that the loop of the machine sees: what the log keeps of it is coarser."""


@dataclass(frozen=True)
class Machine:
    """A drive with the loop that moves it."""

    name: str
    document: Document
    loop: PlantController
    feedback: str
    """What the loop measures."""
    loop_resolution: float
    top_speed: float
    """Of the reference, rad/s or m/s."""
    travel: float
    """Of the reference, rad or m; only a loop of position has one."""
    sample_time: float = 1e-3
    samples: int = 6000
    step: float = 1e-4
    window: float = 1.25
    """Over what time a free run of a drive without known loop is judged, s."""

    @property
    def duration(self) -> float:
        """Length of a recording, s."""
        return (self.samples - 1) * self.sample_time

    @property
    def closed(self) -> bool:
        """Whether the model knows the loop, so that its free run does not drift."""
        return "controller" in self.document

    def plant(self) -> Plant:
        """Return the drive as it is, without any hidden effect."""
        return plant_of(truth(self.document), self)


def plant_of(document: Document, machine: Machine) -> Plant:
    """Return the plant that a problem document with plain numbers describes, moved by the loop of the machine."""
    drive = document["drive"]
    shafts = tuple(_shaft(item) for item in drive["shafts"])
    first = shafts[0].name
    motor = drive["motor"]
    moved = PlantMotor(
        name=motor["name"],
        shaft=first,
        drive="voltage" if "resistance" in motor else "current",
        torque_constant=motor["torque_constant"],
        resistance=motor.get("resistance", 1.0),
        controller=machine.loop.name,
    )
    names = [shaft.name for shaft in shafts]
    joints = tuple(_transmission(item, *names[k : k + 2]) for k, item in enumerate(drive.get("transmissions", [])))
    sensors = tuple(_sensor(name, item, machine, moved.name) for name, item in document["channels"].items()
                    if not item["measures"].startswith("reference") and "supply" not in item["measures"])  # fmt: skip
    seen = PlantSensor(LOOP_ENCODER, machine.feedback, machine.sample_time, resolution=machine.loop_resolution)
    return Plant(shafts, joints, (moved,), (machine.loop,), (*sensors, seen))


def _shaft(item: Document) -> PlantShaft:
    friction = dict(item.get("friction", {"law": "none"}))
    gravity = item.get("gravity", {})
    return PlantShaft(
        item["name"],
        item["inertia"],
        PlantFriction(**friction),
        (gravity.get("torque", 0.0), gravity.get("phase", 0.0)),
    )


def _transmission(item: Document, start: str, end: str) -> PlantTransmission:
    stiffness = float("inf") if item["stiffness"] == "rigid" else item["stiffness"]
    return PlantTransmission(start, end, item["ratio"], stiffness, item.get("damping", 0.0))


def _sensor(name: str, item: Document, machine: Machine, motor: str) -> PlantSensor:
    measures = item["measures"].replace(f"{motor}.current", f"{motor}.command")
    noise = 0.0 if item.get("role") == "input" else item.get("noise_std", 0.0)
    return PlantSensor(name, measures, machine.sample_time, noise, resolution=item.get("resolution", 0.0))


def _known(value: float) -> Number:
    return Number(value)


def _about(value: float) -> Number:
    """Return a number that the handbook gives with a deviation of 5 %."""
    return Number(value, 0.05, True)


def _guessed(value: float) -> Number:
    """Return a number that nobody measured: the guess is off by a quarter and has no prior."""
    return Number(value, 0.25, False, 0.25)


def _dry(tau_c: float, viscous: float) -> dict[str, Any]:
    return {"law": "coulomb_viscous", "tau_c": _guessed(tau_c), "viscous": _guessed(viscous)}


def telescope() -> Machine:
    """Return an axis on an elastic reducer, under a loop of speed that the model does not know."""
    document = {
        "title": "Telescope axis: motor encoder, load encoder, current",
        "drive": {
            "motor": {"name": "drive", "torque_constant": _known(0.35)},
            "shafts": [
                {"name": "motor", "inertia": _known(0.002), "friction": _dry(0.1, 8e-4)},
                {"name": "load", "inertia": _about(120.0), "friction": _dry(8.0, 30.0)},
            ],
            "transmissions": [{"ratio": 300.0, "stiffness": _about(1.2e5), "damping": _guessed(200.0)}],
        },
        "channels": {
            "current": {"measures": "drive.current", "role": "input", "hold": "zero"},
            "motor_position": {"measures": "motor.theta", "resolution": 2 * np.pi / 2**8},
            "load_position": {"measures": "load.theta", "noise_std": 2.5e-5},
        },
        "estimation": {"fit": "simulation"},
    }
    loop = PlantController("loop", "pi_velocity", LOOP_ENCODER, kp=0.14, ki=0.7, saturation=(-25.0, 25.0))
    return Machine("telescope", document, loop, "motor.theta", 2 * np.pi / 2**20, 100.0, 0.0)


def telescope_accelerometer() -> Machine:
    """Return the same axis with an accelerometer on the load in place of the encoder."""
    machine = telescope()
    channels = dict(machine.document["channels"])
    del channels["load_position"]
    channels["load_acceleration"] = {"measures": "load.alpha", "noise_std": 0.01}
    title = "Telescope axis: motor encoder, load accelerometer, current"
    document = {**machine.document, "title": title, "channels": channels}
    return replace(machine, name="telescope_accelerometer", document=document)


def robot() -> Machine:
    """Return a joint with a strain-wave gear and both encoders that lifts its link, in a known cascade."""
    document = {
        "title": "Robot joint: motor encoder, joint encoder, current, known cascade",
        "drive": {
            "motor": {"name": "drive", "torque_constant": _known(0.05)},
            "shafts": [
                {"name": "motor", "inertia": _about(1e-4), "friction": _dry(0.012, 4e-5)},
                {"name": "joint", "inertia": _about(1.2), "friction": _dry(1.2, 1.5),
                 "gravity": {"torque": _known(14.0)}},
            ],
            "transmissions": [{"ratio": 100.0, "stiffness": _about(1.2e4), "damping": _guessed(15.0)}],
        },
        "controller": {"type": "cascade", "feedback": "motor_position", "output": "current", "kp": 15.0, "kd": 0.08,
                       "ki": 0.6, "sample_time": 1e-3, "saturation": [-12.0, 12.0]},
        "channels": {
            "reference": {"measures": "reference.theta", "role": "input", "hold": "zero"},
            "motor_position": {"measures": "motor.theta", "noise_std": 2e-3},
            "joint_position": {"measures": "joint.theta", "noise_std": 2e-5},
            "current": {"measures": "drive.current", "noise_std": 0.02},
        },
    }  # fmt: skip
    loop = PlantController("loop", "cascade", LOOP_ENCODER, kp=15.0, kd=0.08, ki=0.6, saturation=(-12.0, 12.0))
    return Machine("robot", document, loop, "motor.theta", 2 * np.pi / 2**18, 150.0, 250.0)


def servo() -> Machine:
    """Return a geared hobby servo with one encoder that swings an arm, driven by the duty of its voltage."""
    document = {
        "title": "Servo with an arm: motor encoder only, known duty controller",
        "drive": {
            "motor": {"name": "drive", "torque_constant": _about(5e-3), "resistance": _about(4.0)},
            "shafts": [
                {"name": "motor", "inertia": _about(2e-6), "friction": _dry(3e-4, 1e-6)},
                {"name": "arm", "inertia": _known(0.02), "gravity": {"torque": _known(0.35)}},
            ],
            "transmissions": [{"ratio": 150.0, "stiffness": "rigid"}],
        },
        "controller": {"type": "duty", "feedback": "motor_position", "output": "voltage", "kp": 0.02,
                       "saturation": [-1.0, 1.0], "sample_time": 2e-3},
        "channels": {
            "reference": {"measures": "reference.theta", "role": "input", "hold": "zero"},
            "supply": {"measures": "drive.supply_voltage", "role": "input", "hold": "zero"},
            "motor_position": {"measures": "motor.theta", "noise_std": 0.05},
        },
    }  # fmt: skip
    loop = PlantController(
        "loop", "duty", LOOP_ENCODER, kp=0.02, saturation=(-1.0, 1.0), sample_time=2e-3, supply=SUPPLY
    )
    return Machine("servo", document, loop, "motor.theta", 2 * np.pi / 2**12, 500.0, 450.0, sample_time=2e-3)


SUPPLY = 7.4
"""Volts of the servo's battery."""


def feed() -> Machine:
    """Return a carriage on a ball screw with motor encoder and linear scale, in a known cascade."""
    document = {
        "title": "Feed drive: motor encoder, linear scale, current, known cascade",
        "drive": {
            "motor": {"name": "drive", "torque_constant": _known(0.6)},
            "shafts": [
                {"name": "motor", "inertia": _about(3e-3), "friction": _dry(0.3, 2e-3)},
                {"name": "carriage", "motion": "linear", "inertia": _about(150.0), "friction": _dry(120.0, 400.0)},
            ],
            "transmissions": [{"ratio": 628.3185307, "stiffness": _about(1e7), "damping": _guessed(3e3)}],
        },
        "controller": {"type": "cascade", "feedback": "motor_position", "output": "current", "kp": 25.0, "kd": 0.45,
                       "ki": 4.0, "sample_time": 1e-3, "saturation": [-25.0, 25.0]},
        "channels": {
            "reference": {"measures": "reference.theta", "role": "input", "hold": "zero"},
            "motor_position": {"measures": "motor.theta", "noise_std": 1e-3},
            "scale": {"measures": "carriage.theta", "noise_std": 1e-6},
            "current": {"measures": "drive.current", "noise_std": 0.05},
        },
    }  # fmt: skip
    loop = PlantController("loop", "cascade", LOOP_ENCODER, kp=25.0, kd=0.45, ki=4.0, saturation=(-25.0, 25.0))
    return Machine("feed", document, loop, "motor.theta", 2 * np.pi / 2**20, 150.0, 200.0)


def mount() -> Machine:
    """Return a mount with a rigid first and an elastic second stage, under a loop that the model does not know."""
    document = {
        "title": "Three-stage mount: motor encoder, axis encoder, current",
        "drive": {
            "motor": {"name": "drive", "torque_constant": _known(0.12)},
            "shafts": [
                {"name": "motor", "inertia": _known(1e-4), "friction": _dry(0.02, 1e-4)},
                {"name": "gear", "inertia": _about(0.02)},
                {"name": "axis", "inertia": _about(25.0), "friction": _dry(4.0, 6.0)},
            ],
            "transmissions": [
                {"ratio": 20.0, "stiffness": "rigid"},
                {"ratio": 18.0, "stiffness": _about(4e4), "damping": _guessed(60.0)},
            ],
        },
        "channels": {
            "current": {"measures": "drive.current", "role": "input", "hold": "zero"},
            "motor_position": {"measures": "motor.theta", "noise_std": 1e-2},
            "axis_position": {"measures": "axis.theta", "noise_std": 3e-5},
        },
        "estimation": {"fit": "simulation"},
    }
    loop = PlantController("loop", "pi_velocity", LOOP_ENCODER, kp=0.06, ki=0.3, saturation=(-15.0, 15.0))
    return Machine("mount", document, loop, "motor.theta", 2 * np.pi / 2**18, 200.0, 0.0)


MACHINES = {make().name: make for make in (telescope, telescope_accelerometer, robot, servo, feed, mount)}
