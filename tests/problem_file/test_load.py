"""Sound problem files become problems: the example of the interface, every way to write a number, the shipped files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.drive.parts import Clock
from friction_ocp.drive.values import drive_leaves
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.static import Polyline
from friction_ocp.parameters import Free, Tie
from friction_ocp.problem_file.check import check
from friction_ocp.problem_file.dump import dump_problem
from friction_ocp.problem_file.load import load_problem
from friction_ocp.problem_file.write import write_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "problems" / "xl330").glob("*.yaml"))

EXAMPLE = """\
# An example.
#
#   Known: the structure.

format: friction-ocp-problem/1
title: Azimuth axis of a radio telescope, polyline friction on the fast side
drive:
  motor: {torque_constant: 0.35}                 # N m/A; one motor on the first shaft
  shafts:                                        # motor side first
    - name: motor
      inertia: 0.002                             # a number is known and fixed
      friction: {law: polyline, tau_c: {guess: 0.1, min: 0, max: 1},     # a mapping is fitted
                 slopes: [{guess: 0.004}, {guess: 0.0004}], breaks: [{guess: 100, min: 10, max: 250}]}
    - name: load
      inertia: 58355.5                           # half of the structure: one of two identical chains
      gravity: {torque: 0.0, phase: 0.0}         # -torque sin(theta + phase)
      friction: {law: coulomb_viscous, tau_c: {guess: 500, min: 0}, viscous: {guess: 6.0e4, min: 0}}
  transmissions:
    - {ratio: 15050, stiffness: {guess: 8.97e7, prior_std: 5.0e6}, damping: {guess: 1e5, min: 0}}
channels:
  current:           {measures: motor.current, role: input}
  motor_position:    {measures: motor.theta, noise_std: 2.0e-4}
  load_acceleration: {measures: load.alpha, gain: {guess: 1, min: 0.1, max: 10}, noise_std: 0.004}
recordings:                                      # paths relative to this file
  train: [staircase.h5, {file: stop.h5, set: {motor.torque_constant: 0.36}}]
  validation: [reversals.h5]
estimation: {solver: gauss_newton, fit: simulation, starts: 1, seed: 0}
"""


def write_telescope_recordings(folder: Path) -> None:
    time = np.arange(0.0, 10.0, 0.01)
    theta = 200.0 * np.sin(time)
    columns = {"current": (0.3 * np.cos(time), "A"), "motor_position": (theta, "rad")}
    columns["load_acceleration"] = (-theta / 15050, "rad/s^2")
    channels = {name: Channel(name, time, values, unit) for name, (values, unit) in columns.items()}
    for name in ("staircase", "stop", "reversals"):
        write_recording(Recording(name, channels), folder / f"{name}.h5")


def test_example_of_the_interface_is_read(tmp_path: Path) -> None:
    """The example of the interface becomes the drive that it describes, without a finding."""
    write_telescope_recordings(tmp_path)
    path = tmp_path / "telescope.yaml"
    path.write_text(EXAMPLE, encoding="utf-8")
    problem = load_problem(path)
    values = {leaf.path: leaf.value for leaf in drive_leaves(problem.drive)}
    assert isinstance(problem.drive.shafts[0].friction.law, Polyline)
    assert values["motor.friction.breaks.0"] == Free(100.0, 10.0, 250.0)
    assert values["motor-load.stiffness"] == Free(8.97e7, prior_std=5.0e6)
    assert values["motor-load.damping"] == Free(1e5, min=0.0)
    assert problem.question == "An example.\n\n  Known: the structure."
    assert [use.name for use in problem.recordings] == ["staircase", "stop", "reversals"]
    assert problem.train[1].set == {"motor.torque_constant": 0.36}
    assert problem.estimation.fit == "simulation"
    assert check(problem) == ()


def test_clocks_of_loggers_are_read(workshop: Workshop) -> None:
    """A clock has an offset and a drift, known or fitted, and stamps the channels that name it."""

    def spoil(content: dict[str, Any]) -> None:
        content["channels"]["position"]["clock"] = "logger"
        content["clocks"] = {"logger": {"offset": {"guess": 0.01, "min": -1, "max": 1}}}

    path = workshop.problem(spoil)
    problem = load_problem(path)
    assert problem.drive.clocks == (Clock("logger", Free(0.01, -1.0, 1.0), 0.0),)
    assert problem.drive.clock_of(problem.drive.outputs[0]) == problem.drive.clocks[0]
    assert check(problem) == ()
    again = dump_problem(path, {"clocks.logger.offset": 0.02}, path.parent)
    assert "guess: 0.02" in again
    written = write_problem(path, problem.drive, {"clocks.logger.offset": 0.03}, path.parent)
    assert "clock: logger" in written and "guess: 0.03" in written


def test_torque_noise_is_known_or_estimated(workshop: Workshop) -> None:
    """A level is a number, or found from a guess or without one."""

    def noisy(value: Any) -> tuple[dict[str, float], tuple[str, ...]]:
        def spoil(content: dict[str, Any]) -> None:
            content["estimation"] = {"process_noise": {"load": value}}

        options = load_problem(workshop.problem(spoil)).estimation
        return dict(options.process_noise), options.estimated_noise

    assert noisy(0.1) == ({"load": 0.1}, ())
    assert noisy(0) == ({"load": 0.0}, ())
    assert noisy({"guess": 0.2}) == ({"load": 0.2}, ("load",))
    assert noisy("estimate") == ({}, ("load",))


def test_sound_problem_has_no_finding(workshop: Workshop) -> None:
    """A sound problem with a sound recording is passed without a word."""
    assert workshop.messages(workshop.problem()) == []


def shaft_with(workshop: Workshop, friction: dict[str, Any], inertia: Any = 0.1) -> dict[str, Any]:
    def spoil(content: dict[str, Any]) -> None:
        content["drive"]["shafts"][0] |= {"friction": friction, "inertia": inertia}

    return {leaf.path: leaf.value for leaf in drive_leaves(load_problem(workshop.problem(spoil)).drive)}


def test_number_is_read_in_every_form(workshop: Workshop) -> None:
    """A number may be known, fitted with a prior and a scope, tied, or different by direction."""
    fitted = {"guess": 1, "min": 0, "prior_std": 0.1, "prior_mean": 2, "scope": "recording"}
    friction = {
        "law": "lugre",
        "tau_c": {"positive": 0.1, "negative": {"guess": 0.2}},
        "tau_s": {"expr": "2 * load.inertia"},
        "omega_s": 1,
        "sigma0": 100.0,
    }
    values = shaft_with(workshop, friction, fitted)
    assert values["load.inertia"] == Free(1.0, 0.0, math.inf, 0.1, 2.0, "recording")
    assert values["load.friction.tau_c.positive"] == 0.1
    assert values["load.friction.tau_c.negative"] == Free(0.2)
    assert values["load.friction.tau_s"] == Tie("2 * load.inertia")
    assert values["load.friction.delta"] == LuGre(1, 1, 1, 1).delta


def test_slopes_differ_by_direction(workshop: Workshop) -> None:
    """A list of slopes for each direction becomes a list of directional slopes."""
    friction = {
        "law": "polyline",
        "tau_c": 0.1,
        "slopes": {"positive": [1, 2], "negative": [{"guess": 3}, 4]},
        "breaks": [1],
    }
    values = shaft_with(workshop, friction)
    assert values["load.friction.slopes.0.negative"] == Free(3.0)
    assert values["load.friction.slopes.1.positive"] == 2.0


def test_branches_state_their_ends_and_motors(workshop: Workshop) -> None:
    """Two motors on one gear are joined by transmissions that name their ends."""

    def spoil(content: dict[str, Any]) -> None:
        content["drive"] = {
            "motors": [
                {"name": "left", "shaft": "a", "torque_constant": 0.5, "share": 0.5},
                {"name": "right", "shaft": "b", "torque_constant": 0.5, "share": 0.5},
            ],
            "shafts": [
                {"name": name, "inertia": {"guess": 0.1}, "friction": {"law": "none"}} for name in ("a", "b", "load")
            ],
            "transmissions": [
                {"from": "a", "to": "load", "ratio": 5, "stiffness": "rigid"},
                {"from": "b", "to": "load", "ratio": 5, "stiffness": {"guess": 100}},
                {"from": "a", "to": "b", "stiffness": 10, "backlash": 0.01},
            ],
        }
        content["channels"]["current"]["measures"] = "left.current"
        content["channels"]["torque"] = {"measures": "right.torque", "role": "input"}

    def record(file: Any) -> None:
        file.copy("/channels/current", "/channels/torque")
        file["/channels/torque"].attrs["unit"] = "N m"

    workshop.recording(spoil=record)
    problem = load_problem(workshop.problem(spoil))
    assert [item.name for item in problem.drive.transmissions] == ["a-load", "b-load", "a-b"]
    assert [motor.shaft for motor in problem.drive.motors] == ["a", "b"]
    assert [str(item) for item in check(problem) if item.severity == "error"] == []


@pytest.mark.parametrize("inside", [True, False])
def test_controller_stands_in_the_drive_or_beside_it(workshop: Workshop, inside: bool) -> None:
    """A controller closes the loop wherever the file puts it; a set point is an input without being told so."""

    def spoil(content: dict[str, Any]) -> None:
        controller = {"type": "pd", "feedback": "position", "output": "current", "kp": 5, "saturation": [-1, 1]}
        (content["drive"] if inside else content)["controller"] = controller
        content["channels"]["current"] = {"measures": "reference.theta"}

    workshop.recording(spoil=lambda file: file["/channels/current"].attrs.update({"unit": "rad"}))
    problem = load_problem(workshop.problem(spoil))
    assert problem.drive.controller is not None
    assert problem.drive.controller.saturation == (-1.0, 1.0)
    assert problem.drive.channels[0].role == "input"
    assert check(problem) == ()


def test_further_sections_are_kept(workshop: Workshop) -> None:
    """What diagnosis and design are told is kept as stated."""
    path = workshop.problem(
        lambda content: content.update({"diagnosis": {"exclude": ["backlash"]}, "limits": {"speed": 3}})
    )
    problem = load_problem(path)
    assert (problem.diagnosis, problem.limits) == ({"exclude": ["backlash"]}, {"speed": 3})


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_servo_problems_have_no_finding(path: Path) -> None:
    """The four servo problems are sound, open with their question, and state the firmware's gain of each recording."""
    problem = load_problem(path)
    assert check(problem) == ()
    assert problem.question.startswith("Asked: ")
    assert (len(problem.train), len(problem.validation)) == (8, 4)
    for use in problem.recordings:
        gain = float(use.recording.attributes["kp"]) * (4096 / 2 / math.pi) / (256 * 885)
        assert use.set["controller.kp"] == pytest.approx(gain, rel=1e-8)
        assert f"-kp{float(use.recording.attributes['kp']):.0f}" in use.name


def test_four_servo_problems_are_shipped() -> None:
    """Plain, Stribeck, load-dependent and both."""
    assert [path.stem for path in SHIPPED] == ["coulomb_viscous", "load_dependent", "stribeck", "stribeck_load"]


def test_terms_are_read_under_their_paths(workshop: Workshop) -> None:
    """Every optional term has its keys, and its numbers the paths that results use."""

    def spoil(content: dict[str, Any]) -> None:
        wave = {"cosine": 0.01, "sine": {"guess": 0, "min": -1, "max": 1}, "period": 0.5}
        shaft, motor = content["drive"]["shafts"][0], content["drive"]["motor"]
        shaft["friction"] |= {"ripple": wave, "warm_up": {"amplitude": 0.1, "time_constant": {"guess": 60}}}
        shaft["disturbance"] = motor["cogging"] = motor["torque_ripple"] = wave
        content["channels"]["position"]["eccentricity"] = {"sine": {"expr": "0.1 * motor.cogging.sine"}}

    values = {leaf.path: leaf.value for leaf in drive_leaves(load_problem(workshop.problem(spoil)).drive)}
    for term in ("load.friction.ripple", "load.disturbance", "motor.cogging", "motor.torque_ripple"):
        assert [values[f"{term}.{key}"] for key in ("cosine", "sine", "period")] == [0.01, Free(0.0, -1.0, 1.0), 0.5]
    assert values["load.friction.warm_up.amplitude"] == 0.1
    assert values["load.friction.warm_up.time_constant"] == Free(60.0)
    assert values["position.eccentricity.sine"] == Tie("0.1 * motor.cogging.sine")


def test_terms_of_a_gear_are_read_under_their_paths(workshop: Workshop) -> None:
    """What shapes the twist of a transmission, and what makes a motor late and weak, has its keys and paths."""

    def spoil(content: dict[str, Any]) -> None:
        drive = content["drive"]
        drive["shafts"].append({"name": "arm", "inertia": 0.1})
        joint = {"stiffness": 100, "stiffening": {"guess": 0}, "hysteresis": {"torque": {"guess": 0}, "twist": 0.01}}
        joint["second_stage"] = {"stiffness": {"guess": 0}, "twist": 0.02, "rounding": 0.5}
        joint["kinematic_error"] = {"cosine": 0.001, "sine": 0, "period": 0.5}
        drive["transmissions"] = [joint]
        drive["motor"] |= {"lag": {"guess": 0, "min": 0, "max": 0.1}, "saturation": 0.01}

    problem = load_problem(workshop.problem(spoil))
    values = {leaf.path: leaf.value for leaf in drive_leaves(problem.drive)}
    assert values["load-arm.stiffening"] == values["load-arm.hysteresis.torque"] == Free(0.0)
    assert (values["load-arm.second_stage.stiffness"], values["load-arm.second_stage.rounding"]) == (Free(0.0), 0.5)
    assert (values["load-arm.hysteresis.twist"], values["load-arm.kinematic_error.cosine"]) == (0.01, 0.001)
    assert (values["motor.lag"], values["motor.saturation"]) == (Free(0.0, 0.0, 0.1), 0.01)
    assert [str(item) for item in check(problem) if item.severity == "error"] == []


def test_a_commanded_current_drives_a_motor_whose_current_is_predicted(workshop: Workshop) -> None:
    """With the command as the input and the current as an output nothing is missing from the problem."""

    def spoil(content: dict[str, Any]) -> None:
        content["channels"]["command"] = {"measures": "motor.current_command"}
        content["channels"]["current"]["role"] = "output"
        content["drive"]["motor"]["lag"] = {"guess": 0.0, "min": 0.0, "max": 0.1}

    def record(file: Any) -> None:
        file.copy("/channels/current", "/channels/command")

    workshop.recording(spoil=record)
    problem = load_problem(workshop.problem(spoil))
    assert [channel.name for channel in problem.drive.inputs] == ["command"]
    assert [str(item) for item in check(problem) if item.severity == "error"] == []
