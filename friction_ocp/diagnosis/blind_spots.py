"""What the recordings cannot tell: effects that only slow motion shows, where there was none slow enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.contrast import contrast
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.options import Considered, places
from friction_ocp.effects.effect import Clues
from friction_ocp.effects.registry import effects
from friction_ocp.simulation.grid import FloatArray

CERTAIN = 5.0
"""Deviations of the noise from which an effect would be seen, whatever the parameters do about it."""
SLOWEST, FASTER, HALVINGS = 1e-4, 2.0, 4
"""Share of the greatest speed at which the search begins, the factor from one speed to the next, and how often the last
step is halved."""


@dataclass(frozen=True)
class BlindSpot:
    """An effect that would stay in the noise although it had its usual size, were it confined to low speed."""

    effect: str
    component: str
    below: float
    """Characteristic speed below which that is so, rad/s or m/s of the component's own shaft."""
    size: float
    """The usual size, N m or N."""


def blind_spots(fitted: FittedModel, left: Excess, clues: Clues, meant: Considered) -> tuple[BlindSpot, ...]:
    """Return where effects that compete and that a model lacks would hide; what is `left` counts as noise."""
    enough = CERTAIN * max(left.ratio, 1.0) ** 0.5
    found = (_blind_spot(fitted, enough, clues, *key) for key in places(fitted, meant))
    return tuple(item for item in found if item is not None)


def _blind_spot(fitted: FittedModel, enough: float, clues: Clues, effect: str, place: str) -> BlindSpot | None:
    hiding = effects()[effect].hiding(fitted.model.problem.drive, place, clues)
    if hiding is None or not hiding.usual > 0.0:
        return None
    built, rows = contrast(fitted.model, fitted.linear, hiding.augmentation.drive), fitted.linear.rows

    def seen(speed: float) -> bool:
        left: FloatArray = rows.absorbed(built.columns([hiding.values(speed)]))
        return float(np.linalg.norm(left)) * hiding.usual / hiding.tried >= enough

    below = _first(seen, float(np.max(np.abs(clues.steady.get(place, clues.speeds(place))))))
    return None if below is None else BlindSpot(effect, place, below, hiding.usual)


def _first(seen: Callable[[float], bool], fastest: float) -> float | None:
    """Return the lowest speed at which something is seen; the greatest where it never is, None where it always is."""
    speed = SLOWEST * fastest
    if seen(speed):
        return None
    while speed < fastest and not seen(min(FASTER * speed, fastest)):
        speed *= FASTER
    if speed >= fastest:
        return fastest
    factor = FASTER
    for _ in range(HALVINGS):
        factor **= 0.5
        speed = speed if seen(speed * factor) else speed * factor
    return speed * factor
