"""Loops whose feedback is noisy: the noise moves the machine, and no simulated loop follows that.

Where the command of the controller is recorded, it is what drives the model, in the files that a diagnosis leaves, too;
the controller has nothing to explain then.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from friction_ocp.drive.control import noise_gain
from friction_ocp.drive.parts import Channel, Controller
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.estimation.noise import noise_floor
from friction_ocp.estimation.parameter_space import parameter_space
from friction_ocp.estimation.problem import Problem
from friction_ocp.recording.conditioning import high_frequency_noise
from friction_ocp.recording.recording import Channel as Recorded

QUIETER = 0.5
"""Noise of a recorded command, over what the loop would make of the noise that is logged of its feedback, below which
the loop sees finer than what is logged."""


def driven_as_recorded(problem: Problem) -> Problem | None:
    """Return the problem with its recorded commands as inputs and without its controller.

    None where the feedback has no stated noise, or more of it than the recorded command shows, since a loop may see
    finer than what is logged; where the command of a motor is not recorded; or where recordings or constraints have a
    say in the controller.
    """
    drive = problem.drive
    controller = drive.controller
    if controller is None or _said_of_controller(problem):
        return None
    feedback = next(item for item in drive.channels if item.name == controller.feedback)
    shown = {item.part: item for item in drive.outputs if item.signal == controller.output}
    if not feedback.noise_std or not {motor.name for motor in drive.motors} <= shown.keys():
        return None
    if all(_sees_finer(problem, controller, feedback, item) for item in shown.values()):
        return None
    hold = "linear" if controller.sample_time is None else "zero"
    driving = {item.name: replace(item, role="input", hold=hold) for item in shown.values()}
    channels = tuple(driving.get(item.name, item) for item in drive.channels if item.part != "reference")
    return replace(problem, drive=replace(drive, controller=None, channels=channels))


def _sees_finer(problem: Problem, controller: Controller, feedback: Channel, shown: Channel) -> bool:
    """Whether a recorded command is too quiet for a loop that acts on the noise of its feedback as logged."""
    if controller.type == "duty" or feedback.noise_std is None or not problem.recordings:
        return False
    signals = _signals(problem, shown)
    step = float(np.median([np.median(np.diff(item.time)) for item in _signals(problem, feedback)]))
    at_guess = bind_drive(problem.drive, _guesses(problem))
    assert at_guess.controller is not None
    gain = next(item.gain for item in at_guess.channels if item.name == shown.name)
    made = noise_gain(at_guess.controller, feedback.signal == "omega", step) * feedback.noise_std * abs(float(gain))
    floor = noise_floor(shown, [(item.time, item.values) for item in signals]).std
    levels = [high_frequency_noise(item.time, item.values) for item in signals]
    known = [level for level in levels if np.isfinite(level)]
    return bool(known) and float(np.median(known)) < QUIETER * math.hypot(floor, made)


def _signals(problem: Problem, channel: Channel) -> list[Recorded]:
    return [use.recording.channels[channel.name] for use in problem.recordings]


def _guesses(problem: Problem) -> dict[str, float]:
    names = [leaf.path for leaf in drive_leaves(problem.drive)]
    space = parameter_space(problem, names)
    return space.numbers_by_path(space.guess, problem.recordings[0].name)


def opened(stated: Problem, driven: Problem) -> list[str]:
    """Return a sentence for a loop that is stated and takes no part."""
    controller = stated.drive.controller
    if controller is None or not _is_opened(stated, driven):
        return []
    names = [item.name for item in stated.drive.outputs if item.signal == controller.output]
    what = f"the loop acts on the noise of {controller.feedback}, which no simulation repeats"
    return [f"{' and '.join(names)}: as recorded, in the place of the controller's command: {what}"]


def _said_of_controller(problem: Problem) -> bool:
    said = [*problem.constraints, *(path for use in (*problem.recordings, *problem.static) for path in use.set)]
    return any("controller." in text for text in said)


def _is_opened(stated: Problem, driven: Problem) -> bool:
    return stated.drive.controller is not None and driven.drive.controller is None
