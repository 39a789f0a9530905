"""What repeats over an angle or over time: cosine and sine of a period, of its overtones and of another period."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from friction_ocp.friction.smoothing import cos, sin, sinc
from friction_ocp.parameters import Value, is_off, quantity

GAUSS = math.sqrt(0.6)
"""Outer points of Gauss' rule of three on -1 to 1."""


@dataclass(frozen=True)
class Wave:
    r"""Numbers of :math:`\sum_k c_k \cos(2 \pi k (x - o) / P) + s_k \sin(2 \pi k (x - o) / P)`.

    Who uses it says what x is. A subclass says what its numbers are and in which units; overtones that are None are
    none, and so is the wave of another period, as the slots of a motor have beside its magnets, or the teeth of a gear
    beside its turn. The origin o is zero where that is None; the wave of another period has that of the first unless it
    has its own.
    """

    cosine: Value
    sine: Value
    period: Value
    second_cosine: Value = None
    second_sine: Value = None
    third_cosine: Value = None
    third_sine: Value = None
    other_cosine: Value = None
    other_sine: Value = None
    other_period: Value = None
    origin: Value = None
    other_origin: Value = None

    def __init_subclass__(cls, *, kind: str, of: str, over: str, period: str) -> None:
        """Declare the numbers of a wave: `kind` names the unit of the parts of what it is a wave `of`.

        `over` names that of its period; `period` says of what that is one.
        """
        parts = ("cosine", "sine")
        numbers = {part: quantity(kind, f"{part} part of {of}") for part in parts}
        numbers["period"] = quantity(over, f"period of {period}", nested="guess")
        for order in ("second", "third"):
            meaning = {part: f"{part} part of the {order} order of {of}" for part in parts}
            numbers |= {f"{order}_{part}": quantity(kind, meaning[part], None) for part in parts}
        numbers |= {f"other_{part}": quantity(kind, f"{part} part of a further wave of {of}", None) for part in parts}
        numbers["other_period"] = quantity(over, f"period of the further wave of {of}", None, nested="guess")
        numbers["origin"] = quantity(over, f"where {of} is counted from", None)
        numbers["other_origin"] = quantity(over, f"where the further wave of {of} is counted from", None)
        cls.__annotations__ = dict.fromkeys(numbers, Value)
        for name, number in numbers.items():
            setattr(cls, name, number)

    @property
    def idle(self) -> bool:
        """Whether all amplitudes are plainly zero, so that the wave is none."""
        return all(is_off(part) for _, _, _, *parts in self._terms() for part in parts)

    @property
    def has_overtones(self) -> bool:
        """Whether it has a second or third order."""
        orders = (self.second_cosine, self.second_sine, self.third_cosine, self.third_sine)
        return any(part is not None for part in orders)

    @property
    def has_other(self) -> bool:
        """Whether it has a wave of another period."""
        return self.other_cosine is not None or self.other_sine is not None

    def _terms(self) -> list[tuple[int, Any, Any, Any, Any]]:
        """Return order, period of the first order, origin, cosine part and sine part of what there is."""
        other = self.origin if self.other_origin is None else self.other_origin
        further = [
            (2, self.period, self.origin, self.second_cosine, self.second_sine),
            (3, self.period, self.origin, self.third_cosine, self.third_sine),
            (1, self.other_period, other, self.other_cosine, self.other_sine),
        ]
        found: list[tuple[int, Any, Any, Any, Any]] = [(1, self.period, self.origin, self.cosine, self.sine)]
        for order, period, origin, *parts in further:
            if any(part is not None for part in parts):
                cosine, sine = (0.0 if part is None else part for part in parts)
                found.append((order, period, origin, cosine, sine))
        return found

    def value(self, at: Any, passed: Any = None) -> Any:
        """Return the wave at x; its mean from x - passed / 2 to x + passed / 2 where that is given.

        A wave that is passed within less than a step is so averaged instead of sampled.
        """
        return self._sum(at, passed, 0)

    def variance(self, at: Any, passed: Any) -> Any:
        """Return the mean square of the wave about its mean, both over what is passed about x (Gauss, three points).

        For what goes with the square of a wave that is passed within a step.
        """
        places = ((-GAUSS, 5.0 / 18.0), (0.0, 8.0 / 18.0), (GAUSS, 5.0 / 18.0))
        values = [(self.value(at + 0.5 * place * passed), weight) for place, weight in places]
        mean = sum(weight * value for value, weight in values)
        return sum(weight * (value - mean) ** 2 for value, weight in values)

    def slope(self, at: Any, passed: Any = None) -> Any:
        """Return the derivative of the wave by x, or its mean as in `value`."""
        return self._sum(at, passed, 1)

    def bend(self, at: Any, passed: Any = None) -> Any:
        """Return the second derivative of the wave by x, or its mean as in `value`."""
        return self._sum(at, passed, 2)

    def _sum(self, at: Any, passed: Any, derivatives: int) -> Any:
        """Return the sum of all orders, derived once or twice by x: each time cosine and sine change places."""
        total: Any = None
        for order, period, origin, cosine, sine in self._terms():
            rate, place = 2.0 * math.pi * order / period, at if origin is None else at - origin
            for _ in range(derivatives):
                cosine, sine = rate * sine, -rate * cosine
            value = cosine * cos(rate * place) + sine * sin(rate * place)
            value = value if passed is None else value * sinc(0.5 * rate * passed)
            total = value if total is None else total + value
        return total
