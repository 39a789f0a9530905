"""A problem under examination: its numbers at the guesses, its places in the file, its measured motion."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from friction_ocp.drive.live_terms import live_terms
from friction_ocp.drive.parts import Channel, Drive, Transmission
from friction_ocp.drive.topology import Topology, topology
from friction_ocp.drive.units import unit_of
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.expressions import resolve_ties
from friction_ocp.parameters import Leaf, Tie, leaves, start_of
from friction_ocp.recording.conditioning import FEWEST_SAMPLES, smooth_motion
from friction_ocp.recording.counters import Turnover
from friction_ocp.recording.doubts import starts_over
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
    settings: Mapping[str, float] = field(default_factory=dict[str, float])
    """Numbers by path that hold in place of those of the drive: what is `set` beside a recording."""

    @cached_property
    def drive(self) -> Drive:
        """The drive as read, but so that it can be looked at further whatever its parts are called.

        A shaft whose name is taken gets another; a part on a shaft that does not exist is put on the first one.
        """
        drive = self.problem.drive
        names: list[str] = []
        for shaft in drive.shafts:
            names.append(shaft.name if shaft.name not in names else f"{shaft.name}#{len(names)}")

        def known(name: str) -> str:
            return name if name in names else names[0]

        transmissions = tuple(
            replace(item, from_shaft=known(item.from_shaft), to_shaft=known(item.to_shaft))
            for item in drive.transmissions
        )
        return replace(
            drive,
            shafts=tuple(replace(shaft, name=name) for shaft, name in zip(drive.shafts, names, strict=True)),
            transmissions=transmissions,
            motors=tuple(replace(motor, shaft=known(motor.shaft)) for motor in drive.motors),
        )

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
        values = {path: self.settings.get(path, leaf.value) for path, leaf in self.leaves.items()}
        table = {path: _start(value) for path, value in values.items() if not isinstance(value, Tie)}
        ties = {path: value.expr for path, value in values.items() if isinstance(value, Tie)}
        try:
            return resolve_ties(ties, table)
        except FrictionOcpError:
            return table | dict.fromkeys(ties, np.nan)

    @cached_property
    def bound(self) -> Drive:
        """The drive with plain numbers; a ratio of zero, by which nothing can be divided, is NaN."""
        return self._with_numbers(self.drive)

    @cached_property
    def live(self) -> Drive:
        """The same without the terms that are plainly zero, not only at their guesses."""
        return self._with_numbers(live_terms(self.drive))

    def _with_numbers(self, drive: Drive) -> Drive:
        zero = {path: np.nan for path, number in self.numbers.items() if path.endswith(".ratio") and number == 0}
        return bind_drive(drive, {**self.numbers, **zero})

    @cached_property
    def topology(self) -> Topology:
        """Which shafts move together."""
        return self._joined(self.bound.transmissions)

    def unit(self, path: str) -> str:
        """Return the SI unit of a number; "1" for the offset of a channel that measures nothing known."""
        try:
            return unit_of(self.leaves[path], self.drive)
        except FrictionOcpError:
            return "1"

    def written(self, path: str) -> str:
        """Return a number with its name and unit: tau_c = 0.45 N m."""
        key = path.rpartition(".friction.")[2] if ".friction." in path else path.partition(".")[2]
        return f"{key} = {quantity_text(self.numbers[path], self.unit(path))}"

    def place(self, path: str) -> str:
        """Return where in the file the number with this path stands."""
        return self._places.get(path, path)

    @cached_property
    def _places(self) -> Mapping[str, str]:
        drive = self.drive
        parts: list[tuple[Any, str, str]] = [
            *((item, item.name, f"drive.shafts[{k}]") for k, item in enumerate(drive.shafts)),
            *((item, item.name, f"drive.transmissions[{k}]") for k, item in enumerate(drive.transmissions)),
            *((item, item.name, self.place_of_motor(k)) for k, item in enumerate(drive.motors)),
            *((item, item.name, f"channels.{item.name}") for item in drive.channels),
        ]
        if drive.controller is not None:
            parts.append((drive.controller, "controller", "controller"))
        return {
            leaf.path: place + re.sub(r"\.(\d+)(?=\.|$)", r"[\1]", leaf.path.removeprefix(name))
            for part, name, place in parts
            for leaf in leaves(part, name)
        }

    def place_of_motor(self, index: int) -> str:
        """Return where in the file a motor stands; a single one is taken to be `drive.motor`."""
        return "drive.motor" if len(self.drive.motors) == 1 else f"drive.motors[{index}]"

    def uses(self) -> Iterator[tuple[str, RecordingUse]]:
        """Yield every recording, training first, and where it stands in the file."""
        for kind, uses in (("train", self.problem.train), ("validation", self.problem.validation)):
            for k, use in enumerate(uses):
                yield use.place or f"recordings.{kind}[{k}]", use

    def static_uses(self) -> Iterator[tuple[str, StaticUse]]:
        """Yield all static points, those that are fitted first, and where they stand in the file."""
        for kind, uses in (("train", self.problem.static), ("validation", self.problem.static_validation)):
            for k, use in enumerate(uses):
                yield use.place or f"recordings.{kind}[{k}]", use

    @property
    def has_points_alone(self) -> bool:
        """Whether nothing is simulated: static points are fitted, and there is no recording."""
        return bool(self.problem.static) and not self.problem.recordings

    def at_recording(self, place: str, use: RecordingUse) -> str:
        """Return file, place and recording, as findings name them."""
        return self.at(f"{place}: {use.recording.path or use.name}")

    def recorded(self) -> Iterator[tuple[str, Channel, RecordedChannel]]:
        """Yield every channel of the problem in every recording that has it, and where that stands."""
        for place, use in self.uses():
            for channel in self.drive.channels:
                if channel.name in use.recording.channels:
                    yield self.at_recording(place, use), channel, use.recording.channels[channel.name]

    def motion(self, shaft: str, use: RecordingUse, rigidly: bool = False) -> Motion | None:
        """Return the motion of a shaft from a channel that sees it, over springs as if they were rigid.

        `rigidly` leaves the springs out. None where no channel sees the shaft.
        """
        joined = self.topology if rigidly else self._without_springs
        for signal in ("omega", "theta"):
            for channel in self.drive.channels:
                same = channel.signal == signal and joined.group_of.get(channel.part) == joined.group_of[shaft]
                seen = self.seen_by(channel, use) if same else None
                if seen is not None:
                    return seen.through(float(joined.speed_ratio[shaft] / joined.speed_ratio[channel.part]))
        return None

    def ratio(self, first: str, second: str) -> float | None:
        """Return the speed of a shaft over that of another, springs as if rigid; None where they are apart."""
        joined = self._without_springs
        if first not in joined.group_of or joined.group_of[first] != joined.group_of.get(second):
            return None
        found = float(joined.speed_ratio[first] / joined.speed_ratio[second])
        return found if np.isfinite(found) and found != 0.0 else None

    @cached_property
    def _without_springs(self) -> Topology:
        return self._joined(
            tuple(replace(item, stiffness=None, kinematic_error=None) for item in self.bound.transmissions)
        )

    def _joined(self, transmissions: tuple[Transmission, ...]) -> Topology:
        """Return the topology under these transmissions, of single shafts where they form a loop."""
        try:
            return topology(replace(self.bound, transmissions=transmissions))
        except FrictionOcpError:
            return topology(replace(self.bound, transmissions=()))

    def seen_by(self, channel: Channel, use: RecordingUse) -> Motion | None:
        """Return the motion that a channel shows at the guesses of its gain and offset."""
        key = (channel.name, id(use))
        if key not in self._motions:
            self._motions[key] = self._undo(channel, use)
        return self._motions[key]

    def turnover(self, recorded: RecordedChannel) -> Turnover | None:
        """Return the turn that recorded samples lose time and again, if they do."""
        if id(recorded) not in self._turnovers:
            self._turnovers[id(recorded)] = starts_over(recorded)
        return self._turnovers[id(recorded)]

    @cached_property
    def _turnovers(self) -> dict[int, Turnover | None]:
        return {}

    @cached_property
    def _motions(self) -> dict[tuple[str, int], Motion | None]:
        return {}

    def _undo(self, channel: Channel, use: RecordingUse) -> Motion | None:
        recorded = use.recording.channels.get(channel.name)
        gain, offset = (self.numbers[f"{channel.name}.{key}"] for key in ("gain", "offset"))
        if recorded is None or not _is_usable(recorded) or not abs(gain) > 0:
            return None
        if channel.signal == "theta" and self.turnover(recorded):  # jumps are no motion, and told by a rule
            return None
        with np.errstate(all="ignore"):  # absurd values come out as not finite
            value, slope, _ = smooth_motion(recorded.time, (recorded.values - offset) / gain)
        if not np.all(np.isfinite(slope)):
            return None
        return Motion(recorded.time, value, slope) if channel.signal == "theta" else Motion(recorded.time, None, value)


def _is_usable(recorded: RecordedChannel) -> bool:
    if recorded.time.shape != recorded.values.shape or not np.all(np.diff(recorded.time) > 0):
        return False
    return bool(np.count_nonzero(np.isfinite(recorded.values)) >= FEWEST_SAMPLES)


def quantity_text(value: float, unit: str) -> str:
    """Return a number with its unit; the unit of a plain number is left out."""
    return f"{value:.6g}" if unit == "1" else f"{value:.6g} {unit}"


def _start(value: Any) -> float:
    return float(start_of(value))


Rule = Callable[[Case], Iterator[Finding]]
