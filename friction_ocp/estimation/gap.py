"""Weights of the continuity gaps: how far a state may jump between two segments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.mechanism import WARMTH
from friction_ocp.estimation.drive_noise import input_impulses, joining, joining_at
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.factors import inverse_roots
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_gaps import NodeGaps
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.segments import GapSlopes, Segments
from friction_ocp.estimation.torque_noise import acceleration_noise, torque_covariance
from friction_ocp.simulation.grid import FloatArray, IntArray

RELATIVE_GAP = 0.05
"""Standard deviation of a gap over the typical size of its state, where no process noise is stated."""
DETERMINISTIC_GAP = 1e-4
"""The same for states that no noise enters: bristles, currents, the memory of a controller."""
STEP = 1e-3
"""Relative change of a parameter over which the weight of a gap is differentiated."""
AT_ONCE = 0.01
"""Share of a recording up to which a piece of it begins with it."""
BRISTLE_GAP = 0.01
"""The same for bristles."""


def gap_weights(model: Model, item: Experiment, first: IntArray) -> FloatArray:
    """Return (segments - 1, states, states) W with W'W the inverse covariance of each gap.

    Segments that noise of inputs joins are short, and what no noise enters must not wander from one to the next; those
    that are cut by the user, for a torque noise of his, are long, and a fit leans on what little all states may jump.
    """
    durations = np.diff(item.grid.time[first])[:-1]
    if not model.process_noise:
        return np.tile(np.diag(1.0 / (RELATIVE_GAP * model.state_scale)), (durations.size, 1, 1))
    if model.joins_noise:
        noise = joining(model)
        return NodeGaps(model, noise, item, first, input_impulses(model, item, noise.numbers[item.name])).roots()
    shares = np.minimum(1.0, np.diff(first)[:-1] / model.problem.estimation.samples)
    return inverse_roots(gap_covariance(model, item, durations, shares))


def following(model: Model, program: Program) -> Program:
    """Return a program with gaps that follow the parameters where noise of measured inputs joins its segments.

    What a machine has done does not hang on noise that its meters add, and what such noise would do to a model weighs
    against its residuals: the lighter its rotor, the more. With gaps of one size a lighter rotor would only pay for
    moving more, and the heavier one would be found (errors in variables; Fuller 1987, section 3.1).
    """
    if not model.joins_noise or model.tells_noise:
        return program
    theta = model.nominal
    steps = np.where(theta == 0.0, STEP, STEP * np.abs(theta))
    moves = np.diag(steps)
    noise_at = joining_at(model)
    sides = [(noise_at(theta - move), noise_at(theta + move)) for move in moves]
    noise = noise_at(theta)

    def one(item: Experiment, cut: Segments) -> Segments:
        if cut.gap_weight is None or cut.count < 2:
            return cut
        impulses = input_impulses(model, item, noise.numbers[item.name])
        gaps = NodeGaps(model, noise, item, cut.first, impulses)
        return replace(cut, slopes=GapSlopes(theta, gaps.slopes(sides, steps)))

    pairs = zip(program.experiments, program.segments, strict=True)
    return replace(program, segments=tuple(one(item, cut) for item, cut in pairs))


def start_weight(model: Model, item: Experiment) -> FloatArray:
    """Return (states,) 1 / standard deviation of the prior on the first state of a recording, or of a piece of one.

    States are as uncertain as they are large; but how far friction has warmed up is counted from the start of the
    recording.
    """
    weight = 1.0 / model.state_scale
    names = model.drive.input_names
    if TIME in names:
        gone = float(item.grid.at_node[0, names.index(TIME)]) / float(item.grid.time[-1] - item.grid.time[0])
        cold = np.array([name.endswith(WARMTH) and gone < AT_ONCE for name in model.drive.state_names], dtype=bool)
        weight[cold] /= DETERMINISTIC_GAP
    return weight


def gap_covariance(model: Model, item: Experiment, spans: FloatArray, shares: FloatArray | float = 1.0) -> FloatArray:
    """Return (spans, states, states) the covariances that torque noise gathers over `spans` s in angles and speeds.

    Torque noise of density q N m/sqrt(Hz) on an inertia J makes the speed a random walk: var(v) = q^2 T / J^2,
    cov(q, v) = q^2 T^2 / (2 J^2), var(q) = q^2 T^3 / (3 J^2). What no noise enters may jump a little over a segment,
    and by as much in sum where it is cut: `shares` of a segment are the spans.
    """
    bristle = np.array([".friction.z" in name for name in model.drive.state_names])
    still = np.diag((np.where(bristle, BRISTLE_GAP, DETERMINISTIC_GAP) * model.state_scale) ** 2)
    part = still * np.broadcast_to(shares, spans.shape)[:, None, None]
    return torque_covariance(model.drive.mechanism, part, _group_noise(model, item), spans)


def _group_noise(model: Model, item: Experiment) -> FloatArray:
    numbers = model.space.numbers(model.nominal, item.name)
    return acceleration_noise(model.drive.mechanism, model.process_noise, numbers)
