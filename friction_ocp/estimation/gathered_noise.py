"""How far torque noise moves the states of a drive within a segment, about the motion that it has there."""

from __future__ import annotations

import numpy as np

from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.modes import slopes_at, typical_inputs
from friction_ocp.simulation.grid import FloatArray, IntArray

SHORT, TERMS = 0.5, 18
"""Span times slope from which a Taylor series of so many terms is exact to rounding."""
ALIKE = 0.01
"""Relative difference of lengths of segments whose gaps are equally wide: the noise is not known better."""
MOVES_ALIKE = float(np.log(2.0))
"""The same for speeds and deflections, logarithms: what matters is whether bristles hold or slip."""


def slopes_about(model: Model, numbers: FloatArray, at: FloatArray) -> FloatArray:
    """Return (k, states, states) how the rates depend on the states about `at` (k, states), without dry friction.

    `numbers` are those of the drive.
    """
    found = slopes_at(model.drive, numbers, typical_inputs(model.problem, model.drive), list(at))
    return np.array(found).reshape(len(at), at.shape[1], at.shape[1])


def unit_covariances(model: Model, slopes: FloatArray, spans: FloatArray) -> FloatArray:
    """Return (groups, spans, states, states) what unit acceleration noise of each group gathers over each span, s.

    `slopes` (spans, states, states) are those of the rates over the states.
    """
    mech = model.drive.mechanism
    power = np.zeros((len(mech.topology.roots), *slopes.shape[1:]))
    for k, group in enumerate(mech.free_groups):
        power[group, len(mech.angle_groups) + k, len(mech.angle_groups) + k] = 1.0
    return _gathered(slopes, power, spans)


def _gathered(slopes: FloatArray, power: FloatArray, spans: FloatArray) -> FloatArray:
    """Return P (groups, spans, n, n) after spans, s, from dP/dt = A P + P A' + Q, P = 0; A = slopes (spans, n, n).

    Over a short span by the Taylor series P = sum t^k / k! L^(k - 1)(Q), L(X) = A X + X A', then doubled:
    P(2 t) = P(t) + e^(A t) P(t) e^(A' t), which does not overflow where something decays fast.
    """
    size = float(np.max(np.abs(slopes).sum(axis=1).max(axis=1) * spans, initial=0.0))
    doublings = max(0, int(np.ceil(np.log2(max(size / SHORT, 1.0)))))
    short = (spans / 2**doublings)[:, None, None]
    along, identity = slopes * short, np.eye(slopes.shape[1])
    term, carried = power[:, None] * short, np.broadcast_to(identity, along.shape)
    found: FloatArray = term
    power_of: FloatArray = carried
    for k in range(1, TERMS):
        term = (along @ term + term @ np.swapaxes(along, 1, 2)) / (k + 1)
        power_of = power_of @ along / k
        found, carried = found + term, carried + power_of
    with np.errstate(over="ignore", invalid="ignore"):  # over long spans what is unstable outgrows all numbers
        for _ in range(doublings):
            found = found + carried @ found @ np.swapaxes(carried, 1, 2)
            carried = carried @ carried
    return 0.5 * (found + np.swapaxes(found, 2, 3))


def motions_of(model: Model, numbers: FloatArray, item: Experiment, nodes: IntArray) -> FloatArray:
    """Return (nodes, states) the motion at some nodes, angles and all that does not rub left at zero.

    A shaft that slides is not held by its bristles: torque noise moves it farther than one at rest. Without bristles
    all motion is alike.
    """
    mech, states = model.drive.mechanism, np.zeros((nodes.size, len(model.drive.state_names)))
    if not mech.bristles:
        return states
    found = model.sweep.start_states(item.signals(nodes), numbers)
    angles = len(mech.angle_groups)
    rubbing = slice(angles, angles + len(mech.free_groups) + len(mech.bristle_names))
    states[:, rubbing] = found[:, rubbing]
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
