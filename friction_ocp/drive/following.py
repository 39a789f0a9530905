"""How what drives a motor follows its command: after a dead time, then with a lag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import comb, factorial
from typing import Any

from numpy.polynomial import Polynomial

from friction_ocp.friction.smoothing import TINY, cos, exp, expm1, sin, tanh, where

Complex = tuple[Any, Any]
"""Real and imaginary part, numbers or expressions."""

GONE = 1.0 / 40.0
"""Share of a step below which what follows has settled within it to less than the rounding of doubles."""
ORDER = 3
"""Of the approximation of a dead time: of commands that jump, what is left after it is as large for higher ones."""
EPSILON = 1e-9
"""Imaginary part of a real pole, over its size."""


@dataclass(frozen=True)
class Mode:
    """One pole p of a dead time of 1 s, or two conjugate ones: x' = p (x - command), x being complex for two."""

    pole: Complex
    weight: Complex
    """By which the mode is in what comes of the dead time: the real part of its product with x."""
    is_pair: bool

    @property
    def size(self) -> int:
        """Number of its states: x, or its real part and the sum of both parts, so that all rest at the command."""
        return 2 if self.is_pair else 1

    def read(self, states: Sequence[Any]) -> Complex:
        """Return x, or its mean, change or rate, from the states or theirs."""
        return (states[0], states[1] - states[0]) if self.is_pair else (states[0], 0.0)

    def states(self, x: Complex) -> list[Any]:
        """Return the states of x."""
        return [x[0], x[0] + x[1]] if self.is_pair else [x[0]]

    def left(self, share: Any) -> Complex:
        """Return the factor on what is left of x over a step of which the dead time is a `share`."""
        slow, safe = _unsettled(share)
        passed = 1.0 / safe
        decayed, turned = exp(self.pole[0] * passed), self.pole[1] * passed
        return where(slow, decayed * cos(turned), 0.0), where(slow, decayed * sin(turned), 0.0)

    def ramp(self, share: Any) -> Complex:
        """Return the steps by which x is behind a ramp at the nodes, counted from the middle before."""
        left = self.left(share)
        return _over(left, (1.0 - left[0], -left[1]))


def _unsettled(share: Any) -> tuple[Any, Any]:
    """Return whether what follows is still on its way after a step, and the share, 1 where it is not."""
    slow = share > GONE
    return slow, where(slow, share, 1.0)


def _times(a: Complex, b: Complex) -> Complex:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _over(a: Complex, b: Complex) -> Complex:
    size = b[0] ** 2 + b[1] ** 2 + TINY
    return (a[0] * b[0] + a[1] * b[1]) / size, (a[1] * b[0] - a[0] * b[1]) / size


def _coefficients(degree: int, other: int, sign: float) -> list[float]:
    """Return the coefficients, constant first, of a polynomial of the approximation of exp(sign s) (Pade)."""
    whole = degree + other
    return [sign**k * comb(degree, k) * factorial(whole - k) / factorial(whole) for k in range(degree + 1)]


def _modes() -> tuple[Mode, ...]:
    """Return the modes of the approximation of exp(-s) with one zero less than poles, since that does not jump."""
    zeros, poles = (Polynomial(_coefficients(*each)) for each in ((ORDER - 1, ORDER, -1.0), (ORDER, ORDER - 1, 1.0)))
    found: list[Mode] = []
    for pole in map(complex, poles.roots()):
        is_pair = abs(pole.imag) > EPSILON * abs(pole)
        if pole.imag >= 0.0 or not is_pair:
            weight = -complex(zeros(pole)) / complex(poles.deriv()(pole)) / pole
            weight, pole = (2.0 * weight, pole) if is_pair else (complex(weight.real), complex(pole.real))
            found.append(Mode((pole.real, pole.imag), (weight.real, weight.imag), is_pair))
    return tuple(found)


MODES = _modes()
DELAYED = tuple(f"delayed{k}" for k in range(sum(mode.size for mode in MODES)))
"""States of a dead time."""
STATES = {"dead_time": DELAYED, "lag": ("lagged",)}
"""States of what is late, by what makes it so."""


@dataclass(frozen=True)
class Follower:
    """What drives a motor behind its command, and its states.

    A dead time d is a rational function of s d with three poles and two zeros that agrees with exp(-s d) to the fifth
    power (Pade).
    """

    dead_time: Any | None
    """s; None without one."""
    lag: Any | None
    """Time constant, s; None without one."""
    states: tuple[Any, ...]

    @property
    def value(self) -> Any:
        """What drives the motor."""
        return self._delayed if self.lag is None else self.states[-1]

    @property
    def _delayed(self) -> Any:
        """What comes of the dead time."""
        return sum(_times(mode.weight, mode.read(states))[0] for mode, states in self._of_modes(self.states))

    def _of_modes(self, states: Sequence[Any]) -> list[tuple[Mode, Sequence[Any]]]:
        """Return the modes of the dead time, each with its own of the states."""
        if self.dead_time is None:
            return []
        ends = accumulate(mode.size for mode in MODES)
        return [(mode, states[end - mode.size : end]) for mode, end in zip(MODES, ends, strict=True)]

    def at_rest(self, wanted: Any) -> list[Any]:
        """Return the states after a command that has been the same for long."""
        return [wanted for _ in self.states]

    def rates(self, wanted: Any) -> list[Any]:
        """Return the time derivatives of the states under a command."""
        rates: list[Any] = []
        for mode, behind in self._of_modes([one - wanted for one in self.states]):
            rates += [rate / self.dead_time for rate in mode.states(_times(mode.pole, mode.read(behind)))]
        follows = wanted if self.dead_time is None else self._delayed
        return rates if self.lag is None else [*rates, (follows - self.states[-1]) / self.lag]

    def stepped(self, wanted: Any, h: Any) -> tuple[list[Any], list[Any]]:
        """Return means and ends of the states over a step of `h` s, exact under a command that is constant over it."""
        began = [one - wanted for one in self.states]
        mean, after, carried = list[Any](), list[Any](), [0.0, 0.0, 0.0]
        for mode, states in self._of_modes(began):
            share, x, own = self.dead_time / h, mode.read(states), self._carried(mode)
            end = _times(mode.left(share), x)
            middle = _times((share, 0.0), _over((end[0] - x[0], end[1] - x[1]), mode.pole))
            mean, after = [*mean, *mode.states(middle)], [*after, *mode.states(end)]
            carried = [known + _times(own, one)[0] for known, one in zip(carried, (x, middle, end), strict=True)]
        if self.lag is not None:
            share, free = self.lag / h, began[-1] - carried[0]
            slow, safe = _unsettled(share)
            gone = -expm1(-1.0 / safe)
            mean.append(carried[1] + where(slow, share * gone, share) * free)
            after.append(carried[2] + where(slow, 1.0 - gone, 0.0) * free)
        return [wanted + one for one in mean], [wanted + one for one in after]

    def observed(self, wanted: Any, h: Any) -> list[Any]:
        """Return the states at a node under a command that changes, so that their value is as it is there.

        Commands are constant over a step of `h` s, at their values in its middle, so that what follows a ramp comes out
        h / 2 coth(h / (2 lag)) behind it at the nodes instead of the lag, and alike behind a dead time.
        """
        states, late, taken, whole = list(self.states), 0.5, 0.0, 0.0
        for mode, _ in self._of_modes(self.states):
            own = mode.weight if self.lag is None else self._carried(mode)
            late, taken = late + _times(own, mode.ramp(self.dead_time / h))[0], taken + own[0]
        if self.dead_time is not None:
            whole = self.dead_time / h
        if self.lag is not None:
            share = self.lag / h
            slow, safe = _unsettled(share)
            left = where(slow, 0.5 / tanh(0.5 / safe) - 0.5, 0.0)
            late, whole = late + (1.0 - taken) * left, whole + share
            return [*states[:-1], wanted + whole / late * (states[-1] - wanted)]
        return [wanted + whole / late * (one - wanted) for one in states]

    def _carried(self, mode: Mode) -> Complex:
        """Return what the lag takes on of a mode of the dead time before it, which decays in its own way."""
        if self.lag is None:
            return 0.0, 0.0
        dead, lag = self.dead_time, self.lag
        return _over(_times((dead, 0.0), mode.weight), (dead + lag * mode.pole[0], lag * mode.pole[1]))
