"""Whether the work of a motor is what the stated drive takes: orders of magnitude are a unit, or a wrong constant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from friction_ocp.drive.parts import Channel, Motor, Shaft
from friction_ocp.errors import Finding
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.friction.law import Direction
from friction_ocp.problem_file.rules.case import Case, Motion, Rule, quantity_text
from friction_ocp.recording.recording import FloatArray

_ORDERS = 100.0
"""Factor by which work and what takes it differ that no rough guess explains."""
_SIDES: tuple[Direction, ...] = ("positive", "negative")


@dataclass(frozen=True)
class _Budget:
    """Energy in a recording, J: what a motor gives or takes back, and where it goes at the guesses."""

    work: float
    taken: float
    """By inertia, friction, gravity and constant torques; noise of the motion makes it too large."""
    gained: float
    """By which the kinetic energy rises at once: the motor brought that, where nothing else drives."""


def work_is_what_the_drive_takes(case: Case) -> Iterator[Finding]:
    """The work of a measured current or torque is that of moving the stated inertia against the stated friction."""
    if len(case.drive.motors) != 1:
        return
    motor = case.drive.motors[0]
    for channel in case.drive.channels:
        if channel.part != motor.name or channel.signal not in ("current", "torque"):
            continue
        budgets = [item for use in case.problem.train if (item := _budget(case, motor, channel, use)) is not None]
        work, taken, gained = (sum(getattr(item, key) for item in budgets) for key in ("work", "taken", "gained"))
        path = f"{motor.name}.torque_constant" if channel.signal == "current" else f"{channel.name}.gain"
        says = f"with {case.written(path)} '{channel.name}' does {_joule(work)} of work in training"
        where = case.at(case.place(path))
        allowed, remedy = f"the same within a factor of {_ORDERS:g}", "correct it, or the unit of what disagrees"
        if taken > 0.0 and work > _ORDERS * taken:
            what = f"{says}, and the drive at its guesses takes {_joule(taken)} for the recorded motion"
            yield Finding(where, what, allowed, remedy, "warning")
        elif gained > _ORDERS * work and not _driven_otherwise(case):
            what = f"{says}, and the inertia at its guess gains {_joule(gained)} in the recorded motion"
            yield Finding(where, what, allowed, remedy, "warning")


def _budget(case: Case, motor: Motor, channel: Channel, use: RecordingUse) -> _Budget | None:
    """Return the energies of one recording; None where motion or effort are not seen, or absurd."""
    motion, recorded = case.motion(motor.shaft, use), use.recording.channels.get(channel.name)
    gain, offset = (case.numbers[f"{channel.name}.{key}"] for key in ("gain", "offset"))
    if motion is None or recorded is None or recorded.values.shape != recorded.time.shape or not gain:
        return None
    present = np.isfinite(recorded.values)
    constant = case.numbers[f"{motor.name}.torque_constant"] if channel.signal == "current" else 1.0
    shafts = [(shaft, case.motion(shaft.name, use)) for shaft in case.bound.shafts]
    if not present.any() or any(seen is None for _, seen in shafts):
        return None
    with np.errstate(all="ignore"):  # absurd values come out as not finite
        effort = constant * (recorded.values - offset) / gain
        torque = np.interp(motion.time, recorded.time[present], effort[present])
        parts = [_taken(shaft, seen) for shaft, seen in shafts if seen is not None]
        found = _Budget(_energy(motion, torque), sum(taken for taken, _ in parts), sum(gained for _, gained in parts))
    return found if np.isfinite([found.work, found.taken, found.gained]).all() else None


def _taken(shaft: Shaft, motion: Motion) -> tuple[float, float]:
    """Return what moving a shaft takes, J, and the largest rise of its kinetic energy."""
    speed = np.abs(motion.omega)
    torque = np.abs(shaft.inertia * np.gradient(motion.omega, motion.time))
    torque += np.max([np.broadcast_to(shaft.friction.magnitude(side, speed, 0.0), speed.shape) for side in _SIDES], 0)
    torque += abs(shaft.gravity.torque) if shaft.gravity is not None else 0.0
    torque += abs(shaft.external_torque.constant) if shaft.external_torque is not None else 0.0
    kinetic = 0.5 * shaft.inertia * motion.omega**2
    return _energy(motion, torque), float(np.max(kinetic - np.minimum.accumulate(kinetic)))


def _energy(motion: Motion, torque: FloatArray) -> float:
    return float(np.sum(np.abs(torque * motion.omega) * np.gradient(motion.time)))


def _driven_otherwise(case: Case) -> bool:
    """Whether something beside the motor can bring a shaft up to speed."""
    forces = ("gravity", "external_torque", "disturbance")
    outside = any(getattr(shaft, key) is not None for shaft in case.drive.shafts for key in forces)
    return outside or bool(case.drive.prescribed)


def _joule(energy: float) -> str:
    return quantity_text(float(f"{energy:.3g}"), "J")


WORK: tuple[Rule, ...] = (work_is_what_the_drive_takes,)
