"""A problem under examination: its numbers at the guesses, its places in the file, its measured motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from friction_ocp.drive.parts import Channel, Drive, Motor
from friction_ocp.drive.topology import Topology, topology
from friction_ocp.drive.units import unit_of
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.expressions import resolve_ties
from friction_ocp.parameters import Free, Leaf, Tie
from friction_ocp.recording.conditioning import smooth_motion
from friction_ocp.recording.recording import Channel as RecordedChannel
from friction_ocp.recording.recording import FloatArray


@dataclass(frozen=True)
class Motion:
    """Angle (None where only the speed is measured) and speed of a shaft over time, (n,) each."""

    time: FloatArray
    theta: FloatArray | None
    omega: FloatArray

    def through(self, ratio: float) -> Motion:
        """Return the motion of a shaft that turns `ratio` times as fast."""
        return Motion(self.time, None if self.theta is None else self.theta * ratio, self.omega * ratio)


@dataclass(frozen=True)
class Case:
    """A problem and what the rules derive from it, each only once."""

    problem: Problem

    @property
    def drive(self) -> Drive:
        """The drive as read."""
        return self.problem.drive

    def at(self, place: str) -> str:
        """Return file and place, as findings name them."""
        return f"{self.problem.path or self.problem.title or 'problem'}: {place}"

    @cached_property
    def leaves(self) -> Mapping[str, Leaf]:
        """Every number of the drive by its path."""
        return {leaf.path: leaf for leaf in drive_leaves(self.drive)}

    @cached_property
    def numbers(self) -> Mapping[str, float]:
        """Every number of the drive by its path: known, guessed or tied; NaN where it cannot be had."""
        values = {path: leaf.value for path, leaf in self.leaves.items()}
        table = {path: float(_start(value)) for path, value in values.items() if not isinstance(value, Tie)}
        ties = {path: value.expr for path, value in values.items() if isinstance(value, Tie)}
        try:
            return resolve_ties(ties, table)
        except FrictionOcpError:
            return table | dict.fromkeys(ties, np.nan)

    @cached_property
    def bound(self) -> Drive:
        """The drive with plain numbers."""
        return bind_drive(self.drive, self.numbers)

    @cached_property
    def topology(self) -> Topology:
        """Which shafts move together; raises FrictionOcpError where rigid joints form a loop."""
        return topology(self.bound)

    def written(self, path: str) -> str:
        """Return a number with its name and unit: tau_c = 0.45 N m."""
        unit = unit_of(self.leaves[path], self.drive)
        return f"{path.rpartition('.')[2]} = {quantity_text(self.numbers[path], unit)}"

    def place(self, path: str) -> str:
        """Return where in the file the number or part with this path stands."""
        best = max((part for part in self._places if part == path or path.startswith(f"{part}.")), key=len, default="")
        rest = path.removeprefix(best).strip(".").split(".")
        keys = "".join(f"[{key}]" if key.isdigit() else f".{key}" for key in rest if key)
        return f"{self._place_of(best, path)}{keys}" if best else path

    def _place_of(self, part: str, path: str) -> str:
        """A motor may bear the name of its shaft; the keys tell them apart."""
        places = self._places[part]
        key = path.removeprefix(part).strip(".").partition(".")[0]
        of_shaft = key in ("inertia", "friction", "gravity", "external_torque")
        of_channel = key in ("gain", "offset", "delay")
        wanted = "drive.shafts" if of_shaft else "channels" if of_channel else "drive.motor"
        return next((place for place in places if place.startswith(wanted)), places[0])

    @cached_property
    def _places(self) -> Mapping[str, list[str]]:
        places: dict[str, list[str]] = {"controller": ["controller"]}
        named = [
            *((item.name, f"drive.shafts[{k}]") for k, item in enumerate(self.drive.shafts)),
            *((item.name, f"drive.transmissions[{k}]") for k, item in enumerate(self.drive.transmissions)),
            *((item.name, self.place_of_motor(item)) for item in self.drive.motors),
            *((item.name, f"channels.{item.name}") for item in self.drive.channels),
        ]
        for name, place in named:
            places.setdefault(name, []).append(place)
        return places

    def place_of_motor(self, motor: Motor) -> str:
        """Return where in the file a motor stands; a single one is taken to be `drive.motor`."""
        motors = self.drive.motors
        return "drive.motor" if len(motors) == 1 else f"drive.motors[{motors.index(motor)}]"

    def place_of_recording(self, use: RecordingUse) -> str:
        """Return where in the file a recording stands."""
        for kind, uses in (("train", self.problem.train), ("validation", self.problem.validation)):
            for k, other in enumerate(uses):
                if other is use:
                    return f"recordings.{kind}[{use.place if use.place is not None else k}]"
        return "recordings"

    def recorded(self, channel: Channel) -> Iterator[tuple[RecordingUse, RecordedChannel]]:
        """Yield the recordings that hold a channel, training first."""
        for use in self.problem.recordings:
            if channel.name in use.recording.channels:
                yield use, use.recording.channels[channel.name]

    def motion(self, shaft: str, use: RecordingUse) -> Motion | None:
        """Return the motion of a shaft from a channel that sees it rigidly; None where there is none."""
        group_of, speed_ratio = self.topology.group_of, self.topology.speed_ratio
        for signal in ("omega", "theta"):
            for channel in self.drive.channels:
                same = channel.signal == signal and group_of.get(channel.part) == group_of[shaft]
                if same and channel.name in use.recording.channels:
                    seen = self._seen(channel, use)
                    return None if seen is None else seen.through(float(speed_ratio[shaft] / speed_ratio[channel.part]))
        return None
