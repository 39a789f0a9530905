"""The two steps of the ARIES paper: the Stribeck curve from averaged runs, then the bristle from the response to steps.

The second step takes the axis before breakaway for a linear second-order system (eqs. 12 to 15), inertia and sigma2
known: J w^2 = sigma0 and 2 zeta w J = sigma1 + sigma2. Every torque step away from zero is one response; both numbers
are fitted to all of them.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
import scipy.optimize

from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.problem import Problem
from friction_ocp.recording.recording import Recording

BEFORE = 5
"""Samples before a step whose mean is the angle that it starts from."""
STEPPED = 0.5
"""Change of the torque over its range from which it is a step."""


def static_numbers(curve: Problem) -> dict[str, float]:
    """Return the numbers of the Stribeck curve by name, as a LuGre law calls them."""
    values = identify(curve).values
    named = {name.rpartition(".")[2]: value for name, value in values.items()}
    return {"sigma2" if name == "viscous" else name: value for name, value in named.items()}


def upward_steps(recording: Recording) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Return (times after it, change of angle, change of torque) of every step away from zero, until the next step."""
    torque, position = recording.channels["torque"], recording.channels["position"]
    level = torque.values
    size = STEPPED * (np.max(level) - np.min(level))
    edges = np.flatnonzero(np.abs(np.diff(level)) > size)
    found: list[tuple[np.ndarray, np.ndarray, float]] = []
    for first, last in itertools.pairwise(edges):
        change = float(np.mean(level[first + 1 : last + 1]) - np.mean(level[first - BEFORE + 1 : first + 1]))
        if change * np.mean(level) > 0:
            start = torque.time[first + 1]
            own = (position.time >= start) & (position.time <= torque.time[last])
            before = np.mean(position.values[position.time <= start][-BEFORE:])
            found.append((position.time[own] - start, position.values[own] - before, change))
    return found


def step_response(time: np.ndarray, inertia: float, stiffness: float, damping: float) -> np.ndarray:
    """Return the angle after a unit step of torque: that of J s^2 + d s + k."""
    natural, ratio = np.sqrt(stiffness / inertia), damping / (2.0 * np.sqrt(stiffness * inertia))
    root = np.sqrt(complex(ratio**2 - 1.0)) * natural + 1e-9j * natural
    fast, slow = -ratio * natural - root, -ratio * natural + root
    return np.real(1.0 + (slow * np.exp(fast * time) - fast * np.exp(slow * time)) / (fast - slow)) / stiffness


def second_order(recording: Recording, inertia: float, sigma2: float) -> dict[str, float]:
    """Return sigma0 and sigma1 that fit the response to all steps of a recording by least squares."""
    steps = upward_steps(recording)
    final = np.median([change / np.mean(angle[len(angle) // 2 :]) for _, angle, change in steps])

    def errors(logs: np.ndarray) -> np.ndarray:
        stiffness, damping = np.exp(logs)
        parts = [angle - change * step_response(time, inertia, stiffness, damping) for time, angle, change in steps]
        return np.concatenate(parts) * final / np.abs(steps[0][2])

    start = np.log([final, np.sqrt(final * inertia)])
    stiffness, damping = np.exp(scipy.optimize.least_squares(errors, start).x)
    return {"sigma0": float(stiffness), "sigma1": float(damping - sigma2)}


def errors_of(found: Mapping[str, float], truth: Mapping[str, float]) -> dict[str, float]:
    """Return the relative error of every number that both have."""
    return {name: abs(found[name] / truth[name] - 1.0) for name in truth if name in found}
