"""What real drives have beyond friction, springs and free play, as plain values in SI units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from math import pi

Amplitudes = float | tuple[float, ...]
"""One amplitude, or those of the harmonics 1, 2, ..."""


@dataclass(frozen=True)
class PlantRipple:
    """sum over k of cosine[k] cos(2 pi k x / period) + sine[k] sin(2 pi k x / period), over an angle or the time.

    And the waves of another period `beside` it.
    """

    period: float
    cosine: Amplitudes = 0.0
    sine: Amplitudes = 0.0
    beside: PlantRipple | None = None

    def rows(self) -> Iterator[tuple[float, float, float]]:
        """Yield cosine, sine and wave number of every harmonic."""
        cosines, sines = (v if isinstance(v, tuple) else (v,) for v in (self.cosine, self.sine))
        for k, (cosine, sine) in enumerate(zip_longest(cosines, sines, fillvalue=0.0), start=1):
            yield cosine, sine, 2.0 * pi * k / self.period
        if self.beside is not None:
            yield from self.beside.rows()


@dataclass(frozen=True)
class PlantWarmUp:
    """Friction changes by the factors 1 + dry W (Coulomb, Stribeck) and 1 + viscous W with the warmth W.

    W follows W' = (source - W) / time_constant from the initial `<shaft>.warmth`, 0 unless stated; the source is 1, or
    the power lost in friction over `power` where that is stated, W.
    """

    time_constant: float
    dry: float = 0.0
    viscous: float = 0.0
    power: float = 0.0


@dataclass(frozen=True)
class PlantEndStop:
    """A bumper at each end of a range: spring and damper that push only."""

    low: float
    high: float
    stiffness: float
    damping: float = 0.0


@dataclass(frozen=True)
class PlantFrictionMemory:
    """Dry friction is larger while the speed rises than while it falls: factor 1 + share tanh(sgn(omega) a / scale).

    a is the acceleration behind a first-order filter.
    """

    share: float
    scale: float
    time_constant: float = 0.01


@dataclass(frozen=True)
class PlantSaturation:
    """The torque per ampere falls with the current: `current` is where the straight line would reach the limit.

    tanh: I tanh(i / I); algebraic: i / (1 + |i / I|^n)^(1/n) with n = `sharpness`; cubic: i - i^3 / (3 I^2), held at
    its top, 2 I / 3.
    """

    current: float
    form: str = "tanh"
    sharpness: float = 2.0


@dataclass(frozen=True)
class PlantLoop:
    """Rate-independent loops beside a spring: each element (torque, twist) is a spring that slips at `torque`.

    Sharp elements are Jenkins elements (an Iwan model); smooth ones follow z' = (1 - sgn(rate) z) rate / twist, the
    Bouc-Wen model with exponent 1.
    """

    elements: tuple[tuple[float, float], ...]
    smooth: bool = False


@dataclass(frozen=True)
class PlantAmplifier:
    """What stands between command and current: pure delay, then a rate limit, then a first-order lag.

    Iron loses torque to its history: the torque is that of i - hysteresis_share z, z being the current since the last
    reversal, limited to +-hysteresis_width.
    """

    delay: float = 0.0
    rate_limit: float = float("inf")
    time_constant: float = 0.0
    hysteresis_share: float = 0.0
    hysteresis_width: float = 0.0
