"""How far what is hidden lies above the noise once the base model has been fitted, to first order.

The response of the plant with the effect less that of the base machine under the same input is projected on what
changes of the fitted numbers can do, priors included; what remains is compared with the noise floor.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from plant import Plant, Trajectory

from blind.document import numbers, truth, with_true
from blind.machines import Machine, plant_of
from blind.recording import Hidden, run, silent

EVERY = 3
"""Samples are thinned to every third."""
CHANGE = 3e-3
"""Relative change of a number for its finite difference."""


@dataclass(frozen=True)
class Excited:
    """A run that the visibility is judged on."""

    kind: str
    seed: tuple[int, ...]


@dataclass(frozen=True)
class View:
    """What the noise of a machine leaves visible in some runs."""

    machine: Machine
    runs: tuple[Excited, ...]

    def ratio(self, hidden: Hidden) -> float:
        """Return the largest noise ratio over the channels after the base model has been fitted."""
        residual = np.concatenate([self.difference(hidden, excited) for excited in self.runs])
        if not np.all(np.isfinite(residual)):
            return float("inf")
        by_channel = self._project(residual).reshape(len(self.runs), -1, len(self.floors))
        return float(np.sqrt(1.0 + np.max(np.mean(by_channel**2, axis=(0, 1)))))

    @cached_property
    def floors(self) -> dict[str, float]:
        """Noise floor by output channel."""
        channels = self.machine.document["channels"].items()
        return {k: v.get("noise_std", v.get("resolution", 0.0) / np.sqrt(12)) for k, v in channels if _output(v)}

    def difference(self, hidden: Hidden, excited: Excited) -> np.ndarray:
        """Return the response less that of the base machine, over the noise floors, (samples x channels,)."""
        seen, truth_ = run(self.machine, replace(hidden, plant=silent(hidden.plant)), excited.kind, excited.seed,
                           truth_rate=1.0 / self.machine.sample_time)  # fmt: skip
        base = self._base(self.machine.plant(), excited, seen, truth_)
        return self._whiten(seen, base)

    def _base(
        self, plant: Plant, excited: Excited, seen: Mapping[str, np.ndarray], truth_: Mapping[str, np.ndarray]
    ) -> Mapping[str, np.ndarray]:
        if self.machine.closed:
            return run(self.machine, Hidden(silent(plant)), excited.kind, excited.seed)[0]
        return _windows(self.machine, silent(plant), seen["current"], truth_)

    def _whiten(self, seen: Mapping[str, np.ndarray], base: Mapping[str, np.ndarray]) -> np.ndarray:
        columns = [(seen[name] - base[name])[::EVERY] / floor for name, floor in self.floors.items()]
        return np.column_stack(columns).ravel()

    @cached_property
    def _slopes(self) -> np.ndarray:
        """Return (samples, numbers): the change of the response with the logarithm of every fitted number."""
        columns = [np.concatenate([self._slope(keys, item) for item in self.runs]) for keys in self._fitted]
        blocks = [np.column_stack(columns)]
        if not self.machine.closed:
            blocks.append(np.kron(np.eye(len(self.runs)), self._starts()))
        return np.column_stack(blocks)

    @cached_property
    def _fitted(self) -> list[tuple[str | int, ...]]:
        return [keys for keys, number in numbers(self.machine.document) if number.spread > 0]

    def _slope(self, keys: tuple[str | int, ...], excited: Excited) -> np.ndarray:
        seen, truth_ = run(self.machine, Hidden(silent(self.machine.plant())), excited.kind, excited.seed,
                           truth_rate=1.0 / self.machine.sample_time)  # fmt: skip
        changed = plant_of(truth(with_true(self.machine.document, keys, 1.0 + CHANGE)), self.machine)
        moved = self._base(changed, excited, seen, truth_)
        still = self._base(self.machine.plant(), excited, seen, truth_)
        return self._whiten(moved, still) / CHANGE

    def _starts(self) -> np.ndarray:
        """Return what the angle and speed at the start of each window do to the responses of one run."""
        count, length = _window_count(self.machine)
        time = self.machine.sample_time * np.arange(self.machine.samples)
        first = np.minimum(np.arange(time.size) // length, count - 1)
        columns = []
        for k in range(count):
            for power in (0, 1):
                moved = {name: np.zeros(time.size) for name in self.floors}
                for name, scale in self._angles.items():
                    moved[name] = np.where(first == k, (time - time[k * length]) ** power, 0.0) * scale
                columns.append(self._whiten(moved, dict.fromkeys(self.floors, 0.0 * time)))
        return np.column_stack(columns)

    @cached_property
    def _angles(self) -> dict[str, float]:
        """Angle of each encoder's shaft over that of the first shaft."""
        ratio, scale = 1.0, {self.machine.plant().shafts[0].name: 1.0}
        for part in self.machine.plant().transmissions:
            ratio *= part.ratio
            scale[part.to_shaft] = 1.0 / ratio
        channels = {name: self.machine.document["channels"][name]["measures"] for name in self.floors}
        return {name: scale[m.partition(".")[0]] for name, m in channels.items() if m.endswith(".theta")}

    def _project(self, residual: np.ndarray) -> np.ndarray:
        priors = [number for _, number in numbers(self.machine.document) if number.spread > 0]
        weight = np.array([1.0 / n.spread if n.stated else 1e-3 for n in priors])
        rows = np.zeros((weight.size, self._slopes.shape[1]))
        rows[:, : weight.size] = np.diag(weight)
        matrix = np.vstack([self._slopes * np.sqrt(EVERY), rows])
        target = np.concatenate([residual * np.sqrt(EVERY), np.zeros(weight.size)])
        answer, *_ = np.linalg.lstsq(matrix, target, rcond=None)
        return residual - self._slopes @ answer


def _output(channel: Mapping[str, object]) -> bool:
    measures = str(channel["measures"])
    return channel.get("role") != "input" and not measures.startswith("reference") and "supply" not in measures


def _window_count(machine: Machine) -> tuple[int, int]:
    count = max(1, round(machine.duration / machine.window))
    return count, machine.samples // count


def _windows(
    machine: Machine, plant: Plant, current: np.ndarray, truth_: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return the responses of a plant under a recorded current, over windows that each start from the true state."""
    motor = replace(plant.motors[0], controller=None)
    free = replace(plant, motors=(motor,), controllers=())
    count, length = _window_count(machine)
    pieces: list[dict[str, np.ndarray]] = []
    for first in [k * length for k in range(count)]:
        last = machine.samples if first == (count - 1) * length else first + length
        start = {f"{s.name}.{what}": float(truth_[f"{s.name}.{what}"][first]) for s in plant.shafts
                 for what in ("theta", "omega")}  # fmt: skip
        time = machine.sample_time * np.arange(last - first)
        inputs = {f"{motor.name}.current": Trajectory(time, current[first:last])}
        done = free.simulate(time[-1], inputs, initial=start, step=machine.step)
        pieces.append({name: values for name, (_, values) in done.channels.items()})
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}


Build = Callable[[float], Hidden]
SMALLEST, START, STEPS, NEAR = 1e-5, 0.05, 8, 0.2
"""Of the search for a size: the bounds are SMALLEST and 1; it ends within NEAR (logarithm of the ratio)."""


def size_for(view: View, build: Build, target: float) -> tuple[float, float]:
    """Return the size at which `build(size)` shows a noise ratio near `target`, and the ratio there.

    Where even size 1 shows less, the answer is that. The ratio is infinite where the plant cannot be simulated.
    """
    low, high, size, ratio = SMALLEST, 1.0, START, 1.0
    for _ in range(STEPS):
        ratio = _ratio(view, build, size)
        if abs(np.log(ratio / target)) < NEAR or (size >= 1.0 and ratio < target):
            break
        low, high = (low, size) if ratio > target else (size, high)
        strength = np.sqrt(max(ratio**2 - 1.0, 1e-4))
        wanted = float(min(1.0, size * np.clip(np.sqrt(target**2 - 1.0) / strength, 0.02, 20.0)))
        size = wanted if low < wanted <= high and wanted != size else float(np.sqrt(low * high))
    return size, ratio


def _ratio(view: View, build: Build, size: float) -> float:
    try:
        return view.ratio(build(size))
    except ValueError:
        return float("inf")
