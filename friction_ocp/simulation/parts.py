"""Long segments in parts that are differentiated side by side: states first, then each part from where it begins.

A forward sensitivity at the end of a segment is the product of those of its parts, so that only the states need to be
simulated one step after the other, which takes a fraction of the time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray
from friction_ocp.simulation.kernel import Piece, Score, SweepResult, empty_result
from friction_ocp.simulation.plan import AbstractPlan

MOST_PARTS = 8
"""Parts of a request at which vectors of four, in two threads, are full."""
SHORTEST_PART = 250
"""Integrator steps below which a part costs more than it saves."""


@dataclass(frozen=True)
class Parts(AbstractPlan):
    """A piece with derivatives, cut into more segments. How it is cut depends on nothing but its request."""

    first: IntArray
    """(parts + 1,) nodes at which parts begin; last the last node of the recording."""
    owner: IntArray
    """(parts,) the segment of the piece that each part belongs to."""
    course: FloatArray
    """(n, states) states before the ticks of each node, once the piece was simulated without derivatives."""

    def ahead(self) -> Piece | None:
        """Return the states alone, where they are not known."""
        if self.piece.request.course is not None:
            return None
        plain = replace(self.piece.request, derivatives=False, with_states=False, yardstick=None)
        into = SweepResult(self.piece.into.y, np.empty_like(self.piece.into.end))
        return Piece(plain, into, self.course, observed=False)

    def work(self) -> Piece:
        """Return the parts; what they write at nodes goes where that of the whole goes."""
        request, into = self.piece.request, self.piece.into
        x0 = self.course[self.first[:-1]]
        x0[self._begins] = request.x0
        smaller = replace(request, first=self.first, x0=x0, course=None)
        found = empty_result(smaller, x0.shape[1], into.y.shape[1], self.piece.columns - x0.shape[1])
        return Piece(smaller, replace(found, y=into.y, states=into.states, dy=into.dy))

    @property
    def _begins(self) -> BoolArray:
        """(parts,) whether a part is the first of its segment."""
        return np.diff(self.owner, prepend=-1) > 0

    def finish(self, found: SweepResult) -> None:
        """Apply the chain rule over the parts."""
        into, columns, nodes = self.piece.into, self.piece.columns, self.first.copy()
        assert found.dend is not None and into.dend is not None
        states, chain, nodes[-1] = found.end.shape[1], np.eye(columns), nodes[-1] + 1
        for part, (owner, begins) in enumerate(zip(self.owner, self._begins, strict=True)):
            if begins:
                chain = np.eye(columns)
            if into.dy is not None:
                rows = slice(int(nodes[part]), int(nodes[part + 1]))
                into.dy[rows] = into.dy[rows] @ chain
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
    request = piece.request
    most = MOST_PARTS // len(request.x0)
    if not request.derivatives or most < 2:
        return None
    counts = np.clip(piece.steps // SHORTEST_PART, 1, most)
    if np.max(counts) < 2:
        return None
    before, first, owner = request.grid.steps_before, list[int](), list[int]()
    for segment, (begin, last) in enumerate(pairwise(map(int, request.first))):
        goals = np.linspace(float(before[begin]), float(before[last]), int(counts[segment]), endpoint=False)
        starts = sorted({begin + int(node) for node in np.searchsorted(before[begin:last], goals)})
        first += starts
        owner += [segment] * len(starts)
    ends = np.array([*first, request.first[-1]], dtype=np.int64)
    course = np.empty((request.grid.time.size, request.x0.shape[1])) if request.course is None else request.course
    return Parts(piece, ends, np.array(owner, dtype=np.int64), course)
