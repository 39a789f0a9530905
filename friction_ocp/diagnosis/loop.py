"""Loops whose feedback is noisy: the noise moves the machine, and no simulated loop follows that.

Where the command of the controller is recorded, it is what drives the model while candidates compete; the controller
has nothing to explain then.
"""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.estimation.problem import Problem


def driven_as_recorded(problem: Problem) -> Problem | None:
    """Return the problem with its recorded commands as inputs and without its controller.

    None where the feedback has no stated noise, since a loop may see finer than what is logged of it, or where the
    command of a motor is not recorded.
    """
    drive = problem.drive
    controller = drive.controller
    if controller is None:
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


def in_its_loop(drive: Drive, stated: Problem, driven: Problem) -> Drive:
    """Return a drive with the controller, and the roles of channels, that were stated, where its loop was opened."""
    if not _is_opened(stated, driven):
        return drive
    known = {item.name: item for item in drive.channels}
    channels = tuple(_as_stated(known.get(item.name, item), item) for item in stated.drive.channels)
    return replace(drive, controller=stated.drive.controller, channels=channels)


def _is_opened(stated: Problem, driven: Problem) -> bool:
    return stated.drive.controller is not None and driven.drive.controller is None


def _as_stated(channel: Channel, stated: Channel) -> Channel:
    return replace(channel, role=stated.role, hold=stated.hold)
