"""Segments as native code sees them (`segment` in sweep.c), and which of them it simulates side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import numpy.typing as npt

from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.kernel import Piece

Addresses = npt.NDArray[np.uintp]
NOTHING = 0
"""The address of what is not there."""


@dataclass(frozen=True)
class SegmentTable:
    """Rows for native code, which hold while the arrays that they point into are kept."""

    rows: Addresses
    """(segments, fields of `segment`)."""
    steps: IntArray
    """(segments,) how many integrator steps each takes."""
    kept: tuple[npt.NDArray[np.generic], ...]

    def order(self) -> IntArray:
        """Return the longest segments first: those of about equal length side by side."""
        return np.argsort(-self.steps, kind="stable")


def alike(pieces: Sequence[Piece]) -> Iterable[list[Piece]]:
    """Group pieces from which the same is wanted."""

    def wanted(piece: Piece) -> tuple[int, bool, bool, bool]:
        request = piece.request
        return piece.columns, request.with_states, request.yardstick is None, piece.observed

    return (list(group) for _, group in groupby(sorted(pieces, key=wanted), key=wanted))


def segment_table(pieces: Sequence[Piece]) -> SegmentTable:
    """Return the rows of all segments of some pieces."""
    tables = [_table(piece) for piece in pieces]
    return SegmentTable(
        np.concatenate([table.rows for table in tables]),
        np.concatenate([table.steps for table in tables]),
        tuple(array for table in tables for array in table.kept),
    )


def _table(piece: Piece) -> SegmentTable:
    request, into = piece.request, piece.into
    grid, by = request.grid, request.yardstick
    begin, last, index = request.first[:-1], request.first[1:], np.arange(len(request.first) - 1)
    loss = None if by is None else np.array([by.loss.code, by.loss.parameter], dtype=float)
    score = (None, None, None) if into.score is None else (into.score.cost, into.score.gradient, into.score.square)
    measured, noise = (None, None) if by is None else (by.measured, by.noise)
    nodes, same, own = np.stack((begin, np.zeros_like(begin), index))
    pointers = [
        (nodes, (grid.dt, grid.substeps, grid.ticks, grid.at_start, grid.at_end, grid.at_node)),
        (same, (np.asarray(request.p, dtype=float), np.asarray(request.width, dtype=float))),
        (own, (np.asarray(request.x0, dtype=float),)),
        (nodes, (piece.resets, measured)),
        (same, (noise, loss)),
        (nodes, (piece.course, into.states, into.y if piece.observed else None, into.dy)),
        (own, (into.end, None if into.dend is None else into.dend.transpose(0, 2, 1), *score)),
    ]
    at = np.column_stack([rows for rows, arrays in pointers for _ in arrays])
    # What is written to must be in memory order already: of anything else this makes a copy.
    whole = [None if array is None else np.ascontiguousarray(array) for _, arrays in pointers for array in arrays]
    origin = np.array([NOTHING if array is None else array.__array_interface__["data"][0] for array in whole])
    stride = np.array([0 if array is None else array.strides[0] for array in whole])
    addresses = (origin + at * stride).astype(np.uintp)
    sizes = np.column_stack((last - begin + 1, index == index[-1])).astype(np.uintp)
    kept = tuple(array for array in whole if array is not None)
    return SegmentTable(np.hstack((sizes, addresses)), piece.steps, kept)


def shares(steps: IntArray, lanes: int, count: int) -> list[int]:
    """Return where to cut segments, the longest first, into about `count` parts of equal work and whole lanes."""
    work = steps[::lanes]
    total: IntArray = np.cumsum(work)
    goals: FloatArray = total[-1] * np.arange(1, count) / count
    edges = [int(edge) + 1 for edge in np.searchsorted(total, goals)]
    return [0, *(min(edge * lanes, steps.size) for edge in edges), steps.size]
