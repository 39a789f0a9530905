"""What repeats over an angle or over time: one cosine and one sine with a common period."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from friction_ocp.friction.smoothing import cos, sin, sinc
from friction_ocp.parameters import Value, is_off


@dataclass(frozen=True)
class Wave:
    r"""Numbers of :math:`c \cos(2 \pi x / P) + s \sin(2 \pi x / P)`; who uses it says what x is.

    A subclass declares the three fields with their units.
    """

    cosine: Value
    sine: Value
    period: Value

    @property
    def idle(self) -> bool:
        """Whether both amplitudes are plainly zero, so that the wave is none."""
        return is_off(self.cosine) and is_off(self.sine)

    def value(self, at: Any, passed: Any = None) -> Any:
        """Return the wave at x; its mean from x - passed / 2 to x + passed / 2 where that is given.

        A wave that is passed within less than a step is so averaged instead of sampled.
        """
        rate = 2.0 * math.pi / self.period
        phase = rate * at
        value = self.cosine * cos(phase) + self.sine * sin(phase)
        return value if passed is None else value * sinc(0.5 * rate * passed)

    def slope(self, at: Any, passed: Any = None) -> Any:
        """Return the derivative of the wave by x, or its mean as in `value`."""
        rate = 2.0 * math.pi / self.period
        phase = rate * at
        value = rate * (self.sine * cos(phase) - self.cosine * sin(phase))
        return value if passed is None else value * sinc(0.5 * rate * passed)

    def bend(self, at: Any, passed: Any = None) -> Any:
        """Return the second derivative of the wave by x, or its mean as in `value`."""
        return -((2.0 * math.pi / self.period) ** 2) * self.value(at, passed)
