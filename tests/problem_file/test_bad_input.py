"""Every kind of bad input is found, at its place in the file, with what is allowed and what to do."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.errors import FrictionOcpError
from friction_ocp.problem_file.check import check, check_before_fit
from friction_ocp.problem_file.load import load_problem

Content = dict[str, Any]


def put(place: str, value: Any) -> Callable[[Content], None]:
    """Return an edit that puts a value at a place such as drive.shafts.0.inertia."""

    def spoil(content: Content) -> None:
        node: Any = content
        *keys, last = [int(key) if key.isdigit() else key for key in place.split("/")]
        for key in keys:
            node = node[key]
        node[last] = value

    return spoil


def drop(place: str) -> Callable[[Content], None]:
    """Return an edit that removes a key."""

    def spoil(content: Content) -> None:
        node: Any = content
        *keys, last = [int(key) if key.isdigit() else key for key in place.split("/")]
        for key in keys:
            node = node[key]
        del node[last]

    return spoil


def several(*edits: Callable[[Content], None]) -> Callable[[Content], None]:
    def spoil(content: Content) -> None:
        for edit in edits:
            edit(content)

    return spoil


SHAFT = "drive/shafts/0"
FRICTION = f"{SHAFT}/friction"
DUTY = {"type": "duty", "feedback": "position", "kp": 1.0}
SECOND_SHAFT = {"name": "arm", "inertia": 0.1}
TWO_SHAFTS = [{"name": "load", "inertia": 0.1}, SECOND_SHAFT]
STAGE = {"stiffness": 1, "twist": 0.1}
RIPPLING = {"cosine": {"guess": 0}, "sine": 0.01, "period": 1}
LUGRE = {"law": "lugre", "tau_c": 1, "tau_s": 1.5, "omega_s": 0.1, "sigma0": 100}

FILE_FAULTS: dict[str, tuple[Callable[[Content], None], str]] = {
    "no shafts": (put("drive/shafts", []), "drive.shafts: the list has 0 items; at least 1"),
    "unknown key": (
        put(f"{SHAFT}/inerta", 1.0),
        "drive.shafts[0].inerta: unknown key 'inerta'; available: name, inertia, friction, gravity, external_torque, "
        "motion, disturbance; did you mean 'inertia'?",
    ),
    "fitted delay of an input": (
        several(
            put("channels/current/delay", {"guess": 0.0, "min": -0.01, "max": 0.01}),
            put("channels/pull", {"measures": "motor.torque", "role": "input"}),
        ),
        "channels.current.delay: current is not the only input that moves the machine, and its delay cannot be fitted; "
        "a number; fit the delay of the outputs",
    ),
    "unknown key of a law": (put(f"{FRICTION}/sigma0", 1.0), "drive.shafts[0].friction.sigma0: unknown key 'sigma0'; "),
    "key that other laws have": (
        put(FRICTION, {"law": "coulomb", "tau_c": 1, "viscous": 1}),
        "drive.shafts[0].friction.viscous: unknown key 'viscous'; available: tau_c, law, load, ripple, warm_up; the "
        "law coulomb_viscous or stribeck or ",
    ),
    "signal of the motor on a shaft": (
        several(put("drive/motor/name", "servo"), put("channels/current/measures", "load.current")),
        "channels.current.measures: 'load' has no signal 'current'; available: load.theta, load.omega, load.alpha, "
        "load.drive_torque; did you mean 'servo.current'?",
    ),
    "unknown law": (
        put(FRICTION, {"law": "lugree", "tau_c": 1}),
        "drive.shafts[0].friction.law: unknown friction law 'lugree'; available: none, coulomb, viscous, ",
    ),
    "close law": (put(f"{FRICTION}/law", "lugree"), "did you mean 'lugre'?"),
    "missing key": (drop(f"{SHAFT}/inertia"), "drive.shafts[0].inertia: this key is missing; a number, {guess"),
    "missing number of a law": (drop(f"{FRICTION}/omega_s"), "drive.shafts[0].friction.omega_s: this key is missing"),
    "not a number": (put(f"{SHAFT}/inertia", "heavy"), "drive.shafts[0].inertia: this is 'heavy'; a number, {guess"),
    "not finite": (put(f"{SHAFT}/inertia", float("nan")), "drive.shafts[0].inertia: this is nan; a number"),
    "fitted without guess": (put(f"{SHAFT}/inertia", {"min": 0}), "drive.shafts[0].inertia.guess: this key is missing"),
    "direction of an inertia": (put(f"{SHAFT}/inertia", {"positive": 1, "negative": 2}), "only numbers of friction"),
    "unknown choice": (
        put("channels/current/role", "inputt"),
        "channels.current.role: unknown value 'inputt'; available: 'input', 'output'",
    ),
    "unknown estimation key": (
        put("estimation", {"sover": "ipopt"}),
        "estimation.sover: unknown key 'sover'; available",
    ),
    "no starts": (put("estimation", {"starts": 0}), "estimation.starts: this is 0; greater than or equal to 1"),
    "other format": (
        put("format", "friction-ocp-problem/9"),
        "format: unknown value 'friction-ocp-problem/9'; available",
    ),
    "no training": (put("recordings/train", []), "recordings.train: "),
    "torque constant of a current": (put("drive/motor", {}), "drive.motor.torque_constant: this key is missing"),
    "missing stiffness": (
        several(put("drive/shafts", TWO_SHAFTS), put("drive/transmissions", [{"ratio": 5}])),
        "drive.transmissions[0].stiffness: this key is missing",
    ),
    "branch without ends": (
        several(put("drive/shafts", TWO_SHAFTS), put("drive/transmissions", [{"stiffness": 1}, {"stiffness": 2}])),
        "drive.transmissions[1].from: this key is missing; only a plain chain leaves it out",
    ),
    "nameless motor": (put("drive/motors", [{"torque_constant": 1}]), "drive.motors[0].name: this key is missing"),
}

MODEL_FAULTS: dict[str, tuple[Callable[[Content], None], str]] = {
    "unknown clock": (
        put("channels/position/clock", "loger"),
        "channels.position.clock: unknown clock 'loger'; describe it in clocks",
    ),
    "fitted clock of an input": (
        several(
            put("channels/current/clock", "logger"),
            put("clocks", {"logger": {"offset": {"guess": 0.0, "min": -0.1, "max": 0.1}}}),
        ),
        "clocks.logger.offset: current is an input, and its clock cannot be fitted; a number; fit the clock of the",
    ),
    "noise that is no level": (
        put("estimation", {"process_noise": {"load": "often"}}),
        "estimation.process_noise.load: this is 'often'; a number >= 0, estimate, or {guess: ...}",
    ),
    "noise with a negative guess": (
        put("estimation", {"process_noise": {"load": {"guess": -1.0}}}),
        "estimation.process_noise.load.guess: ",
    ),
    "bounds the wrong way round": (
        put(f"{FRICTION}/tau_c", {"guess": 0.05, "min": 1, "max": 0}),
        "drive.shafts[0].friction.tau_c: min = 1 N m is above max = 0 N m; min below max; swap them",
    ),
    "bounds that both are elsewhere": (
        put(f"{FRICTION}/tau_c", {"guess": 0.05, "min": 1, "max": 0.5}),
        "drive.shafts[0].friction.tau_c: min = 1 N m is above max = 0.5 N m; min below max; correct one of them",
    ),
    "guess outside": (
        put(f"{FRICTION}/tau_c", {"guess": 0.05, "min": 0.06, "max": 1}),
        "drive.shafts[0].friction.tau_c: guess = 0.05 N m is outside its bounds; 0.06 N m to 1 N m; move",
    ),
    "a share of what the law does not have": (
        put(FRICTION, {"law": "coulomb", "tau_c": 0.1, "added": {"speed_share": 0.1, "stiffness_share": 0.1}}),
        "drive.shafts[0].friction.added.speed_share: this friction has no omega_s to be larger by a share; leave it",
    ),
    "a share that leaves nothing": (
        put(FRICTION, LUGRE | {"added": {"speed_share": {"positive": 0.2, "negative": -1.2}}}),
        "drive.shafts[0].friction.added.speed_share.negative: added.speed_share.negative = -1.2; must be above -1",
    ),
    "tau_s below tau_c": (
        put(f"{FRICTION}/tau_s", 0.03),
        "drive.shafts[0].friction: tau_s = 0.03 N m is below tau_c = 0.05 N m; breakaway must be >= Coulomb torque",
    ),
    "tau_s below tau_c in one direction": (
        put(f"{FRICTION}/tau_s", {"positive": 0.06, "negative": {"guess": 0.01}}),
        "drive.shafts[0].friction: tau_s.negative = 0.01 N m is below tau_c = 0.05 N m",
    ),
    "no inertia": (put(f"{SHAFT}/inertia", 0), "drive.shafts[0].inertia: inertia = 0 kg m^2; an inertia is positive"),
    "no ratio": (
        several(put("drive/shafts", TWO_SHAFTS), put("drive/transmissions", [{"ratio": 0, "stiffness": "rigid"}])),
        "drive.transmissions[0].ratio: ratio = 0; must not be zero",
    ),
    "negative stiffness": (
        several(put("drive/shafts", TWO_SHAFTS), put("drive/transmissions", [{"stiffness": -5}])),
        "drive.transmissions[0].stiffness: stiffness = -5 N m/rad; must be positive",
    ),
    "play of a rigid joint": (
        several(put("drive/shafts", TWO_SHAFTS), put("drive/transmissions", [{"stiffness": "rigid", "backlash": 0.1}])),
        "drive.transmissions[0].backlash: backlash of a rigid transmission has no effect",
    ),
    "loop of a rigid joint": (
        several(
            put("drive/shafts", TWO_SHAFTS),
            put("drive/transmissions", [{"stiffness": "rigid", "hysteresis": {"torque": 1, "twist": 0.1}}]),
        ),
        "drive.transmissions[0].hysteresis: hysteresis of a rigid transmission has no effect; state a stiffness",
    ),
    "second stage that softens": (
        several(
            put("drive/shafts", TWO_SHAFTS),
            put("drive/transmissions", [{"stiffness": 10, "second_stage": {**STAGE, "stiffness": -1}}]),
        ),
        "drive.transmissions[0].second_stage.stiffness: second_stage.stiffness = -1 N m/rad; must not be negative",
    ),
    "second stage that is rounded away": (
        several(
            put("drive/shafts", TWO_SHAFTS),
            put("drive/transmissions", [{"stiffness": 10, "second_stage": {**STAGE, "rounding": 1}}]),
        ),
        "drive.transmissions[0].second_stage.rounding: second_stage.rounding = 1; must be at least 0 and below 1",
    ),
    "error of a rigid joint backwards": (
        several(
            put("drive/shafts", TWO_SHAFTS),
            put(
                "drive/transmissions",
                [{"from": "arm", "to": "load", "stiffness": "rigid", "kinematic_error": RIPPLING}],
            ),
        ),
        "arm-load.kinematic_error: 'load' comes before 'arm' in its group of rigidly joined shafts",
    ),
    "drive torque without a prescribed motion": (
        put("channels/effort", {"measures": "load.drive_torque"}),
        "channels.effort: load.drive_torque cannot be predicted: no input prescribes the motion of 'load'; make the",
    ),
    "drive torque as an input": (
        put("channels/effort", {"measures": "load.drive_torque", "role": "input"}),
        "channels.effort.role: load.drive_torque is what a prescribed motion takes, and cannot be given beside it",
    ),
    "moved behind an error": (
        several(
            put("drive/shafts", TWO_SHAFTS),
            put("drive/transmissions", [{"stiffness": "rigid", "kinematic_error": RIPPLING}]),
            put("channels/moved", {"measures": "arm.omega", "role": "input"}),
        ),
        "channels.moved: arm.omega is prescribed behind a rigid joint with a kinematic error; load.omega",
    ),
    "negative saturation": (
        put("drive/motor/saturation", -1),
        "drive.motor.saturation: saturation = -1 1/A^2; must not be negative",
    ),
    "a saturation that turns the torque round": (
        put("drive/motor/saturation_tail", -1.5),
        "drive.motor.saturation_tail: saturation_tail = -1.5; must be at least -1",
    ),
    "negative lag": (put("drive/motor/lag", -1), "drive.motor.lag: lag = -1 s; must not be negative"),
    "break count": (
        put(FRICTION, {"law": "polyline", "tau_c": 0.1, "slopes": [1, 2], "breaks": [1, 2]}),
        "drive.shafts[0].friction.breaks: there are 2 breaks for 2 slopes; 1 breaks: one fewer than slopes",
    ),
    "break order": (
        put(FRICTION, {"law": "polyline", "tau_c": 0.1, "slopes": [1, 2, 3], "breaks": [2, {"guess": 1}]}),
        "drive.shafts[0].friction.breaks: the breaks are 2, 1; positive speeds that rise",
    ),
    "load without a load": (
        several(put(f"{FRICTION}/load", {"coulomb": 0.1}), drop("drive/motor"), drop("channels/current")),
        "drive.shafts[0].friction.load: friction of 'load' depends on load, and it has neither a transmission nor a "
        "motor",
    ),
    "load Stribeck without speed": (
        put(FRICTION, {"law": "coulomb", "tau_c": 1, "load": {"stribeck": 0.1}}),
        "drive.shafts[0].friction.load.stribeck: law 'coulomb' has no Stribeck speed",
    ),
    "unknown key of a term": (
        put("drive/motor/cogging", {"cosine": 0.1, "sine": 0, "perod": 1}),
        "drive.motor.cogging.perod: unknown key 'perod'; available: cosine, sine, period, second_cosine, second_sine, "
        "third_cosine, third_sine, other_cosine, other_sine, other_period, origin, other_origin; did you mean "
        "'period'?",
    ),
    "further wave without a period": (
        put("drive/motor/cogging", {"cosine": 0.1, "sine": 0, "period": 1, "other_sine": 0.1}),
        "drive.motor.cogging.other_sine: a further wave without other_period; state other_period, too, or leave it out",
    ),
    "further wave without an amplitude": (
        put("drive/motor/cogging", {"cosine": 0.1, "sine": 0, "period": 1, "other_period": 0.3}),
        "drive.motor.cogging.other_period: a further wave without other_cosine or other_sine",
    ),
    "period of nothing": (
        put(f"{SHAFT}/disturbance", {"cosine": 0.1, "sine": 0, "period": 0}),
        "drive.shafts[0].disturbance.period: disturbance.period = 0 s; must be positive",
    ),
    "unmeasured temperature": (
        put(f"{FRICTION}/warm_up", {"per_kelvin": {"guess": 0}}),
        "drive.shafts[0].friction.warm_up.per_kelvin: friction depends on the temperature, which no input channel",
    ),
    "warm-up without time": (
        put(f"{FRICTION}/warm_up", {"amplitude": 0.1}),
        "drive.shafts[0].friction.warm_up.time_constant: this key is missing",
    ),
    "eccentric input": (
        put("channels/current/eccentricity", {"cosine": 0.1}),
        "channels.current.eccentricity: input channel that measures motor.current; outputs that measure theta",
    ),
    "eccentric scale": (
        several(put(f"{SHAFT}/motion", "linear"), put("channels/position/eccentricity", {"cosine": 0.1})),
        "channels.position.eccentricity: output channel that measures load.theta; outputs that measure theta, omega or",
    ),
    "set of a term that is off": (
        several(
            put(f"{SHAFT}/disturbance", {"cosine": 0, "sine": 0, "period": 1}),
            put("recordings/train", [{"file": "sweep.h5", "set": {"load.disturbance.sine": 1}}]),
        ),
        "recordings.train[0].set: 'load.disturbance.sine' is left out of the model, its term being zero",
    ),
    "unknown part": (
        put("channels/position/measures", "laod.theta"),
        "channels.position.measures: unknown part 'laod'; parts: load, motor, reference; or temperature; did you mean ",
    ),
    "unknown signal": (
        put("channels/position/measures", "load.angle"),
        "channels.position.measures: 'load' has no signal 'angle'; available: load.theta, load.omega, load.alpha, "
        "load.drive_torque; did you mean 'load.theta'?",
    ),
    "reference as output": (
        put("channels/goal", {"measures": "reference.theta", "role": "output"}),
        "channels.goal.role: nothing predicts reference.theta; role: input",
    ),
    "acceleration as input": (
        put("channels/current", {"measures": "load.alpha", "role": "input"}),
        "channels.current.role: load.alpha cannot drive a shaft",
    ),
    "no output": (put("channels/position/role", "input"), "channels: no channel is an output"),
    "nothing drives the motor": (drop("channels/current"), "drive.motor: nothing drives motor 'motor'"),
    "driven twice": (
        put("channels/torque", {"measures": "motor.torque", "role": "input"}),
        "drive.motor: motor 'motor' is driven by motor.torque and by motor.current",
    ),
    "voltage without resistance": (
        put("channels/current/measures", "motor.voltage"),
        "drive.motor.resistance: motor 'motor' is driven by voltage, and its resistance is missing",
    ),
    "current of a motor driven by torque": (
        put(
            "channels",
            {
                "current": {"measures": "motor.torque", "role": "input"},
                "position": {"measures": "motor.current"},
            },
        ),
        "channels.position: motor.current cannot be predicted: motor 'motor' is driven by torque",
    ),
    "unknown feedback": (
        put("controller", {**DUTY, "feedback": "positon"}),
        "controller.feedback: unknown feedback channel 'positon'; available: current, position; did you mean",
    ),
    "no reference": (
        put("controller", DUTY),
        "controller: the duty controller has no set point; an input channel that",
    ),
    "no supply": (put("controller", DUTY), "controller: the duty of motor 'motor' has no supply voltage"),
    "unknown shaft of a motor": (
        put("drive/motor/shaft", "lod"),
        "drive.motor.shaft: unknown shaft 'lod'; there are load; did you mean 'load'?",
    ),
    "unknown shaft of a transmission": (
        put("drive/transmissions", [{"from": "load", "to": "arm", "stiffness": 1}]),
        "drive.transmissions[0].to: unknown shaft 'arm'",
    ),
    "loose shaft": (put("drive/shafts", TWO_SHAFTS), "drive.shafts[1]: nothing joins shaft 'arm' to 'load'"),
    "same name twice": (
        several(put("drive/shafts", [SECOND_SHAFT, SECOND_SHAFT]), put("drive/transmissions", [{"stiffness": 1}])),
        "drive.shafts: 2 shafts are called 'arm'",
    ),
    "unknown name in a tie": (
        put(f"{FRICTION}/viscous", {"expr": "2 * load.inertai"}),
        "drive.shafts[0].friction.viscous.expr: unknown name 'load.inertai' at position 5",
    ),
    "ties in a circle": (
        several(
            put(f"{SHAFT}/inertia", {"expr": "load.friction.tau_c"}), put(f"{FRICTION}/tau_c", {"expr": "load.inertia"})
        ),
        "the ties depend on each other in a circle: load.inertia -> load.friction.tau_c -> load.inertia",
    ),
    "constraint without relation": (
        put("constraints", ["load.inertia"]),
        "constraints[0]: 'load.inertia' is not an inequality; two values joined by <= or >=",
    ),
    "unknown set": (
        put("recordings/train", [{"file": "sweep.h5", "set": {"motor.torque_const": 1}}]),
        "recordings.train[0].set: unknown parameter 'motor.torque_const'; paths such as load.inertia; did you mean",
    ),
    "set to a negative inertia": (
        put("recordings/train", [{"file": "sweep.h5", "set": {"load.inertia": -1}}]),
        "recordings.train[0].set: drive.shafts[0].inertia: inertia = -1 kg m^2; an inertia is positive",
    ),
    "set to no gain": (
        put("recordings/train", [{"file": "sweep.h5", "set": {"position.gain": 0}}]),
        "recordings.train[0].set: channels.position.gain: gain = 0; must not be zero",
    ),
    "set below what holds everywhere": (
        put("recordings/train", [{"file": "sweep.h5", "set": {"load.friction.tau_s": 0.03}}]),
        "recordings.train[0].set: drive.shafts[0].friction: tau_s = 0.03 N m is below tau_c = 0.05 N m; breakaway",
    ),
    "process noise on nothing": (
        put("estimation", {"process_noise": {"lod": 0.1}}),
        "estimation.process_noise.lod: unknown shaft 'lod'; there are load; did you mean 'load'?",
    ),
    "missing file": (
        put("recordings/train", ["sweep.h5", "sweap.h5"]),
        "recordings.train[1]: {folder}/sweap.h5: there is no such file",
    ),
}


@pytest.mark.parametrize("name", [*FILE_FAULTS, *MODEL_FAULTS])
def test_fault_of_the_file_is_refused(workshop: Workshop, name: str) -> None:
    """A fault of the file is refused when it is loaded, with one message at its place."""
    spoil, expected = (FILE_FAULTS | MODEL_FAULTS)[name]
    path = workshop.problem(spoil)
    with pytest.raises(FrictionOcpError) as caught:
        load_problem(path)
    messages = [str(finding) for finding in caught.value.findings]
    text = expected.replace("{folder}", str(workshop.folder))
    assert len([message for message in messages if text in message]) == 1, "\n".join(messages)
    assert all(message.startswith(f"{path}: ") for message in messages)


def channel(name: str, change: Callable[[Any], Any], **attributes: str) -> Callable[[Any], None]:
    """Return an edit of a recorded channel (or of the time)."""

    def spoil(file: Any) -> None:
        path = f"/channels/{name}" if name != "time" else "/time"
        before, unit = file[path][()], file[path].attrs["unit"]
        del file[path]
        file[path] = change(before)
        file[path].attrs.update({"unit": unit, **attributes})

    return spoil


def speed_in_degrees(file: Any) -> None:
    """Add the speed in degrees per second, said to be in rad/s."""
    file["/channels/second"] = np.degrees(np.gradient(file["/channels/position"][()], file["/time"][()]))
    file["/channels/second"].attrs["unit"] = "rad/s"


def interrupted(file: Any) -> None:
    """Leave the samples from 2.0 s to 2.8 s out of everything."""
    for name in ("position", "current", "time"):
        channel(name, lambda y: np.delete(y, slice(1000, 1400)))(file)


def with_holes(values: Any) -> Any:
    """Return values of which two stretches are missing."""
    values[500:700] = values[2000:2100] = np.nan
    return values


def backwards(time: Any) -> Any:
    return np.where(np.arange(time.size) == 100, time[98], time)


RECORDING_FAULTS: dict[str, tuple[Callable[[Any], None], str]] = {
    "unknown unit": (channel("position", lambda y: y, unit="furlong"), "channel 'position': unknown unit 'furlong'"),
    "wrong unit": (
        channel("position", lambda y: y, unit="A"),
        "channel 'position' is in A, but load.theta is in rad; a unit that converts to rad",
    ),
    "shaft that moves in a line": (
        channel("position", lambda y: y, unit="m"),
        "a unit that converts to rad; state `motion: linear` at shaft 'load' if that is how it moves, or correct the",
    ),
    "no unit": (channel("position", lambda y: y, unit=""), "channel 'position' has no unit"),
    "time backwards": (channel("time", backwards), "time is not increasing at sample 100 (0.1960 s after 0.1980 s)"),
    "all NaN": (channel("position", lambda y: y * np.nan), "channel 'position' has no value: all 3000 samples are NaN"),
    "counter that starts over": (
        channel("position", lambda y: 1e-5 * (np.round(y / 1e-5) % 65536)),
        "channel 'position' jumps 16 times by 0.65536 rad, 65536 steps of its resolution, within one sample, first at ",
    ),
    "angle that starts over": (
        channel("position", lambda y: np.arctan2(np.sin(9 * y), np.cos(9 * y))),
        "by one turn, 6.28319 rad, within one sample, first at ",
    ),
    "clipped output": (
        channel("position", lambda y: np.clip(y, 0.8 * y.min(), 0.8 * y.max())),
        "channel 'position' is clipped: it stays at its extremes of ",
    ),
    "clipped input": (
        channel("current", lambda y: np.clip(y, -0.3, 0.3)),
        "channel 'current' is clipped: it stays at its extremes of -0.3 A or 0.3 A; record it with a wider range",
    ),
    "opposite sign": (
        channel("current", lambda y: -y),
        "channel 'current' and the motion of shaft 'load' have opposite signs; a positive torque accelerates",
    ),
    "still input": (
        channel("current", lambda y: 0 * y + 0.2),
        "channels.current: input 'current' never moves: it is 0.2 A throughout all training recordings",
    ),
    "missing channel": (
        lambda file: file.move("/channels/position", "/channels/positon"),
        "the recording has no channel 'position'; it has current, positon; did you mean 'positon'?",
    ),
}


@pytest.mark.parametrize("name", RECORDING_FAULTS)
def test_fault_of_a_recording_is_found(workshop: Workshop, name: str) -> None:
    """A fault of a recording is found by loading or by checking, once, at the recording's place in the file."""
    spoil, expected = RECORDING_FAULTS[name]
    workshop.recording(spoil=spoil)
    messages = workshop.messages(workshop.problem())
    assert len([message for message in messages if expected in message]) == 1, "\n".join(messages)
    place = "channels.current" if name == "still input" else f"recordings.train[0]: {workshop.folder}/sweep.h5"
    assert f"problem.yaml: {place}: " in messages[0]


def test_a_counter_that_starts_over_is_not_told_as_a_wrong_sign(workshop: Workshop) -> None:
    """What is wrong with a motion of jumps is the jumps, whatever the work seems to be."""
    workshop.recording(spoil=channel("position", lambda y: (np.round((y + 0.5) * 65536) % 65536) / 65536))
    messages = workshop.messages(workshop.problem())
    assert ["it starts over like a counter" in text for text in messages] == [True]


def test_a_sign_is_wrong_in_all_recordings_or_not_at_all(workshop: Workshop) -> None:
    """One recording against another is odd, and no reason to refuse the problem: its sign is that of the channel."""
    workshop.recording("turned.h5", RECORDING_FAULTS["opposite sign"][0])
    workshop.recording()
    path = workshop.problem(put("recordings/train", ["sweep.h5", "turned.h5"]))
    found = [item for item in check(load_problem(path)) if "opposite signs" in item.what]
    assert [item.severity for item in found] == ["warning"]
    assert "recordings.train[1]" in found[0].where and found[0].allowed == "they agree in other recordings"


def test_a_fault_of_the_drive_is_not_told_again_beside_a_recording(workshop: Workshop) -> None:
    """Beside a recording stands only what its own settings make impossible."""
    entries = [{"file": "sweep.h5", "set": {"load.friction.tau_s": 0.2}}]
    path = workshop.problem(several(put(f"{SHAFT}/inertia", -1), put("recordings/train", entries)))
    assert len([message for message in workshop.messages(path) if "an inertia is positive" in message]) == 1


def test_file_that_is_not_hdf5_is_refused(workshop: Workshop) -> None:
    """A recording that is no HDF5 file is refused at its place, with the command that makes one."""
    (workshop.folder / "sweep.h5").write_text("time,current\n0,1\n")
    (message,) = workshop.messages(workshop.problem())
    assert "recordings.train[0]: " in message and "this is not an HDF5 file" in message and "import" in message


LATE: dict[str, tuple[Callable[[Content], None], str, str]] = {
    "output": (
        put("channels/position/delay", 100.0),
        "channels.position.delay: delay = 100 s leaves 0 s of 6",
        "error",
    ),
    "input": (put("channels/current/delay", -7.0), "channels.current.delay: delay = -7 s leaves 0 s of 6 s", "error"),
    "guess": (
        put("channels/position/delay", {"guess": 20, "min": 0, "max": 90}),
        "channels.position.delay: delay = 20 s leaves 0 s of 6 s in which both 'position' and 'current' are recorded",
        "error",
    ),
    "motor": (put("drive/motor/dead_time", 50.0), "drive.motor.dead_time: dead_time = 50 s leaves 0 s of 6", "error"),
    "most of it": (put("channels/position/delay", 5), "delay = 5 s leaves 0.998 s of 6 s", "warning"),
    "clock": (
        several(put("channels/position/clock", "logger"), put("clocks", {"logger": {"offset": 1000}})),
        "clocks.logger.offset: ",
        "error",
    ),
}


@pytest.mark.parametrize("name", LATE)
def test_a_delay_longer_than_the_recordings_is_told(workshop: Workshop, name: str) -> None:
    """Nothing could be compared: milliseconds taken for seconds, or a wrong sign."""
    spoil, expected, severity = LATE[name]
    findings = check(load_problem(workshop.problem(spoil)))
    assert [item.severity for item in findings if expected in str(item)] == [severity]


def test_a_delay_of_a_clock_that_counts_from_elsewhere_is_sound(workshop: Workshop) -> None:
    """What counts is what is left once delays and clocks are taken back."""
    other = np.arange(3000) * 0.002 + 1000.0

    def stamp(file: Any) -> None:
        file["clocks/logger"] = other
        file["clocks/logger"].attrs["unit"] = "s"
        file["channels/position"].attrs["clock"] = "/clocks/logger"

    workshop.recording(spoil=stamp)
    spoil = several(put("channels/position/clock", "logger"), put("clocks", {"logger": {"offset": 1000}}))
    assert "s of " not in " ".join(workshop.messages(workshop.problem(spoil)))


def test_a_motion_of_a_few_samples_is_told_at_its_recording(workshop: Workshop) -> None:
    """The check says so, not a smoothing in the midst of a fit."""

    def most_are_missing(file: Any) -> None:
        file["channels/position"][4:] = np.nan

    workshop.recording(spoil=most_are_missing)
    expected = "recordings.train[0]: {}: no output has more than 4 samples; at least 5; record or import more of it"
    assert any(
        expected.format(workshop.folder / "sweep.h5") in message for message in workshop.messages(workshop.problem())
    )


REQUESTS: dict[str, tuple[Callable[[Content], None], str]] = {
    "effect that does not exist": (
        put("diagnosis", {"effects": ["stribek"]}),
        "diagnosis.effects: unknown effect 'stribek'; available: friction, stribeck, ",
    ),
    "effect with a slip": (put("diagnosis", {"exclude": ["coging"]}), "did you mean 'cogging'?"),
    "effect at a place as design has it": (
        put("diagnosis", {"effects": ["stribeck@load"]}),
        "unknown effect 'stribeck@load'; available: ",
    ),
    "remedy": (put("diagnosis", {"effects": ["stribeck@load"]}), "; write 'stribeck at load'"),
    "place without the effect": (
        put("diagnosis", {"exclude": ["backlash at load"]}),
        "diagnosis.exclude: backlash makes no sense at 'load' of this drive; an effect that this drive can have",
    ),
    "significance": (put("diagnosis", {"significance": 5}), "diagnosis.significance: this is 5; a number between"),
    "effort": (put("diagnosis", {"effort": "much"}), "diagnosis.effort: this is 'much'; a number above 0"),
    "negative limit": (put("limits", {"speed": -1}), "limits.speed: this is -1; a positive number in SI units"),
    "limit in words": (put("limits", {"travel": "2 rad"}), "limits.travel: this is '2 rad'; a positive number in SI"),
    "infinite limit": (put("limits", {"torque": float("inf")}), "limits.torque: this is inf; a positive number"),
    "limit that is no number": (put("limits", {"torque": True}), "limits.torque: this is True; a positive number"),
}
"""What the file asks of `diagnose` and `design`."""


@pytest.mark.parametrize("name", REQUESTS)
def test_what_would_be_refused_later_is_told_by_the_check(workshop: Workshop, name: str) -> None:
    """A request that cannot be met is an error before any fit, and no fault for commands that do not ask for it."""
    spoil, expected = REQUESTS[name]
    path = workshop.problem(spoil)
    found = [item for item in check(load_problem(path)) if expected in str(item)]
    assert [item.severity for item in found] == ["error"]
    assert expected not in " ".join(map(str, check_before_fit(load_problem(path))))


def test_nothing_to_fit_is_an_error_of_the_check(workshop: Workshop) -> None:
    """A problem of known numbers can be loaded and simulated, but the check says that there is nothing to fit."""
    path = workshop.problem(several(put(f"{SHAFT}/inertia", 1), put(FRICTION, {"law": "coulomb", "tau_c": 1})))
    assert load_problem(path)
    assert any("nothing to fit" in message for message in workshop.messages(path))


WARNINGS: dict[str, tuple[Callable[[Content], None], str]] = {
    "no reversal": (put("channels/position/offset", 0.0), "'load' never reverses in training: Coulomb friction cannot"),
    "ripple of more than all": (
        put(f"{FRICTION}/ripple", {"cosine": 1, "sine": {"guess": 0.5}, "period": 1}),
        "drive.shafts[0].friction.ripple: the ripple, 1.12 of the friction, is more than all of it; at most 1",
    ),
    "break never reached": (
        put(FRICTION, {"law": "polyline", "tau_c": 0.1, "slopes": [1, 2], "breaks": [{"guess": 900}]}),
        "drive.shafts[0].friction.breaks[0]: break 900 rad/s is above the greatest speed in training",
    ),
    "Stribeck speed never seen": (
        put(f"{FRICTION}/omega_s", {"guess": 1e-6, "min": 0}),
        "drive.shafts[0].friction.omega_s: 'load' moves below 2 times the Stribeck speed of 1e-06 rad/s in 0 training",
    ),
    "presliding between two samples": (
        put(FRICTION, {**LUGRE, "sigma0": {"guess": 1e7}}),
        "drive.shafts[0].friction.sigma0: 'load' is within 2e-07 rad after a reversal in 0 training samples; at least",
    ),
    "less than a period": (
        put("drive/motor/cogging", {"cosine": {"guess": 0.01}, "sine": {"guess": 0.01}, "period": 100}),
        "'load' travels 1.75 rad in training; more than a period, 100 rad; record more travel",
    ),
    "scale that nothing fixes": (
        put("drive/motor/torque_constant", {"guess": 0.5, "min": 0.1, "max": 2}),
        "load.friction.viscous / motor.torque_constant, but not ",
    ),
    "gravity over a small angle": (
        put(f"{SHAFT}/gravity", {"torque": {"guess": 1}, "phase": {"guess": 0}}),
        "torque and phase of gravity cannot be told apart",
    ),
    "LuGre that gives energy back": (
        put(FRICTION, {**LUGRE, "sigma1": 1, "sigma2": 0.4}),
        "sigma2 = 0.4 is not above sigma1 (tau_s - tau_c)/tau_c = 0.5",
    ),
    "torque constant that no inertia takes": (
        put("drive/motor/torque_constant", 800.0),
        "drive.motor.torque_constant: with torque_constant = 800 N m/A 'current' does 2370 J of work in training, and",
    ),
    "torque constant in micro": (
        put("drive/motor/torque_constant", 5e-7),
        "and the inertia at its guess gains 0.131 J in the recorded motion; the same within a factor of 100; correct",
    ),
    "output that never moves": (
        put("channels/position/offset", 0.0),
        "channels.position: output 'position' never moves: it is 2 rad throughout all training recordings; record",
    ),
    "no motor": (
        several(drop("drive/motor"), drop("channels/current")),
        "there is no motor, and no input prescribes the motion of a shaft",
    ),
    "noise in another unit": (
        put("channels/position/noise_std", 0.05),
        "channels.position.noise_std: stated noise 0.05 rad, but the samples scatter by ",
    ),
    "noise beside the resolution": (
        several(put("channels/position/resolution", 0.0005), drop("channels/position/noise_std")),
        "the samples scatter by 0.00096 rad, more than the 0.00014 rad of their resolution; resolution / sqrt(12)",
    ),
    "resolution in another unit": (
        put("channels/position/resolution", 0.05),
        "channels.position.resolution: stated resolution 0.05 rad, but the samples are on steps of 0.001 rad",
    ),
    "two sensors of one shaft in different units": (
        put("channels/second", {"measures": "load.omega"}),
        "channels.second: 'second' moves 57.3 times as far as 'position', not 1 times as one shaft has it",
    ),
    "time in milliseconds": (
        put("channels/current/hold", "zero"),
        "sweep.h5: a sample every 2 s; time in s; correct the time axis if it is in ms",
    ),
    "interruption": (
        put("channels/current/noise_std", 1e-3),
        "no samples of 'current', 'position' from 1.9980 s to 2.8000 s, 0.802 s where 0.002 s is usual; inputs",
    ),
    "missing samples": (
        put("channels/current/hold", "zero"),
        "no samples of 'position' from 0.9980 s to 1.4000 s, 0.402 s where 0.002 s is usual (the longest of 2 gaps); "
        "nothing is compared there",
    ),
    "repeated measurement": (
        put("channels/current/hold", "zero"),
        "'position' repeats every value 5 times: a new one comes every 0.01 s, not every 0.002 s; the repeats count as",
    ),
    "repeated command": (
        put("channels/current/noise_std", 1e-3),
        "state `hold: zero` if it is a command that the drive holds, else import it again with `held: 10` in its map",
    ),
    "validated on the training data": (
        put("recordings/validation", ["sweep.h5"]),
        "this file also stands in recordings.tr",
    ),
}


DOUBTFUL: dict[str, Callable[[Any], None]] = {
    "no reversal": channel("position", lambda y: 3.0 * np.arange(y.size) * 0.002 + 0.1 * y),
    "output that never moves": channel("position", lambda y: 0.0 * y + 2.0),
    "gravity over a small angle": channel("position", lambda y: 0.1 * y / np.ptp(y)),
    "noise in another unit": channel("position", lambda y: y + 1e-3 * np.random.default_rng(0).normal(size=y.size)),
    "noise beside the resolution": channel(
        "position", lambda y: y + 1e-3 * np.random.default_rng(0).normal(size=y.size)
    ),
    "resolution in another unit": channel("position", lambda y: 1e-3 * np.round(y / 1e-3)),
    "two sensors of one shaft in different units": speed_in_degrees,
    "time in milliseconds": channel("time", lambda t: 1e3 * t),
    "interruption": interrupted,
    "missing samples": channel("position", with_holes),
    "repeated measurement": channel("position", lambda y: np.repeat(y[::5], 5)),
    "repeated command": channel("current", lambda y: np.repeat(y[::10], 10)),
}
"""Recordings that go with the doubtful problems."""


@pytest.mark.parametrize("name", WARNINGS)
def test_doubtful_problem_is_a_warning(workshop: Workshop, name: str) -> None:
    """What is doubtful is said, as a warning, and does not stop anyone."""
    spoil, expected = WARNINGS[name]
    workshop.recording(spoil=DOUBTFUL.get(name, lambda file: None))
    path = workshop.problem(spoil)
    load_problem(path)
    messages = [message for message in workshop.messages(path) if expected in message]
    assert len(messages) == 1


def test_a_motor_that_coasts_does_no_work_and_is_not_doubted(workshop: Workshop) -> None:
    """What a shaft loses it had before: only what it gains must have come from the motor."""

    def coast(file: Any) -> None:
        time = file["time"][:]
        file["channels/position"][...] = 20.0 * (1.0 - np.exp(-time / 2.0))
        file["channels/current"][...] = 1e-9 * np.sin(time)

    workshop.recording(spoil=coast)
    assert "of work" not in " ".join(workshop.messages(workshop.problem()))


def test_all_findings_come_at_once(workshop: Workshop) -> None:
    """Faults of keys, laws, numbers, bounds, files and data are all told in one run, and nothing is written."""
    workshop.recording("clipped.h5", RECORDING_FAULTS["clipped output"][0])
    workshop.recording("backwards.h5", RECORDING_FAULTS["time backwards"][0])
    path = workshop.problem(
        several(
            put(f"{SHAFT}/colour", "red"),
            put(
                "drive/shafts",
                [
                    {"name": "load", "inertia": "heavy", "colour": "red", "friction": {"law": "lugree"}},
                    {"name": "arm", "inertia": {"guess": 2, "min": 3, "max": 1}},
                    {
                        "name": "tip",
                        "inertia": 1,
                        "friction": {"law": "stribeck", "tau_c": 2, "tau_s": 1, "omega_s": 1},
                    },
                ],
            ),
            put("drive/transmissions", [{"stiffness": {"guess": 5, "min": 6}}, {"stiffness": "rigid"}]),
            put("estimation", {"solver": "newton"}),
            put("recordings/train", ["sweep.h5", "gone.h5", "clipped.h5", "backwards.h5"]),
        )
    )
    before = sorted(workshop.folder.iterdir())
    expected = [
        "drive.shafts[0].colour: unknown key",
        "drive.shafts[0].inertia: this is 'heavy'",
        "drive.shafts[0].friction.law: unknown friction law 'lugree'",
        "drive.shafts[1].inertia: min = 3 kg m^2 is above max = 1 kg m^2",
        "drive.shafts[2].friction: tau_s = 1 N m is below tau_c = 2 N m",
        "drive.transmissions[0].stiffness: guess = 5 N m/rad is outside",
        "estimation.solver: unknown value 'newton'",
        "recordings.train[1]: ",
        "recordings.train[2]: ",
        "recordings.train[3]: ",
    ]
    messages = workshop.messages(path)
    assert len(messages) == len(expected), "\n".join(messages)
    for text in expected:
        assert len([message for message in messages if f"{path}: {text}" in message]) == 1, text
    assert sorted(workshop.folder.iterdir()) == before


TEXTS = {
    "tab": ("a:\n\t- 1\n", "this is not YAML: line 2, column 1"),
    "twice": ("title: a\nchannels: {x: 1, x: 2}\ntitle: b\n", "line 3: key 'title' stands here again, first in line 1"),
    "tag": ("title: !!int x\n", "a value is not what its tag says, or no possible date; leave tags out"),
    "date": ("title: 2026-13-01x\nlimits: !!timestamp 2026-13-01\n", "a value is not what its tag says"),
    "python": ("format: !!python/name:os.system\n", "this is not YAML: line 1"),
    "list": ("- 1\n", "this is not a problem file"),
    "bomb": (
        "a: &a [x,x,x,x,x,x,x,x,x]\n"
        + "".join(f"{chr(98 + k)}: &{chr(98 + k)} [{','.join(['*' + chr(97 + k)] * 9)}]\n" for k in range(8)),
        "its aliases stand for ",
    ),
    "self": ("a: &a [*a]\n", "an alias contains itself"),
    "deep": ("a: " + "[" * 3000, "this is nested too deeply"),
    "latin": ("a: \xe9\n".encode("latin-1"), "the file cannot be read as text"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_text_that_is_no_problem_is_refused(tmp_path: Path, name: str) -> None:
    """YAML that is broken, repeats keys, runs code or explodes is refused with its line."""
    text, expected = TEXTS[name]
    path = tmp_path / "problem.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(FrictionOcpError, match=re.escape(expected)):
        load_problem(path)


def test_missing_problem_file_is_refused(tmp_path: Path) -> None:
    """A path without a file is said to be one."""
    with pytest.raises(FrictionOcpError, match=r"there is no such file; correct the path"):
        load_problem(tmp_path / "none.yaml")
