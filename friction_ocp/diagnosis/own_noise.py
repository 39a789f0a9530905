"""The likelihood of recordings under a model whose own inertia the torque noise moves.

Fits share the weights of their gaps, so that a least-squares program compares them. But torque noise moves a heavy
rotor less than a light one: judged by motion alone, a rotor that is too heavy, or an angle that is shown too large,
would pay less for every torque that the model lacks. Whoever compares models asks what noise would have done in each.
Wider gaps have a price: the larger their range, the less likely is each. They have none for what the recordings leave
open anyway: it is the likelihood with the nodes integrated out that counts (Laplace's approximation).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.footing import Footing
from friction_ocp.diagnosis.linear import LinearRecording
from friction_ocp.estimation.drive_noise import input_impulses, torque_noise
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_gaps import NodeGaps
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.simulation.grid import FloatArray


def moved_by_own(foot: Footing, model: Model, theta: FloatArray) -> Footing:
    """Return a footing with the torque noise and the numbers of a model at its parameters."""
    names = model.space.leaf_names
    numbers = {key: dict(zip(names, map(float, model.space.numbers(theta, key)), strict=True)) for key in foot.numbers}
    return replace(foot, density=torque_noise(model, next(iter(numbers.values()))), numbers=numbers)


def with_own_noise(
    program: Program, model: Model, foot: Footing, theta: FloatArray
) -> tuple[Program, tuple[FloatArray, ...]]:
    """Return a program with gaps as wide as torque noise makes them at `theta`, and what that costs by itself.

    By recording (gaps,) the logarithm of how much wider they may be: half the change of the log-determinant of their
    covariance.
    """
    if foot.noisy_inputs:  # its gaps hold no torque noise
        return program, tuple(np.zeros(cut.count - 1) for cut in program.segments)
    moving = moved_by_own(foot, model, theta)
    pairs = zip(program.experiments, program.segments, strict=True)
    found = [_reweighed(model, foot, moving, item, cut) for item, cut in pairs]
    return replace(program, segments=tuple(cut for cut, _ in found)), tuple(price for _, price in found)


def gap_prices(item: LinearRecording, cut: Segments, wider: FloatArray) -> FloatArray:
    """Return (gaps,) what gaps cost a recording that are wider than those of its footing by logarithms `wider`.

    `cut` has these gaps. What the recording does not tell of its nodes is as open as the gaps leave it, at no cost:
    half the change of the log-determinant of the information about all nodes comes back, in equal parts.
    """
    if not wider.size:
        return wider
    back = 0.5 * (item.nodes_told(cut) - item.nodes_told(item.cut))
    return wider + (back if np.isfinite(back) else 0.0) / wider.size


def noise_moved(program: Program, model: Model, foot: Footing, theta: FloatArray) -> float:
    """Return by how much the logarithm of what torque noise moves differs at `theta` from what the gaps are laid for.

    The mean over all gaps and states: 0 where nothing is joined.
    """
    _, wider = with_own_noise(program, model, foot, theta)
    each = np.concatenate(wider) / max(model.state_scale.size, 1)
    return float(np.mean(np.abs(each))) if each.size else 0.0


def _reweighed(
    model: Model, foot: Footing, moving: Footing, item: Experiment, cut: Segments
) -> tuple[Segments, FloatArray]:
    if cut.gap_weight is None or cut.count < 2:
        return cut, np.zeros(0)
    impulses = input_impulses(model, item, moving.numbers[item.name])
    roots = NodeGaps(model, foot, item, cut.first, impulses).roots(moving)
    wider = np.linalg.slogdet(cut.gap_weight)[1] - np.linalg.slogdet(roots)[1]
    return replace(cut, gap_weight=roots), np.asarray(wider, dtype=np.float64)
