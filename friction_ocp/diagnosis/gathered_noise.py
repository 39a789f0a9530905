"""How far torque noise moves the states of a drive within a segment, about the motion that it has there."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as _linalg  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model, slopes_at, typical_inputs
from friction_ocp.simulation.grid import FloatArray, IntArray

linalg: Any = _linalg  # its own types are incomplete

ALIKE = 0.01
"""Relative difference of lengths of segments whose gaps are equally wide: the noise is not known better."""
MOVES_ALIKE = float(np.log(2.0))
"""The same for speeds and deflections, logarithms: what matters is whether bristles hold or slip."""


def unit_covariances(model: Model, numbers: FloatArray, spans: FloatArray, at: FloatArray) -> FloatArray:
    """Return (groups, spans, states, states) what unit acceleration noise of each group gathers over each span, s.

    About the states `at` (spans, states) and without dry friction; `numbers` are those of the drive.
    """
    mech = model.drive.mechanism
    slopes = slopes_at(model.drive, numbers, typical_inputs(model.problem, model.drive), list(at))
    states = at.shape[1]
    found = np.zeros((len(mech.topology.roots), spans.size, states, states))
    for k, group in enumerate(mech.free_groups):
        power = np.zeros((states, states))
        power[len(mech.angle_groups) + k, len(mech.angle_groups) + k] = 1.0
        for j, (span, slope) in enumerate(zip(spans, slopes, strict=True)):
            found[group, j] = _gathered(slope, power, float(span))
    return found


def _gathered(slope: FloatArray, power: FloatArray, span: float) -> FloatArray:
    """Return P after a span, s, from dP/dt = A P + P A' + power, P = 0, with A the slope.

    Over a short span by one exponential (Van Loan 1978), which overflows where something decays fast, then doubled:
    P(2 t) = P(t) + e^(A t) P(t) e^(A' t).
    """
    states, size = slope.shape[0], float(np.linalg.norm(slope, 1)) * span
    doublings = max(0, int(np.ceil(np.log2(max(size, 1.0)))))
    whole = np.block([[-slope, power], [np.zeros_like(slope), slope.T]])
    wide = np.asarray(linalg.expm(whole * span / 2**doublings), dtype=np.float64)
    carried = wide[states:, states:].T
    found = carried @ wide[:states, states:]
    for _ in range(doublings):
        found = found + carried @ found @ carried.T
        carried = carried @ carried
    return 0.5 * (found + found.T)


def motions_of(model: Model, numbers: FloatArray, item: Experiment, nodes: IntArray) -> FloatArray:
    """Return (nodes, states) the motion at some nodes, angles and all that does not rub left at zero.

    A shaft that slides is not held by its bristles: torque noise moves it farther than one at rest. Without bristles
    all motion is alike.
    """
    mech, states = model.drive.mechanism, np.zeros((nodes.size, len(model.drive.state_names)))
    if not mech.bristles:
        return states
    found, _ = model.sweep.start.map(nodes.size)(*(signal.T for signal in item.signals(nodes)), numbers)
    angles = len(mech.angle_groups)
    rubbing = slice(angles, angles + len(mech.free_groups) + len(mech.bristle_names))
    states[:, rubbing] = np.asarray(found).T[:, rubbing]
    return states


def alike(spans: FloatArray, motions: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return mean spans and motions of groups that differ little, and the group of each: covariances take time.

    Spans differ by ALIKE, motions (spans, states) by MOVES_ALIKE.
    """
    sizes = np.round(np.log(np.maximum(np.abs(motions), 1e-12)) / MOVES_ALIKE) * np.sign(motions)
    keys = np.column_stack([np.round(np.log(spans) / ALIKE), sizes])
    _, which = np.unique(keys, axis=0, return_inverse=True)
    which = which.ravel().astype(np.int64)
    count = np.bincount(which)
    means = np.column_stack([np.bincount(which, column) / count for column in motions.T])
    return np.bincount(which, spans) / count, means, which
