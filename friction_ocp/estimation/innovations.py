"""How far each sample is from what the samples before it led to expect: white where a model is right.

Nodes that every sample has drawn to itself leave residuals that are not white whatever the model is. The program is
linear about its solution, and the filter of a linear program gives the innovations (Kalman 1960; Ljung 1999, System
identification, section 7.4).
"""

from __future__ import annotations

import numpy as np

from friction_ocp.estimation.program import Point, Program
from friction_ocp.simulation.grid import FloatArray


def innovations(program: Program, point: Point, index: int) -> FloatArray:
    """Return (n, outputs) the innovations of one recording over their deviations, NaN where there is no sample.

    Its segments are joined, and its nodes where they cost least; one sample of a node after another is taken in.
    """
    cut, nodes = program.segments[index], point.nodes[index]
    assert cut.gap_weight is not None and cut.measured == 0
    result = program.simulate(index, point, derivatives=True)
    assert result.dy is not None and result.dend is not None
    states = nodes.shape[1]
    slopes = result.dy[:, :, :states] / program.noise[:, None]
    errors = -program.residuals(index, result.y)
    advance, jumps = result.dend[:-1, :, :states], result.end[:-1] - nodes[1:]
    roots = np.asarray(np.linalg.inv(cut.weights(point.theta)), dtype=np.float64)
    spread: FloatArray = roots @ roots.transpose(0, 2, 1)
    tied, pulled = _ties(program, index, point)
    ends = np.append(cut.first[1:-1], len(errors))
    found = np.full(errors.shape, np.nan)
    mean, covariance = pulled[0].copy(), np.diag(_variances(tied[0], spread[0].diagonal()))
    for k in range(cut.count):
        if k:
            mean = advance[k - 1] @ mean + jumps[k - 1]
            covariance = advance[k - 1] @ covariance @ advance[k - 1].T + spread[k - 1]
            for state in np.flatnonzero(tied[k]):
                row = np.zeros(states)
                row[state] = tied[k, state]
                mean, covariance, _ = _updated(mean, covariance, row, float(row @ pulled[k]))
        for at in range(cut.first[k], ends[k]):
            for column in np.flatnonzero(np.isfinite(errors[at])):
                told = _updated(mean, covariance, slopes[at, column], float(errors[at, column]))
                mean, covariance, found[at, column] = told
    return found


def _ties(program: Program, index: int, point: Point) -> tuple[FloatArray, FloatArray]:
    """Return (segments, states) one over the deviation of what is known of nodes beforehand, and how far that is."""
    cut, nodes = program.segments[index], point.nodes[index]
    weight, pull = np.zeros(nodes.shape), np.zeros(nodes.shape)
    if cut.start_weight is not None:
        weight = cut.start_weight
        pull[cut.tied] = program.expected(index, point.theta)[0] - nodes[cut.tied]
    return weight, pull


def _variances(weight: FloatArray, gap: FloatArray) -> FloatArray:
    """Return (states,) the variances of a first node: of what nothing is known, that of a gap."""
    is_tied = weight > 0
    known: FloatArray = np.square(1.0 / np.where(is_tied, weight, 1.0))
    return np.where(is_tied, known, gap)


def _updated(
    mean: FloatArray, covariance: FloatArray, slope: FloatArray, value: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return mean and covariance with a value of deviation one that `slope` makes of the state, and its innovation.

    In the form of Joseph, whose covariance stays one where values tell much.
    """
    gain = covariance @ slope
    variance = 1.0 + float(slope @ gain)
    surprise, gain = value - float(slope @ mean), gain / variance
    kept = np.eye(mean.size) - np.outer(gain, slope)
    after = kept @ covariance @ kept.T + np.outer(gain, gain)
    return mean + gain * surprise, 0.5 * (after + after.T), surprise / float(np.sqrt(variance))
