"""Long segments in parts that are differentiated side by side: states first, then each part from where it begins.

A forward sensitivity at the end of a segment is the product of those of its parts, so that only the states need to be
simulated one step after the other, which takes a fraction of the time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.kernel import Piece, Score, SweepResult, empty_result

MOST_PARTS = 8
"""Parts of a request at which vectors of four, in two threads, are full."""
SHORTEST_PART = 250
"""Integrator steps below which a part costs more than it saves."""


@dataclass(frozen=True)
class Parts:
    """A piece with derivatives, cut into more segments. How it is cut depends on nothing but its request."""

    piece: Piece
    first: IntArray
    """(parts + 1,) nodes at which parts begin; last the end of the piece."""
    owner: IntArray
    """(parts,) the segment of the piece that each part belongs to."""
    course: FloatArray
    """(n, states) states before the ticks of each node, once the piece was simulated without derivatives."""

    def ahead(self) -> Piece:
        """Return what is to be simulated first: the states alone."""
        plain = replace(self.piece.request, derivatives=False, with_states=False, yardstick=None)
        into = SweepResult(self.piece.into.y, np.empty_like(self.piece.into.end))
        return Piece(plain, into, self.piece.begin, self.piece.stop, self.course, observed=False)

    def cut(self) -> Piece:
        """Return the parts as a piece, once the course is known; its outputs are those of the whole."""
        request, into = self.piece.request, self.piece.into
        x0 = self.course[self.first[:-1]]
        whole = np.flatnonzero(np.diff(self.owner, prepend=-1))
        x0[whole] = request.x0[self.owner[whole]]
        closing = int(request.first[-1])
        first = self.first if self.first[-1] == closing else np.append(self.first, closing)
        smaller = replace(request, first=first, x0=x0)
        found = empty_result(smaller, x0.shape[1], into.y.shape[1], self._columns - x0.shape[1])
        return Piece(smaller, replace(found, y=into.y, states=into.states), 0, len(x0))

    @property
    def _columns(self) -> int:
        assert self.piece.into.dend is not None
        return int(self.piece.into.dend.shape[2])

    def _nodes(self, part: int) -> slice:
        """Return the nodes whose outputs a part writes: that which closes the recording belongs to the last part."""
        end = int(self.first[part + 1])
        return slice(int(self.first[part]), end + (end == int(self.piece.request.first[-1])))

    def join(self, found: SweepResult) -> None:
        """Write what the whole piece comes to: the chain rule over its parts."""
        into, columns = self.piece.into, self._columns
        assert found.dend is not None and into.dend is not None
        states, chain = found.end.shape[1], np.eye(columns)
        for part, owner in enumerate(self.owner):
            if part == 0 or self.owner[part - 1] != owner:
                chain = np.eye(columns)
            if into.dy is not None and found.dy is not None:
                rows = self._nodes(part)
                into.dy[rows] = found.dy[rows] @ chain
            if into.score is not None and found.score is not None:
                _add(into.score, int(owner), found.score, part, chain)
            chain[:states] = found.dend[part] @ chain
            into.end[owner], into.dend[owner] = found.end[part], chain[:states]


def _add(into: Score, owner: int, found: Score, part: int, chain: FloatArray) -> None:
    """Add the sums over a part whose start moves with that of the segment and with the parameters by `chain`."""
    assert into.gradient is not None and into.square is not None
    assert found.gradient is not None and found.square is not None
    into.cost[owner] += found.cost[part]
    into.gradient[owner] += found.gradient[part] @ chain
    into.square[owner] += chain.T @ found.square[part] @ chain


def parts_of(piece: Piece) -> Parts | None:
    """Return a piece in parts; None where it is not worth while."""
    request, segments = piece.request, piece.stop - piece.begin
    most = MOST_PARTS // segments
    if not request.derivatives or most < 2:
        return None
    counts = np.clip(piece.steps // SHORTEST_PART, 1, most)
    if np.max(counts) < 2:
        return None
    before: IntArray = np.concatenate([[0], np.cumsum(request.grid.substeps)])
    first: list[int] = []
    owner: list[int] = []
    for segment, count in zip(range(piece.begin, piece.stop), counts, strict=True):
        begin, last = int(request.first[segment]), int(request.first[segment + 1])
        goals = np.linspace(float(before[begin]), float(before[last]), int(count), endpoint=False)
        starts = sorted({begin + int(node) for node in np.searchsorted(before[begin:last], goals)})
        first += starts
        owner += [segment] * len(starts)
    end = int(request.first[piece.stop])
    course = np.empty((request.grid.time.size, request.x0.shape[1]))
    return Parts(piece, np.array([*first, end], dtype=np.int64), np.array(owner, dtype=np.int64), course)
