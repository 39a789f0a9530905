"""How far a designed motion may go: what the problem file states, else what the recordings have shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_ocp.effects.effect import Clues
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem


@dataclass(frozen=True)
class Limits:
    """On the first shaft, SI units."""

    speed: float
    torque: float
    """Of its motor."""
    travel: float
    """Between the outermost positions."""
    stated: tuple[str, ...]
    """Those that the problem file states; the others are what the recordings reached."""


def limits_of(problem: Problem, clues: Clues) -> Limits:
    """Return the limits of a problem; raises FrictionOcpError where a stated one is no positive number."""
    stated = stated_limits(problem)
    first = problem.drive.shafts[0].name
    reached = {
        "speed": max(float(np.max(np.abs(track.omega[first]))) for track in clues.tracks),
        "torque": max(float(np.max(np.abs(values))) for track in clues.tracks for values in track.torque.values()),
        "travel": max(float(np.ptp(track.theta[first])) for track in clues.tracks),
    }
    return Limits(**{**reached, **stated}, stated=tuple(stated))


def stated_limits(problem: Problem) -> dict[str, float]:
    """Return the limits that the problem file states; raises FrictionOcpError where one is no positive number."""
    section: Mapping[str, Any] = problem.limits
    where = f"{problem.path or problem.title}: limits"
    wrong = [
        Finding(f"{where}.{key}", f"this is {value!r}", "a positive number in SI units, of the first shaft")
        for key, value in section.items()
        if value is not None and not _is_positive(value)
    ]
    if wrong:
        raise FrictionOcpError(wrong)
    return {key: float(value) for key, value in section.items() if value is not None}


def _is_positive(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 < value < np.inf
