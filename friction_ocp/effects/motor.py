"""Effects in how a motor makes its torque."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar

import numpy as np

from friction_ocp.drive.parts import SHARPNESS, Drive, Motor
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Trial, change_motor, motor_of, upwards
from friction_ocp.parameters import Free, is_off

SHORT = 0.01
"""Lag over the time between samples with which a fit begins in which dead time does all."""


def _motors(drive: Drive) -> list[Motor]:
    return [motor for motor in drive.motors if any(shaft.name == motor.shaft for shaft in drive.shafts)]


def _shows_dead_time(drive: Drive) -> bool:
    """Whether a command that is acted on late is more than a late sensor: it makes several late by the same time."""
    known = drive.recorded_late is None
    return known and any(is_off(motor.dead_time) for motor in drive.delaying) and len(drive.outputs) > 1


def _step(clues: Clues) -> float:
    """Return the usual time between samples, s."""
    return float(np.median(np.diff(clues.tracks[0].time)))


def _shows_current(drive: Drive, motor: Motor) -> bool:
    """Whether a channel shows what a controller drives a motor by: what it commands, or what comes of that."""
    loop = drive.controller
    return loop is not None and any(item.part == motor.name and item.signal == loop.output for item in drive.outputs)


class DriveLagEffect(AbstractEffect):
    """The torque follows the command late."""

    name: ClassVar[str] = "drive_lag"
    sentence: ClassVar[str] = "the torque follows the command late"
    resembles: ClassVar[tuple[str, ...]] = ("sensor_delay",)

    def places(self, drive: Drive) -> Iterable[str]:
        return [motor.shaft for motor in _motors(drive) if is_off(motor.lag)]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        motor = motor_of(drive, place)
        assert motor is not None
        step, path = _step(clues), f"{motor.name}.lag"
        times = [step, 5.0 * step, 25.0 * step]
        lag = Free(times[0], 1e-3 * step, 1e3 * step)
        if _shows_current(drive, motor):
            hidden = f"{motor.name}.lag_hidden"
            added = change_motor(drive, motor.name, lag=lag, lag_hidden=Free(0.5, 0.0, 1.0))
            trials = tuple(Trial(({path: one}, {path: one, hidden: 1.0})) for one in times)
            return Augmentation(added, {path: 0.0, hidden: 0.0}, trials)
        if not _shows_dead_time(drive):
            added = change_motor(drive, motor.name, lag=lag)
            return Augmentation(added, {path: 0.0}, tuple(Trial(({path: one},)) for one in times))
        dead = f"{motor.name}.dead_time"
        added = change_motor(drive, motor.name, lag=lag, dead_time=Free(0.1 * step, 0.0, 100.0 * step))
        trials = tuple(Trial(({path: one}, {dead: step})) for one in times)

        def all_dead(values: Mapping[str, float]) -> dict[str, float]:
            return {path: SHORT * step, dead: values[path] + values[dead]}

        return Augmentation(added, {path: 0.0, dead: 0.0}, trials, otherwise=all_dead)

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive whose motor begins to follow after a dead time, where a loop or other motors feel it."""
        motor = motor_of(drive, place)
        if motor is None or is_off(motor.lag) or not is_off(motor.dead_time) or motor in drive.delaying:
            return None
        step, path = _step(clues), f"{motor.name}.dead_time"
        added = change_motor(drive, motor.name, dead_time=Free(0.1 * step, 0.0, 100.0 * step))
        return Augmentation(added, {path: 0.0}, tuple(Trial(({path: one},)) for one in (step, 5.0 * step)))


class TorqueSaturationEffect(AbstractEffect):
    """Torque per ampere falls with current."""

    name: ClassVar[str] = "torque_saturation"
    sentence: ClassVar[str] = "torque per ampere falls with current"

    def places(self, drive: Drive) -> Iterable[str]:
        return [motor.shaft for motor in _motors(drive) if is_off(motor.saturation)]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        motor = motor_of(drive, place)
        assert motor is not None
        largest = max(float(np.max(np.abs(track.torque[motor.name]))) for track in clues.tracks)
        current = max(largest, 1e-12) / max(abs(clues.numbers.get(f"{motor.name}.torque_constant", 1.0)), 1e-300)
        size, path = 0.2 / current**2, f"{motor.name}.saturation"
        added = change_motor(drive, motor.name, saturation=upwards(size))
        return Augmentation(added, {path: 0.0}, (Trial(({path: size},)),))

    def reshaped(self, drive: Drive, place: str, clues: Clues) -> Augmentation | None:
        """Return the drive whose torque ceases to rise more suddenly, or less, and levels off at another height."""
        motor = motor_of(drive, place)
        if motor is None or is_off(motor.saturation) or motor.saturation_tail is not None:
            return None
        if motor.saturation_sharpness != SHARPNESS:
            return None
        free = {"saturation_sharpness": Free(SHARPNESS, 1.0, 20.0), "saturation_tail": Free(SHARPNESS, -1.0, 20.0)}
        if drive.driving_signal(motor) == "voltage" and motor.saturation_in_emf == 1.0:
            free["saturation_in_emf"] = Free(1.0, 0.0, 1.0)
        off = {f"{motor.name}.{name}": part.guess for name, part in free.items()}
        steps = tuple({path: 0.9 * value} for path, value in off.items())
        return Augmentation(change_motor(drive, motor.name, **free), off, (Trial(steps),))
