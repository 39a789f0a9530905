"""Effects in the measurement, not in the machine."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.drive.units import DRIVE_TORQUE
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues, Trial, change_channel, channel, either_way
from friction_ocp.parameters import Free

_ANALOG = ("theta", "omega", "alpha", "current", "current_command", "torque", "voltage", DRIVE_TORQUE)


def _analog(drive: Drive) -> list[Channel]:
    """Return the channels that measure a part of the drive; a reference is what it is."""
    return [item for item in drive.channels if item.signal in _ANALOG and item.part != "reference"]


def _known(value: object) -> bool:
    return isinstance(value, (int, float))


def _size(item: Channel, clues: Clues) -> float:
    """Return the typical size of what a channel records."""
    return max(_true_size(item, clues) * abs(clues.numbers.get(f"{item.name}.gain", 1.0)), 1e-12)


def _true_size(item: Channel, clues: Clues) -> float:
    """Return the typical size of what a channel shows, on the machine."""
    if item.signal in ("theta", "omega"):
        table = clues.angles(item.part) if item.signal == "theta" else clues.speeds(item.part)
        return float(np.std(table))
    if item.signal == DRIVE_TORQUE:
        return clues.typical_torque[item.part]
    torques = [track.torque[item.part] for track in clues.tracks if item.part in track.torque]
    if torques:
        constant = clues.numbers.get(f"{item.part}.torque_constant", 1.0)
        factor = 1.0 if item.signal == "torque" else 1.0 / max(abs(constant), 1e-300)
        return float(np.std(np.concatenate(torques))) * factor
    return 1.0


class SensorOffsetEffect(AbstractEffect):
    """The channel records a constant too much."""

    name: ClassVar[str] = "sensor_offset"
    sentence: ClassVar[str] = "the channel has an offset"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in _analog(drive) if item.offset == 0.0]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        size, path = 0.02 * _size(channel(drive, place), clues), f"{place}.offset"
        added = change_channel(drive, place, offset=either_way(size))
        return Augmentation(added, {path: 0.0}, (Trial(({path: size},)),))


PLAUSIBLE = 1.5
"""Factor by which a scale may be wrong: a larger one is a wrong unit, which every simulation shows at once."""


class SensorGainEffect(AbstractEffect):
    """The channel records a multiple of what it should."""

    name: ClassVar[str] = "sensor_gain"
    sentence: ClassVar[str] = "the channel has a wrong scale"

    def places(self, drive: Drive) -> Iterable[str]:
        return [item.name for item in _analog(drive) if _known(item.gain)]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        gain, path = float(channel(drive, place).gain), f"{place}.gain"
        low, high = sorted((gain / PLAUSIBLE, gain * PLAUSIBLE))
        added = change_channel(drive, place, gain=Free(gain, low, high))
        return Augmentation(added, {path: gain}, (Trial(({path: 1.02 * gain},)),), inside=(path,))


class SensorDelayEffect(AbstractEffect):
    """The channel is late."""

    name: ClassVar[str] = "sensor_delay"
    sentence: ClassVar[str] = "the channel is late"
    resembles: ClassVar[tuple[str, ...]] = ("drive_lag",)

    def places(self, drive: Drive) -> Iterable[str]:
        """Return the outputs, and the input that alone moves the machine."""
        return [item.name for item in (*drive.outputs, drive.acted_on) if item in _analog(drive) and item.delay == 0.0]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        """Return the drive with a late channel; none shows the future where a late input can make outputs early."""
        step, path = float(np.median(np.diff(clues.tracks[0].time))), f"{place}.delay"
        earliest = 0.0 if drive.acted_on is not None else -20.0 * step
        latest, late = 100.0 * step, clues.late.get(place, 0.0)
        added = change_channel(drive, place, delay=Free(step, earliest, latest))
        large = ({path: late},) if late and earliest < late < latest else ()
        return Augmentation(added, {path: 0.0}, (Trial(({path: step},)),), outright=large)
