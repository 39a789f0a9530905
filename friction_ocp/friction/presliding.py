"""Friction torque over a slow travel to and fro: the hysteresis loop before and around breakaway."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from friction_ocp.friction.element import FrictionElement

FloatArray = NDArray[np.float64]
LEG = 400
"""Steps from one turning point to the next."""


@dataclass(frozen=True)
class Loop:
    """A settled cycle between two turning points: travel and torque, both (n,), closed."""

    travel: FloatArray
    torque: FloatArray

    @property
    def area(self) -> float:
        """Energy that the cycle takes out, J."""
        return float(np.trapezoid(self.torque, self.travel))


def presliding_loop(element: FrictionElement, amplitude: float, speed: float) -> Loop:
    """Return the loop of an element with plain numbers between -amplitude and amplitude at +-speed.

    The first quarter and one whole cycle run in, so that the loop is the one that repeats.
    """
    h = 2.0 * amplitude / speed / LEG
    sign = np.concatenate((np.ones(LEG // 2), -np.ones(LEG), np.ones(LEG), -np.ones(LEG), np.ones(LEG)))
    torque = _torques(element, h, speed * sign)
    travel = np.cumsum(h * speed * sign)
    begin = LEG // 2 + 2 * LEG - 1
    travel, torque = travel[begin:], torque[begin:]
    if not element.law.has_bristle:  # the torque jumps where the motion turns
        turns = np.flatnonzero(np.diff(sign[begin:]))
        travel = np.insert(travel, turns + 1, travel[turns])
        torque = np.insert(torque, turns + 1, torque[turns + 1])
    return Loop(travel, torque)


def _torques(element: FrictionElement, h: float, omega: FloatArray) -> FloatArray:
    if not element.law.has_bristle:
        return np.asarray(element.torque(omega), dtype=np.float64)
    z, now = ca.SX.sym("z", len(element.law.deflections)), ca.SX.sym("omega")
    after = ca.SX(element.advance(h, now, now, z, 0.0))
    torque, _ = element.bristle_torque(now, after)
    step = ca.Function("step", [z, now], [after, ca.SX(torque)])
    _, torques = step.mapaccum(omega.size)(np.zeros(z.numel()), omega[None, :])
    return np.asarray(torques).ravel()
