"""How late channels show what others show of the same motion, without any model of what moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from friction_ocp.drive.gearing import relative_speeds
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.periods import MOVING
from friction_ocp.effects.spectrum import without
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.simulation.grid import FloatArray

MOST = 0.5
"""Share that lateness takes at least of what joints, gains and offsets leave of the difference of two channels."""
LEAST = 0.5
"""Intervals between samples below which a channel is not late: a spring that carries viscous friction looks like that,
and small delays need no other beginning than none."""


def latenesses(drive: Drive, experiments: Sequence[Experiment], numbers: Mapping[str, float]) -> dict[str, float]:
    """Return by channel of an angle how late it is, s, where another one shows that; negative where it is early.

    `numbers` are those of the drive by path. What springs and play between two shafts do goes with acceleration, with
    the direction of the motion and with the place; a delay goes with speed.
    """
    turning = relative_speeds(drive, numbers)
    angles = {k: item for k, item in enumerate(drive.outputs) if item.signal == "theta" and item.part in turning}
    scale = {k: turning[item.part] * (numbers.get(f"{item.name}.gain", 1.0) or 1.0) for k, item in angles.items()}
    found: dict[str, float] = {}
    for k, channel in angles.items():
        behind = [_late(experiments, (k, scale[k]), (other, scale[other])) for other in angles if other != k]
        late = max(behind, key=abs, default=0.0)
        if late:
            found[channel.name] = late
    return found


def _late(experiments: Sequence[Experiment], own: tuple[int, float], other: tuple[int, float]) -> float:
    """Return how late an output, by index and scale, is behind another one; 0 where nothing shows that it is.

    The scale is what is recorded per unit of the motion of the first shaft.
    """
    (k, scale), (reference, per) = own, other
    difference, speed = list[FloatArray](), list[FloatArray]()
    fastest = max(float(np.max(np.abs(item.rate[:, reference]), initial=0.0)) for item in experiments)
    if fastest == 0.0:
        return 0.0
    for item in experiments:
        place, rate, bend = (part[:, reference] / per for part in (item.smooth, item.rate, item.curvature))
        against = np.where(np.abs(item.rate[:, reference]) > MOVING * fastest, np.sign(rate), 0.0)
        shapes = np.column_stack([np.ones(place.size), place, against, bend])
        difference.append(without(item.smooth[:, k] / scale - place, shapes))
        speed.append(without(rate, shapes))
    left, along = np.concatenate(difference), np.concatenate(speed)
    power = float(along @ along)
    if power == 0.0:
        return 0.0
    late = -float(left @ along) / power
    step = float(np.median(np.diff(experiments[0].grid.time)))
    return late if late**2 * power > MOST * float(left @ left) and abs(late) > LEAST * step else 0.0
