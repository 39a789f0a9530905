"""Whether a series drifts: the largest of many shapes, against the same series with its nights in random order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from friction_ocp.fleet.scatter import Level, level_of
from friction_ocp.simulation.grid import FloatArray

FEWEST = 6
"""Nights from which a drift is looked for: of fewer there are too few orders to tell one by."""
EXCEEDED = 20
"""Random orders that outdo the series after which there is no need for more."""
SHARPER = 10
"""Random orders over what the smallest level that matters needs at least."""
_AT_ONCE = 2000

Kind = Literal["step", "ramp"]


@dataclass(frozen=True)
class Shape:
    """How a parameter may change: at once, or steadily, from one night on."""

    kind: Kind
    begins: int
    """The last night before the change."""
    column: FloatArray
    """(n,) 0 before, 1 at the last night."""


@dataclass(frozen=True)
class DriftTest:
    """What random orders say, and the shape that fits best."""

    p_value: float
    """Probability that nights in random order show as much of any shape."""
    shape: Shape
    level: Level
    """Level and change, in this order, of the shape."""

    @property
    def change(self) -> float:
        """Value at the last night less that before the change."""
        return float(self.level.coefficients[1])


def shapes_of(time: FloatArray) -> list[Shape]:
    """Return every step with two nights at least on each side, and every ramp over three nights at least."""
    count = time.size
    order = np.arange(count)
    steps = [Shape("step", k, (order > k).astype(float)) for k in range(1, count - 2)]
    ramps = [
        Shape("ramp", k, np.maximum(time - time[k], 0.0) / (time[-1] - time[k]))
        for k in range(count - 2)
        if time[-1] > time[k]
    ]
    return [*steps, *ramps]


def drift_test(
    time: FloatArray, value: FloatArray, std_error: FloatArray, level: float, rng: np.random.Generator
) -> DriftTest:
    """Test a series (n,) in order of time; `level` is the smallest at which the p-value will be judged.

    Where nothing changes, every order of the nights is as likely as any other, each estimate keeping its standard
    error. The largest statistic of all shapes is therefore compared with that of random orders: exact whatever the
    distribution of the estimates, and for many shapes at once. Drawing stops once the answer is plain, which keeps
    the p-value valid. Sources: Fisher 1935; Besag & Clifford 1991; Phipson & Smyth 2010.
    """
    shapes = shapes_of(time)
    columns = np.column_stack([shape.column for shape in shapes])
    # of the whole series, whatever its order: else orders could not be compared
    plain = level_of(np.ones((value.size, 1)), value, std_error)
    variance = std_error**2 + plain.night_scatter**2
    weight = float(np.max(variance)) / variance if np.all(variance > 0) else np.ones_like(variance)
    centred = value - float(weight @ value) / float(np.sum(weight))
    found = _statistics(columns, centred[None], weight[None])[0]
    best = int(np.argmax(found))
    p_value = _chance(columns, centred, weight, float(found[best]), int(np.ceil(SHARPER / level)), rng)
    shape = shapes[best]
    design = np.column_stack([np.ones(value.size), shape.column])
    return DriftTest(p_value, shape, level_of(design, value, std_error))


def _chance(
    columns: FloatArray, value: FloatArray, weight: FloatArray, seen: float, most: int, rng: np.random.Generator
) -> float:
    done = exceeded = 0
    limit = seen * (1.0 - 1e-9)
    while done < most:
        count = min(_AT_ONCE, most - done)
        orders = rng.permuted(np.tile(np.arange(value.size), (count, 1)), axis=1)
        largest = np.max(_statistics(columns, value[orders], weight[orders]), axis=1)
        at = np.flatnonzero(largest >= limit)
        if exceeded + at.size >= EXCEEDED:
            return EXCEEDED / (done + int(at[EXCEEDED - exceeded - 1]) + 1)
        exceeded, done = exceeded + at.size, done + count
    return (exceeded + 1) / (done + 1)


def _statistics(columns: FloatArray, value: FloatArray, weight: FloatArray) -> FloatArray:
    """Return (orders, shapes) squares that each shape takes off the weighted squares about the mean."""
    total = np.sum(weight, axis=1, keepdims=True)
    by_shape, weighted = weight @ columns, weight * value
    pull = weighted @ columns - by_shape * np.sum(weighted, axis=1, keepdims=True) / total
    own = weight @ columns**2 - by_shape**2 / total
    return np.where(own > 1e-12 * total, pull**2 / np.maximum(own, 1e-300), 0.0)
