"""Segments of which some states go on from one to the next, as one run in which the other states are set anew."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.kernel import Piece, SweepResult


@dataclass(frozen=True)
class Chained:
    """A piece with carried states."""

    piece: Piece
    course: FloatArray
    """(n, states) states before the ticks of each node, once the run was simulated."""

    def run(self) -> Piece:
        """Return the piece as one segment."""
        request, into = self.piece.request, self.piece.into
        starts, closing = self._starts, int(request.first[-1])
        end = int(request.first[self.piece.stop])
        resets = np.full_like(self.course, np.nan)
        resets[starts] = request.x0[self.piece.begin : self.piece.stop]
        resets[np.ix_(starts[1:], np.asarray(request.carried))] = np.nan
        first = np.array([starts[0], end] if end == closing else [starts[0], end, closing], dtype=np.int64)
        whole = replace(request, first=first, x0=request.x0[self.piece.begin : self.piece.begin + 1], carried=None)
        found = SweepResult(into.y, np.empty_like(into.end[:1]), states=into.states)
        return Piece(whole, found, 0, 1, self.course, resets)

    @property
    def _starts(self) -> IntArray:
        return self.piece.request.first[self.piece.begin : self.piece.stop]

    def write_ends(self, found: SweepResult) -> None:
        """Write where each segment of the piece ends."""
        own = self.piece.into.end[self.piece.begin : self.piece.stop]
        own[:-1], own[-1] = self.course[self._starts[1:]], found.end[0]


def chained(piece: Piece) -> Chained | None:
    """Return a piece that has carried states as one run; None for others."""
    if piece.request.carried is None:
        return None
    return Chained(piece, np.empty((piece.request.grid.time.size, piece.request.x0.shape[1])))
