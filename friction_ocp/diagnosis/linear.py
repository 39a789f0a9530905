"""A program linearised about a point, with its node states eliminated: what any small change does to the residuals."""

from __future__ import annotations

import weakref
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as _linalg  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.factors import HELD
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.execution.effort import uncounted
from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray

linalg: Any = _linalg  # its own types are incomplete

MOST_KEPT = 2e9
"""Bytes of linearised programs that are kept in a process; what was longest not asked for is laid again when it is."""


@dataclass(frozen=True)
class Rows:
    """Residuals of all recordings at a point, every other row free of what node states and parameters can absorb."""

    residual: FloatArray
    """(rows,) at the solved nodes, in units of their standard deviations, times the root of the loss's weight."""
    jacobian: FloatArray
    """(rows, parameters) along the manifold of solved nodes."""
    recording: IntArray
    """(rows,) index of the recording; sets of static points are numbered on, -1 for priors."""
    time: FloatArray
    """(rows,) s; the number of a static point."""
    channel: IntArray
    """(rows,) output column; -1 for gaps, -2 for starts and priors."""
    node: IntArray
    """(rows,) grid node of the row."""
    pressed: BoolArray
    """(parameters,) which lie on a bound that the objective presses them against: they absorb nothing."""
    static: tuple[int, ...] = ()
    """Numbers of the sets of static points, as `recording` has them."""

    def absorbed(self, columns: FloatArray) -> FloatArray:
        """Return what is left of columns once the parameters have absorbed what they can."""
        basis, _ = self._factors
        return columns - basis @ (basis.T @ columns)

    def fitted(self, column: FloatArray) -> FloatArray:
        """Return (parameters,) the change of the parameters that comes closest to a column."""
        basis, back = self._factors
        return back @ (basis.T @ column)

    @cached_property
    def _factors(self) -> tuple[FloatArray, FloatArray]:
        """Return (rows, rank) an orthonormal basis of what the parameters can do, and (parameters, rank) how."""
        scale = np.linalg.norm(self.jacobian, axis=0)
        told = (scale > 0) & ~self.pressed
        back = np.zeros((scale.size, 0))
        if not told.any():
            return np.zeros((self.residual.size, 0)), back
        left, sizes, right = np.linalg.svd(self.jacobian[:, told] / scale[told], full_matrices=False)
        kept = sizes > 1e-10 * sizes[0]
        back = np.zeros((scale.size, int(np.sum(kept))))
        back[told] = right[kept].T / sizes[kept] / scale[told, None]
        return left[:, kept], back


class LinearRecording:
    """One recording of a program at a point: the map from changes of the simulation to changes of the residuals."""

    def __init__(self, program: Program, index: int, point: Point) -> None:
        self.item, self.cut = program.experiments[index], program.segments[index]
        self.index, self.nodes = index, point.nodes[index]
        self.states = self.nodes.shape[1]
        result = program.simulate(index, point, derivatives=True)
        assert result.dy is not None and result.dend is not None
        self.y, self.end = result.y, result.end
        self.noise, self.loss, self.drive = program.noise, program.loss, program.drive
        self.seen = np.isfinite(self.item.measured)
        time = np.arange(self.item.grid.time.size)
        self.segment = self.cut.owner(time)
        self.alike = _alike(self.segment)
        errors = program.sample_errors(index, self.y)
        self.scaling = np.sqrt(self.loss.weight(errors)) / self.noise
        self.dy = np.where(self.seen[:, :, None], result.dy[:, :, : self.states] * self.scaling[:, :, None], 0.0)
        self.dend = result.dend[:, :, : self.states]
        _, self.slope = program.space.numbers_and_slope(point.theta, self.item.name)
        self._factor()
        gaps, starts = program.gap_errors(index, point, self.end), program.start_errors(index, point)
        raw = self._stack(errors * self.scaling * self.noise, gaps, starts)
        by_theta = result.dy[:, :, self.states :] @ self.slope * self.scaling[:, :, None]
        end_theta = result.dend[:-1, :, self.states :] @ self.slope
        columns = self._stack_columns(by_theta, end_theta, self._start_slopes(program, point))
        direct = columns + self._measured_slopes(program, point)
        self.following = self._following(direct)
        self.jacobian = self._followed(direct, self.following)
        self.residual = self.reduced(raw[:, None])[:, 0]

    def _start_slopes(self, program: Program, point: Point) -> FloatArray:
        if self.cut.start_weight is None:
            return np.zeros((0, self.states, point.theta.size))
        return -self.cut.start_weight[self.cut.tied][:, :, None] * program.expected(self.index, point.theta)[1]

    def _measured_slopes(self, program: Program, point: Point) -> FloatArray:
        """Return (rows, parameters) what the parameters do through nodes that the measurement gives."""
        moved = np.zeros((self.cut.count, self.states, point.theta.size))
        if self.cut.measured:
            at = self.cut.first[: self.cut.measured]
            moved[: self.cut.measured] = program.measured_states(self.item, point.theta, at)[1]
        return self._applied(moved)

    def _stack(self, errors: FloatArray, gaps: FloatArray, starts: FloatArray) -> FloatArray:
        return np.concatenate([errors.ravel(), gaps.ravel(), starts.ravel()])

    def _stack_columns(self, by_y: FloatArray, by_end: FloatArray, starts: FloatArray | None = None) -> FloatArray:
        """Return (rows, k) from changes of scaled outputs (n, outputs, k) and of segment ends (segments - 1, s, k)."""
        count = by_y.shape[2]
        y = np.where(self.seen[:, :, None], by_y, 0.0).reshape(self.seen.size, count)
        ends = np.zeros((0, count))
        if self.cut.gap_weight is not None and self.cut.count > 1:
            weighted = self.cut.gap_weight @ by_end
            ends = weighted.reshape((self.cut.count - 1) * self.states, count)
        rest = np.zeros((self._start_rows, count)) if starts is None else starts.reshape(self._start_rows, count)
        return np.concatenate([y, ends, rest])

    @property
    def _start_rows(self) -> int:
        return 0 if self.cut.start_weight is None else int(self.cut.tied.size * self.states)

    def change(self, by_y: FloatArray, by_end: FloatArray) -> FloatArray:
        """Return (rows, k) what changes of outputs (n, outputs, k) and segment ends (segments, s, k) do in the end."""
        return self.reduced(self._stack_columns(by_y * self.scaling[:, :, None], by_end[:-1]))

    def moved_by(self, step: FloatArray) -> FloatArray:
        """Return (segments, states) how the nodes follow a change of the parameters."""
        return self.following @ step

    def reduced(self, columns: FloatArray) -> FloatArray:
        """Return columns of rows with the nodes moved to their best places."""
        return self._followed(columns, self._following(columns))

    def _following(self, columns: FloatArray) -> FloatArray:
        """Return (segments, states, k) how far the nodes move to where changes of the rows cost least."""
        if not self.states or not columns.shape[1]:  # the motion is prescribed, or nothing is fitted
            return np.zeros((self.cut.count, self.states, columns.shape[1]))
        return self._solve(-self._transposed(columns))

    def _followed(self, columns: FloatArray, moved: FloatArray) -> FloatArray:
        return columns + self._applied(moved) if moved.size else columns

    def _applied(self, moved: FloatArray) -> FloatArray:
        """Return the change of all rows for moved nodes (segments, s, k)."""
        count = moved.shape[2]
        parts = [self._by_sample(moved).reshape(self.seen.size, count)]
        if self.cut.gap_weight is not None and self.cut.count > 1:
            gap = self.dend[:-1] @ moved[:-1] - moved[1:]
            weighted = self.cut.gap_weight @ gap
            parts.append(weighted.reshape((self.cut.count - 1) * self.states, count))
        if self.cut.start_weight is not None:
            tied = self.cut.tied
            pulled = self.cut.start_weight[tied][:, :, None] * moved[tied]
            parts.append(pulled.reshape(self._start_rows, count))
        return np.concatenate(parts)

    def _transposed(self, columns: FloatArray) -> FloatArray:
        """Return (segments, s, k) the gradient by the nodes of columns of rows."""
        count, (n, outputs) = columns.shape[1], self.seen.shape
        y = columns[: n * outputs].reshape(n, outputs, count)
        gradient = self._by_segment(np.where(self.seen[:, :, None], y, 0.0))
        at = n * outputs
        if self.cut.gap_weight is not None and self.cut.count > 1:
            size = (self.cut.count - 1) * self.states
            gap = columns[at : at + size].reshape(-1, self.states, count)
            pulled = self.cut.gap_weight.swapaxes(1, 2) @ gap
            gradient[:-1] += self.dend[:-1].swapaxes(1, 2) @ pulled
            gradient[1:] -= pulled
            at += size
        if self.cut.start_weight is not None:
            tied = self.cut.tied
            rest = columns[at:].reshape(-1, self.states, count)
            np.add.at(gradient, tied, self.cut.start_weight[tied][:, :, None] * rest)
        return gradient

    def _by_sample(self, moved: FloatArray) -> FloatArray:
        """Return (n, outputs, k) what moved nodes (segments, s, k) do to scaled outputs that were seen."""
        many, size = self.alike
        at, (_, outputs, states) = many * size, self.dy.shape
        whole = self.dy[:at].reshape(many, size * outputs, states) @ moved[:many]
        rest = self.dy[at:] @ moved[self.segment[at:]]
        return np.concatenate([whole.reshape(at, outputs, moved.shape[2]), rest])

    def _by_segment(self, y: FloatArray) -> FloatArray:
        """Return (segments, s, k) sums over samples of what nodes do to them, times y (n, outputs, k)."""
        many, size = self.alike
        at, (_, outputs, states) = many * size, self.dy.shape
        whole = self.dy[:at].reshape(many, size * outputs, states).swapaxes(1, 2)
        sums = whole @ y[:at].reshape(many, size * outputs, y.shape[2])
        if many == self.cut.count:
            return sums
        rest = self.dy[at:].swapaxes(1, 2) @ y[at:]
        return np.concatenate([sums, np.add.reduceat(rest, self.cut.first[many:-1] - at, axis=0)])

    def _factor(self) -> None:
        """Factorise the block-tridiagonal normal matrix of the nodes."""
        self.scale, self.factors = self._factors(self.cut)

    def nodes_told(self, cut: Segments) -> float:
        """Return the log-determinant of the information about the nodes with the gaps of some segments."""
        if not self.states:
            return 0.0
        scale, factors = (self.scale, self.factors) if cut is self.cut else self._factors(cut)
        diagonal = factors.reshape(2 * self.states, -1)[0]
        return 2.0 * float(np.sum(np.log(diagonal)) - np.sum(np.log(scale[cut.measured :])))

    def _factors(self, cut: Segments) -> tuple[FloatArray, FloatArray]:
        """Return (segments, states) scales of the nodes, and the Cholesky factors of their scaled normal matrix."""
        count, states, index = cut.count, self.states, np.arange(int(self.states))
        diagonal = self._by_segment(self.dy)
        upper = np.zeros((max(count - 1, 0), states, states))
        if cut.gap_weight is not None and count > 1:
            forward = cut.gap_weight @ self.dend[:-1]
            diagonal[:-1] += forward.swapaxes(1, 2) @ forward
            diagonal[1:] += cut.gap_weight.swapaxes(1, 2) @ cut.gap_weight
            upper = -forward.swapaxes(1, 2) @ cut.gap_weight
        if cut.start_weight is not None:
            diagonal[:, index, index] += cut.start_weight**2
        diagonal[:, index, index] += 1e-14 * (1.0 + diagonal[:, index, index])
        scale = 1.0 / np.sqrt(diagonal[:, index, index])
        diagonal = diagonal * scale[:, :, None] * scale[:, None, :]
        upper = upper * scale[:-1, :, None] * scale[1:, None, :]
        diagonal[: cut.measured] = np.eye(states)
        upper[: cut.measured] = 0.0
        return scale, _banded_factors(diagonal, upper) if states else np.zeros((0, 0))

    def _solve(self, right: FloatArray) -> FloatArray:
        """Return (segments, s, k) node changes for a right-hand side; measured nodes do not move."""
        right = right * self.scale[:, :, None]
        right[: self.cut.measured] = 0.0
        moved = linalg.cho_solve_banded((self.factors, True), right.reshape(-1, right.shape[2]), check_finite=False)
        return moved.reshape(right.shape) * self.scale[:, :, None]

    def labels(self) -> tuple[FloatArray, IntArray, IntArray]:
        """Return time, channel and grid node of every row."""
        n, outputs = (int(size) for size in self.seen.shape)
        time = np.repeat(self.item.grid.time, outputs)
        channel, node = np.tile(np.arange(outputs), n), np.repeat(np.arange(n), outputs)
        gaps = 0 if self.cut.gap_weight is None else max(self.cut.count - 1, 0)
        at = np.repeat(self.cut.first[1:-1], self.states)[: gaps * self.states]
        start = np.repeat(self.cut.first[self.cut.tied], self.states) if self._start_rows else np.zeros(0, int)
        later = np.concatenate([at, start]).astype(np.int64)
        kinds = np.concatenate([np.full(at.size, -1), np.full(start.size, -2)])
        return (
            np.concatenate([time, self.item.grid.time[later]]),
            np.concatenate([channel, kinds]).astype(np.int64),
            np.concatenate([node, later]).astype(np.int64),
        )


def _alike(segment: IntArray) -> tuple[int, int]:
    """Return how many segments from the first on have the same number of samples, and that number."""
    sizes = np.bincount(segment)
    other = np.flatnonzero(sizes != sizes[0])
    return int(other[0]) if other.size else sizes.size, int(sizes[0])


def _banded_factors(diagonal: FloatArray, upper: FloatArray) -> FloatArray:
    """Return the Cholesky factors of a block-tridiagonal matrix of unit diagonal, its lower bands as LAPACK has them.

    Directions that nothing holds, but for rounding, are held by as much as it takes. NaN where numbers are missing.
    """
    count, states = diagonal.shape[:2]
    band = np.zeros((2 * states, count, states))
    for k in range(states):
        band[: states - k, :, k] = diagonal[:, k:, k].T
        band[states - k : 2 * states - k, :-1, k] = upper[:, k, :].T
    for held in HELD:
        band[0] = 1.0 + held
        try:
            return linalg.cholesky_banded(band.reshape(2 * states, -1), lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            continue
    return np.full((2 * states, count * states), np.nan)


@dataclass(frozen=True, eq=False)
class LinearProgram:
    """All recordings of a program at a point; what takes room is laid again where it was not kept."""

    program: Program
    point: Point

    @property
    def recordings(self) -> tuple[LinearRecording, ...]:
        """The recordings."""
        return self._laid[0]

    @property
    def rows(self) -> Rows:
        """Their residuals, and those of static points and priors."""
        return self._laid[1]

    @property
    def _laid(self) -> tuple[tuple[LinearRecording, ...], Rows]:
        if _LAID not in self.__dict__:
            with uncounted():
                self.lay()
        _kept.move_to_end(weakref.ref(self))
        return self.__dict__[_LAID]

    # derivatives outgrow all numbers where a simulation breaks down
    @np.errstate(over="ignore", invalid="ignore")
    def lay(self) -> None:
        """Linearise, and forget of others what was longest not asked for."""
        self.__dict__[_LAID] = items, rows = _laid(self.program, self.point)
        _keep(self, sum(map(_room, items)) + _room(rows) + rows.jacobian.nbytes)


_LAID = "laid"
_kept: OrderedDict[weakref.ref[LinearProgram], int] = OrderedDict()
"""Bytes of those that are laid, the last one that was asked for at the end."""


def _room(item: LinearRecording | Rows) -> int:
    """Return the bytes of the arrays that something has for itself."""
    arrays: list[FloatArray] = [value for value in vars(item).values() if isinstance(value, np.ndarray)]
    return sum(each.nbytes for each in arrays if each.base is None)


def _keep(linear: LinearProgram, room: int) -> None:
    _kept[weakref.ref(linear)] = room
    for gone in [item for item in _kept if item() is None]:
        del _kept[gone]
    while sum(_kept.values()) > MOST_KEPT and len(_kept) > 1:
        oldest, _ = _kept.popitem(last=False)
        known = oldest()
        if known is not None:
            del known.__dict__[_LAID]


def _static_labels(count: int) -> tuple[FloatArray, IntArray, IntArray]:
    nothing = np.zeros(count, dtype=np.int64)
    return np.arange(count, dtype=float), nothing, nothing


def linear_program(program: Program, point: Point) -> LinearProgram:
    """Linearise a program."""
    linear = LinearProgram(program, program.placed(point))
    linear.lay()
    return linear


def _laid(program: Program, point: Point) -> tuple[tuple[LinearRecording, ...], Rows]:
    items = tuple(LinearRecording(program, index, point) for index in range(len(program.experiments)))
    labels = [item.labels() for item in items]
    space = program.space
    static = [term.residuals(space, point.theta) for term in program.static]
    labels += [_static_labels(errors.size) for errors, _ in static]
    prior = np.flatnonzero(np.isfinite(space.prior_std))
    pull = np.zeros((prior.size, point.theta.size))
    pull[np.arange(prior.size), prior] = 1.0 / space.prior_std[prior]
    errors = space.prior_deviations(point.theta)[prior]
    none = np.full(prior.size, -1)
    residual = np.concatenate([*(item.residual for item in items), *(seen for seen, _ in static), errors])
    jacobian = np.concatenate([*(item.jacobian for item in items), *(slope for _, slope in static), pull])
    ends = np.cumsum([item.residual.size for item in items])
    for item, end in zip(items, map(int, ends), strict=True):
        own = slice(end - item.residual.size, end)
        item.residual, item.jacobian = residual[own], jacobian[own]
    rows = Rows(
        residual=residual,
        jacobian=jacobian,
        recording=np.concatenate([*(np.full(label[0].size, k) for k, label in enumerate(labels)), none]),
        time=np.concatenate([*(label[0] for label in labels), np.zeros(prior.size)]),
        channel=np.concatenate([*(label[1] for label in labels), np.full(prior.size, -2)]),
        node=np.concatenate([*(label[2] for label in labels), np.zeros(prior.size, int)]),
        pressed=space.pressed(point.theta, jacobian.T @ residual),
        static=tuple(range(len(items), len(labels))),
    )
    return items, rows
