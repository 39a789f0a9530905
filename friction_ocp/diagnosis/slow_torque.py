"""Is there a slow torque that the model lacks, of whatever shape: a test over stretches of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.blocks import stats
from friction_ocp.diagnosis.contrast import contrast
from friction_ocp.diagnosis.excess import FLOOR_DOUBT
from friction_ocp.diagnosis.fitting import FittedModel
from friction_ocp.effects.effect import Clues
from friction_ocp.effects.torques import ConstantTorqueEffect
from friction_ocp.simulation.grid import FloatArray

STRETCHES = 24
"""In each recording, a constant torque in each."""


@dataclass(frozen=True)
class SlowTorque:
    """What a torque that is constant over stretches of time would explain on one shaft."""

    component: str
    ratio: float
    """Mean square of its amplitudes over their variance under noise alone."""
    p_value: float
    """Of a ratio this large under noise, the floors being off by their doubt."""


def slow_torques(fitted: FittedModel, clues: Clues) -> tuple[SlowTorque, ...]:
    """Test every shaft on which a constant torque can be put; free runs, whose errors add up, are left out."""
    if fitted.footing.segment_s is None:
        return ()
    effect, drive = ConstantTorqueEffect(), fitted.model.problem.drive
    return tuple(_slow_torque(fitted, clues, effect, place) for place in effect.places(drive))


def _slow_torque(fitted: FittedModel, clues: Clues, effect: ConstantTorqueEffect, place: str) -> SlowTorque:
    augmentation = effect.augment(fitted.model.problem.drive, place, clues)
    built = contrast(fitted.model, fitted.linear, augmentation.drive)
    (amplitude,) = augmentation.trials[0].amplitudes
    rows = fitted.linear.rows
    theta, columns, begin = built.theta(amplitude), list[FloatArray](), 0
    for index, item in enumerate(fitted.linear.recordings):
        y, end, _ = built.simulate(index, item, theta)
        stretch = (np.arange(item.cut.count) * STRETCHES) // item.cut.count
        marks = (stretch[:, None] == np.arange(STRETCHES)).astype(float)
        by_end = (end - item.end)[:, :, None] * marks[:, None, :]
        by_y = (y - item.y)[:, :, None] * marks[item.segment][:, None, :]
        own = item.change(by_y, by_end)
        whole = np.zeros((rows.residual.size, STRETCHES))
        whole[begin : begin + own.shape[0]] = own
        columns.append(whole)
        begin += own.shape[0]
    return _tested(place, fitted, rows.absorbed(np.concatenate(columns, axis=1)))


def _tested(place: str, fitted: FittedModel, columns: FloatArray) -> SlowTorque:
    """Test amplitudes by the share of squares that they take, each counted once (F test over all samples)."""
    rows = fitted.linear.rows
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    told = sizes > 1e-6 * max(float(sizes[0]), 1e-300)
    freedom = int(np.sum(told))
    if freedom == 0:
        return SlowTorque(place, 1.0, 1.0)
    ratio = float(np.mean((left[:, told].T @ rows.residual) ** 2))
    limit = (1.0 + FLOOR_DOUBT) ** 2
    return SlowTorque(place, ratio, float(stats.chi2.sf(freedom * ratio / limit, freedom)))
