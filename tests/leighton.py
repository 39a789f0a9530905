"""The Leighton 10 m telescope as the plant has it: the numbers of its paper, the reading that reproduces it.

Torques T are N m at the motor over the motor's speed; the load feels `RATIO` times as much. Two parallel chains drive
one bull gear: the whole inertia with twice the friction, or one chain on half of it.
"""

from __future__ import annotations

import numpy as np
from plant import Plant, PlantFriction, PlantMotor, PlantShaft, PlantTransmission, Trajectory

RATIO = 15050.0
LOAD_INERTIA, MOTOR_INERTIA = 116711.0, 0.002
STIFFNESS, FAST_STIFFNESS = 8.97e7, 2.11e4
"""Table 1; N m/rad, on the slow side of the ratio and on the fast one."""
BREAK, SLEW = 104.25, 266.0
"""rad/s of the motor."""
TORQUE_CONSTANT = 0.35
"""N m/A; the paper gives the conversion only as a picture."""


def slow_friction(tau_c: float = 0.0347, viscous: float = 0.0003, chains: int = 1) -> PlantFriction:
    """Return the friction of the slow side on its own shaft, from R c0l and R c1l of eq. 13."""
    return PlantFriction("coulomb_viscous", tau_c=chains * RATIO * tau_c, viscous=chains * RATIO**2 * viscous)


def fast_polyline(tau_c: float = 0.11, first: float = 0.0039, second: float = 0.0001) -> PlantFriction:
    """Return the polyline of the fast side, eq. 13."""
    return PlantFriction("polyline", tau_c=tau_c, slopes=(first, second), breaks=(BREAK,))


def fast_quadratic(tau_c: float = 0.1007, viscous: float = 0.0047, curvature: float = -1.147e-5) -> PlantFriction:
    """Return the parabola of the fast side, eq. 14."""
    return PlantFriction("quadratic", tau_c=tau_c, viscous=viscous, quadratic=curvature)


def slow_polyline(tau_c: float = 0.0347, first: float = 0.0039, second: float = 0.0001) -> PlantFriction:
    """Return a polyline of the slow side on its own shaft, from R c0l, R c1l, R c2l of eq. 11."""
    slopes = (RATIO**2 * first, RATIO**2 * second)
    return PlantFriction("polyline", tau_c=RATIO * tau_c, slopes=slopes, breaks=(BREAK / RATIO,))


def fast_linear(tau_c: float = 0.11, viscous: float = 0.0003) -> PlantFriction:
    """Return Coulomb and viscous friction of the fast side."""
    return PlantFriction("coulomb_viscous", tau_c=tau_c, viscous=viscous)


def lumped(fast: PlantFriction, slow: PlantFriction, damping: float = 0.0, **parts: object) -> Plant:
    """Return one chain on half of the structure."""
    shafts = (PlantShaft("motor", MOTOR_INERTIA, fast), PlantShaft("load", 0.5 * LOAD_INERTIA, slow))
    joint = PlantTransmission("motor", "load", RATIO, STIFFNESS, damping)
    return Plant(shafts, (joint,), (PlantMotor("motor", "motor", "current", TORQUE_CONSTANT),), **parts)


def stop(begin: float, end: float, speed: float = SLEW, ramp: float = 0.01) -> Trajectory:
    """Return the motor's speed: at rest, at full speed from 0 on, stopped kinematically at `begin`."""
    time = np.array([0.0, begin, begin + ramp, end])
    return Trajectory(time, np.array([speed, speed, 0.0, 0.0]), "linear")
