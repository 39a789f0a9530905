"""The maps of a drive looped in CasADi's virtual machine: the same answers as native code, far slower."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.simulation.grid import APPLY, COMPUTE, FloatArray, Grid, IntArray
from friction_ocp.simulation.kernel import AbstractKernel, Piece, SweepRequest, SweepResult
from friction_ocp.simulation.maps import delay_indices, sweep_maps
from friction_ocp.simulation.scoring import add_score

CHUNKS = (1024, 256, 64, 16, 4, 1)
"""Lengths of the compiled loops from which a segment of any length is put together."""
NEWTON_STEPS = 6
"""From the torques of the step before: three for a change of direction, the others square the error."""
OUTPUT_NEWTON_STEPS = 10
"""From zero."""


@dataclass(frozen=True)
class Schedule:
    """What happens in one segment, operation by operation."""

    controls: FloatArray
    """(inputs + 2, operations): inputs, step length, kind: 0 step, COMPUTE or APPLY tick."""
    node: IntArray
    """(n,) how many operations come before each node is observed."""
    h: FloatArray
    """(n,) step length at each node, as the outputs see it."""


def schedule(grid: Grid, begin: int, last: int, closes: bool) -> Schedule:
    """Return the operations between two nodes; the last node ticks only where it `closes` the recording."""
    nodes = slice(begin, last + 1)
    ticks, substeps, dt = grid.ticks[nodes].copy(), grid.substeps[nodes], grid.dt[nodes]
    ticks[-1] *= closes
    applies, computes = (ticks & APPLY) // APPLY, (ticks & COMPUTE) // COMPUTE
    before = applies + computes
    total = before + substeps
    total[-1] = before[-1]
    offset = np.cumsum(total) - total
    owner = np.repeat(np.arange(total.size), total)
    position = np.arange(owner.size) - offset[owner]
    tick = position < before[owner]
    share = np.where(tick, 0.0, (position - before[owner] + 0.5) / substeps[owner])[:, None]
    start, end, held = (values[nodes][owner] for values in (grid.at_start, grid.at_end, grid.at_node))
    kind = np.where(tick, np.where((position == 0) & (applies[owner] > 0), APPLY, COMPUTE), 0)
    inputs = np.where(tick[:, None], held, start + share * (end - start))
    h = dt / substeps
    h[-1] = h[-1] if dt[-1] > 0 or h.size == 1 else h[-2]
    return Schedule(np.column_stack([inputs, h[owner], kind]).T, offset + before, h)


class InterpretedKernel(AbstractKernel):
    """Folds the maps over the operations of a segment."""

    def __init__(self, drive: SteppedDrive, active: Sequence[int]) -> None:
        self._active = tuple(active)
        self._maps = sweep_maps(drive, active)
        self._delays = delay_indices(drive)
        self._states = len(drive.state_names)
        self._operation = cache(self._new_operation)
        self._fold = cache(self._new_fold)
        self._output = cache(self._new_output)

    def run(self, pieces: Sequence[Piece], threads: int = 1) -> None:
        for piece in pieces:
            self._run(piece.request, piece.into)

    def _run(self, request: SweepRequest, into: SweepResult) -> None:
        tracks: list[FloatArray] = []
        instants: list[FloatArray] = []
        segments = range(len(request.first) - 1)
        for j in segments:
            closes = j == len(request.first) - 2
            plan = schedule(request.grid, int(request.first[j]), int(request.first[j + 1]), closes)
            start = request.x0[j].copy()
            if request.carried is not None and j > 0:
                start[request.carried] = into.end[j - 1, request.carried]
            track = self._course(request, start, plan.controls)
            into.end[j] = track[: self._states, -1]
            if into.dend is not None:
                into.dend[j] = self._sensitivities(track[:, -1:])[0, :, : into.dend.shape[2]]
            seen = slice(0, None if closes else -1)
            tracks.append(track[:, plan.node[seen]])
            instants.append(plan.h[seen])
        if tracks:
            self._observe(request, segments, np.concatenate(instants), np.hstack(tracks), into)

    def _course(self, request: SweepRequest, x0: FloatArray, controls: FloatArray) -> FloatArray:
        """Return the state, its sensitivities and the unknown torques before and after every operation."""
        unknowns, active = self._maps["step"].unknowns, len(self._active)
        parts = [x0, np.zeros(unknowns)]
        if request.derivatives:
            start = np.hstack([np.eye(self._states), np.zeros((self._states, active))])
            parts.insert(1, start.ravel(order="F"))
        columns = [np.concatenate(parts)[:, None]]
        done = 0
        while done < controls.shape[1]:
            length = next(size for size in CHUNKS if size <= controls.shape[1] - done)
            fold = self._fold(length, request.derivatives)
            chunk = fold(columns[-1][:, -1], controls[:, done : done + length], request.p, request.width)
            columns.append(np.asarray(chunk))
            done += length
        return np.hstack(columns)

    def _sensitivities(self, track: FloatArray) -> FloatArray:
        """Return (k, states, columns) from columns of a course."""
        states = self._states
        size = states * (states + len(self._active))
        return track[states : states + size].T.reshape(track.shape[1], -1, states).transpose(0, 2, 1)

    def _observe(
        self, request: SweepRequest, segments: range, h: FloatArray, track: FloatArray, into: SweepResult
    ) -> None:
        begin = int(request.first[segments.start])
        rows = slice(begin, begin + h.size)
        if into.states is not None:
            into.states[rows] = track[: self._states].T
        if into.y.shape[1] == 0:
            return
        delayed = "now" not in self._maps or np.any(np.asarray(request.p)[list(self._delays)] != 0)
        function = self._output(bool(delayed), request.derivatives)
        motion = (track[: self._states], request.grid.at_node[rows].T, request.p, h[None, :], request.width)
        values = [np.asarray(value) for value in function.map(h.size).call([*motion, np.zeros(function.size1_in(5))])]
        into.y[rows] = values[0].T
        dy: FloatArray | None = None
        if request.derivatives:
            by_state, by_active = (value.reshape(len(value), h.size, -1).transpose(1, 0, 2) for value in values[2:])
            dy = by_state @ self._sensitivities(track)
            dy[:, :, self._states :] += by_active
            dy = dy if request.by_active else dy[:, :, : self._states]
        if into.dy is not None:
            into.dy[rows] = dy
        if into.score is not None:
            add_score(into.score, request, segments, into.y[rows], dy, begin)

    def _new_output(self, delayed: bool, derivatives: bool) -> ca.Function:
        output = self._maps["output" if delayed else "now"]
        return output.solved(self._active if derivatives else None, OUTPUT_NEWTON_STEPS)

    def _new_fold(self, length: int, derivatives: bool) -> ca.Function:
        """Return (course, controls, p, width) -> course after each of `length` operations."""
        return self._operation(derivatives).mapaccum("sweep", length)

    def _new_operation(self, derivatives: bool) -> ca.Function:
        """Return (course, control, p, width) -> course after a step or a tick, as the control's kind says."""
        step = self._advance("step", derivatives)
        if "tick" not in self._maps:
            return step
        choice = ca.Function.if_else("choice", self._advance("tick", derivatives), step)
        course, control, p, width = (ca.MX.sym(step.name_in(k), step.sparsity_in(k)) for k in range(4))
        after = choice(control[-1] > 0, course, control, p, width)
        return ca.Function("operation", [course, control, p, width], [after])

    def _advance(self, name: str, derivatives: bool) -> ca.Function:
        """Return (course, control, p, width) -> course after one step or tick."""
        step, item, states = self._maps["step"], self._maps[name], self._states
        size = states * (states + len(self._active)) if derivatives else 0
        sensitivities = ca.SX.sym("s", size)
        torques = ca.SX.sym("torques", step.unknowns)
        h, kind = (ca.SX.sym(symbol) for symbol in ("h", "kind"))
        x, u, p = item.arguments[:3]
        width = step.arguments[4]
        arguments = [x, u, p, kind] if name == "tick" else [x, u, p, h, width]
        start = torques[: item.unknowns]
        function = item.solved(self._active if derivatives else None, NEWTON_STEPS)
        after, found, *slopes = function.call([*arguments, start], True, False)
        course = [after]
        if derivatives:
            moved = ca.mtimes(slopes[0], ca.reshape(sensitivities, states, -1))
            moved[:, states:] += slopes[1]
            course.append(ca.vec(moved))
        course.append(found if item.unknowns else torques)
        before, control = ca.vertcat(x, sensitivities, torques), ca.vertcat(u, h, kind)
        return ca.Function(name, [before, control, p, width], [ca.vertcat(*course)], {"cse": True})
