"""Segments of which some states go on from one to the next, as one run in which the other states are set anew."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.kernel import Piece, SweepResult
from friction_ocp.simulation.plan import AbstractPlan


@dataclass(frozen=True)
class Chained(AbstractPlan):
    """A piece with carried states."""

    course: FloatArray
    """(n, states) states before the ticks of each node, once the run was simulated."""

    def ahead(self) -> None:
        return None

    def work(self) -> Piece:
        """Return the piece as one segment."""
        request, into = self.piece.request, self.piece.into
        starts = request.first[:-1]
        resets = np.full_like(self.course, np.nan)
        resets[starts] = request.x0
        resets[np.ix_(starts[1:], np.asarray(request.carried))] = np.nan
        whole = replace(request, first=request.first[[0, -1]], x0=request.x0[:1], carried=None)
        found = SweepResult(into.y, np.empty_like(into.end[:1]), states=into.states)
        return Piece(whole, found, self.course, resets)

    def finish(self, found: SweepResult) -> None:
        """Write where each segment ends."""
        into = self.piece.into
        into.end[:-1], into.end[-1] = self.course[self.piece.request.first[1:-1]], found.end[0]


def chained(piece: Piece) -> Chained | None:
    """Return a piece that has carried states as one run; None for others."""
    if piece.request.carried is None:
        return None
    return Chained(piece, np.empty((piece.request.grid.time.size, piece.request.x0.shape[1])))
