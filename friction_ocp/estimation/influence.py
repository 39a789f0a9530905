"""How every residual pulls on the fitted parameters, with the node states solved for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from friction_ocp.drive.input_noise import noise_states
from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.static_points import StaticTerm
from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray

Columns = tuple[FloatArray, FloatArray, FloatArray, FloatArray, IntArray, FloatArray]
"""Jacobian, residuals, their scores and curvatures, channels, times."""


@dataclass(frozen=True)
class Influence:
    """Effective Jacobian rows of all measured samples, gaps and unknown noise of inputs, prior rows apart."""

    jacobian: FloatArray
    """(rows, parameters): derivative of each scaled residual along the manifold of solved nodes."""
    residual: FloatArray
    """(rows,) in units of the noise floor."""
    score_weight: FloatArray
    """(rows,) rho'(r)."""
    curvature: FloatArray
    """(rows,) the weight of each row in the information matrix."""
    channel: IntArray
    """(rows,) output column of a measured sample; -1 for gaps, noise of inputs and static points."""
    recording: IntArray
    """(rows,) index of the recording; static points count on behind the recordings."""
    window: IntArray
    """(rows,) index of the free run within its recording; 0 where segments are joined, and for static points."""
    time: FloatArray
    """(rows,) s; the index of a static point."""
    prior: FloatArray
    """(parameters, parameters) information from priors."""

    @property
    def by_loss(self) -> BoolArray:
        """(rows,) whether the loss of the estimation goes by it, as by samples; all else is squares."""
        return self.channel >= 0

    @cached_property
    def places(self) -> list[IntArray]:
        """Rows of each recording, and of each set of static points."""
        return [np.flatnonzero(self.recording == index) for index in np.unique(self.recording)]

    @property
    def information(self) -> FloatArray:
        """Return the Gauss-Newton Hessian, priors included."""
        return self.jacobian.T @ (self.curvature[:, None] * self.jacobian) + self.prior


def influence(program: Program, point: Point) -> Influence:
    """Return the influence of every residual at a solution."""
    reduced = reduce_system(program.linearise(point), 0.0)
    parts = [
        _of_recording(program, point, index, reduced.recordings[index].by_theta)
        for index in range(len(program.experiments))
    ]
    parts += [_of_points(term, program.space, point.theta) for term in program.static]
    joined = (np.concatenate(column) for column in zip(*parts, strict=True))
    jacobian, residual, weight, curvature, channel, time = joined
    windows = [_windows(program, index, part[5]) for index, part in enumerate(parts)]
    recording = np.concatenate([np.full(part[1].size, index) for index, part in enumerate(parts)])
    pull = np.where(np.isfinite(program.space.prior_std), program.space.prior_std, np.inf) ** -2.0
    window = np.concatenate(windows)
    return Influence(jacobian, residual, weight, curvature, channel, recording, window, time, np.diag(pull))


def _squares(jacobian: FloatArray, errors: FloatArray, time: FloatArray) -> Columns:
    """Return rows whose cost is half their square."""
    return jacobian, errors, errors, np.ones(errors.size), np.full(errors.size, -1), time


def _of_noise(program: Program, point: Point, index: int, nodes: FloatArray) -> Columns:
    """Return the rows of the noise of inputs found at every node; `nodes` (segments, states, parameters) are slopes."""
    cut, item = program.segments[index], program.experiments[index]
    assert cut.start_weight is not None
    columns = list(noise_states(program.drive)[0])
    weight = cut.start_weight[cut.tied][:, columns]
    errors: FloatArray = (weight * point.nodes[index][cut.tied][:, columns]).ravel()
    rows = (weight[:, :, None] * nodes[cut.tied][:, columns]).reshape(errors.size, -1)
    at = np.repeat(item.grid.time[cut.first[cut.tied]], len(columns))
    return _squares(rows, errors, at)


def _windows(program: Program, index: int, time: FloatArray) -> IntArray:
    """Return (rows,) which free run of a recording, or of static points behind the recordings, each row belongs to."""
    if index >= len(program.experiments) or program.segments[index].gap_weight is not None:
        return np.zeros(time.size, dtype=np.int64)
    return program.segments[index].owner(np.searchsorted(program.experiments[index].grid.time, time))


def _of_points(term: StaticTerm, space: ParameterSpace, theta: FloatArray) -> Columns:
    errors, slope = term.residuals(space, theta)
    return _squares(slope, errors, np.arange(errors.size, dtype=np.float64))


def _of_recording(program: Program, point: Point, index: int, by_theta: FloatArray) -> Columns:
    item, cut = program.experiments[index], program.segments[index]
    result = program.simulate(index, point, derivatives=True)
    assert result.dend is not None
    _, slope = program.space.numbers_and_slope(point.theta, item.name)
    states = point.nodes[index].shape[1]
    nodes = np.concatenate([by_theta, np.zeros((0, *by_theta.shape[1:]))])
    if cut.measured:
        nodes = nodes.copy()
        nodes[: cut.measured] = program.measured_states(item, point.theta, cut.first[: cut.measured])[1]
    errors = program.residuals(index, result.y)
    seen = np.isfinite(errors)
    rows, residual = program.output_slopes(index, result, slope, nodes)[seen], errors[seen]
    time = np.broadcast_to(item.grid.time[:, None], errors.shape)[seen]
    loss = program.loss
    score = loss.weight(residual) * residual
    parts = [(rows, residual, score, loss.curvature(residual), np.nonzero(seen)[1], time)]
    if cut.gap_weight is not None and cut.count > 1:
        flat = program.gap_errors(index, point, result.end).ravel()
        moved = np.einsum("kij,kjp->kip", result.dend[:-1, :, :states], nodes[:-1]) - nodes[1:]
        moved = cut.weights(point.theta) @ (moved + result.dend[:-1, :, states:] @ slope)
        moved += cut.weighed_slopes(result.end[:-1] - point.nodes[index][1:], point.theta.size)
        at = np.repeat(item.grid.time[cut.first[1:-1]], states)
        parts.append(_squares(moved.reshape(-1, slope.shape[1]), flat, at))
    if program.drive.noisy_inputs:
        parts.append(_of_noise(program, point, index, nodes))
    order = np.argsort(np.concatenate([part[5] for part in parts]), kind="stable")
    return tuple(np.concatenate(column)[order] for column in zip(*parts, strict=True))  # pyright: ignore[reportReturnType]
