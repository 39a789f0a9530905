"""A place in a plant where something is to be hidden, and what an effect is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from plant import Plant, PlantRipple, PlantShaft, PlantTransmission

from blind.machines import Machine
from blind.recording import Hidden, log_encoders
from blind.scales import Scales

Rng = np.random.Generator


@dataclass(frozen=True)
class Site:
    """A place in a machine where something is to be hidden."""

    machine: Machine
    scales: Scales
    hidden: Hidden
    component: str
    size: float
    """0 is nothing, 1 is grave."""

    @property
    def plant(self) -> Plant:
        """The plant so far."""
        return self.hidden.plant

    @property
    def shaft(self) -> PlantShaft:
        """The shaft of that name."""
        return next(item for item in self.plant.shafts if item.name == self.component)

    @property
    def joint(self) -> PlantTransmission:
        """The transmission of that name."""
        return next(item for item in self.plant.transmissions if item.name == self.component)

    def with_shaft(self, **changes: Any) -> Hidden:
        """Return the plant with changes to the shaft."""
        shafts = tuple(replace(s, **changes) if s.name == self.component else s for s in self.plant.shafts)
        return replace(self.hidden, plant=replace(self.plant, shafts=shafts))

    def with_friction(self, **changes: Any) -> Hidden:
        """Return the plant with changes to the friction of the shaft."""
        return self.with_shaft(friction=replace(self.shaft.friction, **changes))

    def with_joint(self, **changes: Any) -> Hidden:
        """Return the plant with changes to the transmission."""
        joints = tuple(replace(t, **changes) if t.name == self.component else t for t in self.plant.transmissions)
        return replace(self.hidden, plant=replace(self.plant, transmissions=joints))

    def with_motor(self, **changes: Any) -> Hidden:
        """Return the plant with changes to its motor."""
        return replace(self.hidden, plant=replace(self.plant, motors=(replace(self.plant.motors[0], **changes),)))

    def with_sensor(self, **changes: Any) -> Hidden:
        """Return the plant with changes to the sensor of the channel and to the loop's view of the same instrument."""
        measures = self.machine.document["channels"][self.component]["measures"]
        return replace(self.hidden, plant=log_encoders(self.plant, measures, **changes))


Inject = Callable[[Site, Rng], Hidden]


def sign(rng: Rng) -> float:
    return float(rng.choice((-1.0, 1.0)))


def harmonics(amplitude: float, period: float, rng: Rng) -> PlantRipple:
    """Return a ripple whose fundamental has this amplitude, with two weak harmonics."""
    size = amplitude * np.array([1.0, 0.2 * rng.uniform(), 0.1 * rng.uniform()])
    phase = rng.uniform(0.0, 2 * np.pi, 3)
    return PlantRipple(period, tuple(map(float, size * np.cos(phase))), tuple(map(float, size * np.sin(phase))))


@dataclass(frozen=True)
class Effect:
    """An effect with its places."""

    name: str
    inject: Inject
    places: Callable[[Machine], Iterator[str]]
