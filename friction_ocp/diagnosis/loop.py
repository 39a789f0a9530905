"""Loops whose feedback is noisy: the noise moves the machine, and no simulated loop follows that.

Where the command of the controller is recorded, it is what drives the model while candidates compete; the controller
has nothing to explain then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from friction_ocp.drive.parts import Channel, Drive, Motor
from friction_ocp.estimation.problem import Problem
from friction_ocp.parameters import start_of


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


def in_its_loop(drive: Drive, values: Mapping[str, float], stated: Problem, driven: Problem) -> Drive:
    """Return a drive with the controller, and the roles of channels, that were stated, where its loop was opened.

    `values` are fitted ones. A motor in a loop has no dead time: a controller that is late by it stands for it, and a
    lag that is longer where the controller knows no instants.
    """
    controller = stated.drive.controller
    if controller is None or not _is_opened(stated, driven):
        return drive
    known = {item.name: item for item in drive.channels}
    channels = tuple(_as_stated(known.get(item.name, item), item) for item in stated.drive.channels)
    dead = max((_found(values, item, "dead_time") for item in drive.motors), default=0.0)
    motors = tuple(replace(item, dead_time=0.0) for item in drive.motors)
    if controller.sample_time is not None:
        controller = replace(controller, delay=controller.delay + dead)
    elif dead > 0:
        motors = tuple(replace(item, lag=_found(values, item, "lag") + dead) for item in motors)
    return replace(drive, controller=controller, channels=channels, motors=motors)


def _found(values: Mapping[str, float], motor: Motor, name: str) -> float:
    """Return a number of a motor as it was fitted, or as it is stated."""
    stated = start_of(getattr(motor, name))
    return values.get(f"{motor.name}.{name}", float(stated) if isinstance(stated, (int, float)) else 0.0)


def _is_opened(stated: Problem, driven: Problem) -> bool:
    return stated.drive.controller is not None and driven.drive.controller is None


def _as_stated(channel: Channel, stated: Channel) -> Channel:
    return replace(channel, role=stated.role, hold=stated.hold)
