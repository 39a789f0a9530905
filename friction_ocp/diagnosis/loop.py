"""Loops whose feedback is noisy: the noise moves the machine, and no simulated loop follows that.

Where the command of the controller is recorded, it is what drives the model, in the files that a diagnosis leaves, too;
the controller has nothing to explain then.
"""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.estimation.problem import Problem


def driven_as_recorded(problem: Problem) -> Problem | None:
    """Return the problem with its recorded commands as inputs and without its controller.

    None where the feedback has no stated noise, since a loop may see finer than what is logged of it, where the command
    of a motor is not recorded, or where recordings or constraints have a say in the controller.
    """
    drive = problem.drive
    controller = drive.controller
    if controller is None or _said_of_controller(problem):
        return None
    feedback = next(item for item in drive.channels if item.name == controller.feedback)
    shown = {item.part: item for item in drive.outputs if item.signal == controller.output}
    if not feedback.noise_std or not {motor.name for motor in drive.motors} <= shown.keys():
        return None
    hold = "linear" if controller.sample_time is None else "zero"
    driving = {item.name: replace(item, role="input", hold=hold) for item in shown.values()}
    channels = tuple(driving.get(item.name, item) for item in drive.channels if item.part != "reference")
    return replace(problem, drive=replace(drive, controller=None, channels=channels))


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
