"""How fast, how far and how hard the parts of a machine move, to size what is hidden in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blind.machines import Machine
from blind.recording import Hidden, run


@dataclass(frozen=True)
class Scales:
    """Typical sizes in a run of the machine without anything hidden, from its truth."""

    machine: Machine
    truth: Mapping[str, np.ndarray]

    def speed(self, shaft: str) -> float:
        """Root mean square of the speed of a shaft, rad/s."""
        return float(np.sqrt(np.mean(self.truth[f"{shaft}.omega"] ** 2)))

    def travel(self, shaft: str) -> float:
        """Range of the angle of a shaft, rad."""
        return float(np.ptp(self.truth[f"{shaft}.theta"]))

    def current(self) -> float:
        """Root mean square of the motor's current, A."""
        return float(np.sqrt(np.mean(self.truth[f"{self.machine.document['drive']['motor']['name']}.current"] ** 2)))

    def torque(self, shaft: str) -> float:
        """Torque of the motor, carried to a shaft through the ratios, N m."""
        return self.current() * self.torque_constant * self.ratio(shaft)

    def friction(self, shaft: str) -> float:
        """Friction of the whole drive as seen at a shaft, N m: what a further friction there is compared with."""
        total = 0.0
        for item in self.machine.plant().shafts:
            felt = self.truth[f"{item.name}.friction"] / self.ratio(item.name)
            total += float(np.sqrt(np.mean(felt**2)))
        return total * self.ratio(shaft)

    def inertia(self, shaft: str) -> float:
        """Inertia of the whole drive as seen at a shaft, kg m^2."""
        total = sum(item.inertia / self.ratio(item.name) ** 2 for item in self.machine.plant().shafts)
        return total * self.ratio(shaft) ** 2

    def twist(self, joint: str) -> float:
        """Root mean square of the twist of an elastic transmission, rad at its output."""
        part = next(part for part in self.machine.plant().transmissions if part.name == joint)
        return float(np.sqrt(np.mean(self.truth[f"{joint}.torque"] ** 2))) / part.stiffness

    def joint_torque(self, joint: str) -> float:
        """Root mean square of the torque in an elastic transmission, N m at its output."""
        return float(np.sqrt(np.mean(self.truth[f"{joint}.torque"] ** 2)))

    @cached_property
    def torque_constant(self) -> float:
        """Torque constant of the motor, N m/A."""
        return self.machine.plant().motors[0].torque_constant

    def ratio(self, shaft: str) -> float:
        """Speed of the first shaft over that of another."""
        ratio, name = 1.0, self.machine.plant().shafts[0].name
        for part in self.machine.plant().transmissions:
            if name == shaft:
                break
            ratio, name = ratio * part.ratio, part.to_shaft
        return ratio


def measure(machine: Machine, kind: str, seed: tuple[int, ...]) -> Scales:
    """Return the scales of a machine in one run."""
    return Scales(machine, run(machine, Hidden(machine.plant()), kind, seed, truth_rate=200.0)[1])
