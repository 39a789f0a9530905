"""Arithmetic of friction that runs alike on floats, arrays and SX.

`width` is the speed (or twist) over which a jump is smoothed; 0 gives the exact, set-valued law.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

TINY = 1e-300
"""Keeps the root of a square differentiable at zero without showing in any sum of doubles."""


def where(condition: Any, yes: Any, no: Any) -> Any:
    """Choose elementwise; SX conditions become `if_else`."""
    if isinstance(condition, ca.SX):
        return ca.if_else(condition, ca.SX(yes), ca.SX(no))
    return np.where(condition, yes, no)  # pyright: ignore[reportUnknownVariableType]


def exp(value: Any) -> Any:
    """e**value."""
    return ca.exp(value) if isinstance(value, ca.SX) else np.exp(value)


def sqrt(value: Any) -> Any:
    """Square root."""
    return ca.sqrt(value) if isinstance(value, ca.SX) else np.sqrt(value)


def log(value: Any) -> Any:
    """Natural logarithm."""
    return ca.log(value) if isinstance(value, ca.SX) else np.log(value)


def sin(value: Any) -> Any:
    """Sine."""
    return ca.sin(value) if isinstance(value, ca.SX) else np.sin(value)


def cos(value: Any) -> Any:
    """Cosine."""
    return ca.cos(value) if isinstance(value, ca.SX) else np.cos(value)


def expm1(value: Any) -> Any:
    """e**value - 1."""
    return ca.expm1(value) if isinstance(value, ca.SX) else np.expm1(value)


def tanh(value: Any) -> Any:
    """Hyperbolic tangent."""
    return ca.tanh(value) if isinstance(value, ca.SX) else np.tanh(value)


def smooth_abs(value: Any, width: Any = 0.0) -> Any:
    """|value|, rounded below `width`, with a finite derivative at zero."""
    return sqrt(value * value + width * width + TINY)


def smooth_sign(value: Any, width: Any) -> Any:
    """sign(value) rounded over `width`."""
    return value / smooth_abs(value, width)


def soft_threshold(value: Any, upper: Any, lower: Any, width: Any = 0.0) -> Any:
    """Solve v + F(v) = value for v, F the set-valued sign that jumps from -lower to upper at 0.

    The result is 0 while -lower <= value <= upper (sticking), value - upper above and value + lower
    below; `width` rounds the two corners. The same function is the dead zone of a backlash.
    """
    level = where(value >= 0, upper, lower)
    return _rounded_part(value - level, width) - _rounded_part(-value - level, width)


def _rounded_part(value: Any, width: Any) -> Any:
    """max(value, 0), rounded over `width`; exactly 0 for negative values where `width` is 0."""
    return 0.5 * (value + smooth_abs(value, width))


def positive_part(value: Any) -> Any:
    """max(value, 0)."""
    return np.fmax(value, 0.0) if not isinstance(value, ca.SX) else ca.fmax(value, 0.0)


def power(base: Any, exponent: Any) -> Any:
    """base**exponent for base >= 0 with finite derivatives at base = 0."""
    logarithm = 0.5 * log(base * base + 1e-16)
    return exp(exponent * logarithm)


def sinc(value: Any) -> Any:
    """sin(value) / value, smooth at zero."""
    large = value * value > 1e-4
    safe = where(large, value, 1.0)
    square = value * value
    return where(large, sin(safe) / safe, 1.0 - square / 6.0 * (1.0 - square / 20.0))


def log1p_mean(value: Any) -> Any:
    """log(1 + value) / value for value > -1, smooth at zero."""
    large = value * value > 1e-6
    safe = where(large, value, 1.0)
    return where(large, log(1.0 + safe) / safe, 1.0 - value * (1.0 / 2.0 - value * (1.0 / 3.0 - value / 4.0)))


def decay_means(decay: Any) -> tuple[Any, Any]:
    """Return (1 - e^-decay) / decay and (1 - that) / decay, for decay >= 0.

    Over a step with this decay they are the mean of what is forgotten and of what a constant source adds.
    """
    large = decay > 1e-2
    safe = where(large, decay, 1.0)
    exact = -expm1(-safe) / safe
    first = where(large, exact, 1.0 - decay / 2.0 * (1.0 - decay / 3.0 * (1.0 - decay / 4.0)))
    second = where(large, (1.0 - exact) / safe, 0.5 - decay / 6.0 * (1.0 - decay / 4.0 * (1.0 - decay / 5.0)))
    return first, second
