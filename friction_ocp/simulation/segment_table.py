"""Segments as native code sees them (`segment` in sweep.c), and which of them it simulates side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

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

    def wanted(piece: Piece) -> tuple[bool, bool, bool, bool]:
        request = piece.request
        return request.derivatives, request.with_states, request.yardstick is None, piece.observed

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
    kept: list[npt.NDArray[np.generic]] = []

    def at_nodes(array: FloatArray | IntArray | None) -> Addresses:
        """Return where the row of each segment's first node is."""
        return _rows(array, begin, kept)

    def same(array: FloatArray | None) -> Addresses:
        return _rows(array, np.zeros_like(begin), kept)

    def own_row(array: FloatArray | None) -> Addresses:
        return _rows(array, index, kept)

    loss = None if by is None else np.array([by.loss.code, by.loss.parameter], dtype=float)
    score = (None, None, None) if into.score is None else (into.score.cost, into.score.gradient, into.score.square)
    columns = [
        (last - begin + 1).astype(np.uintp),
        (index == index[-1]).astype(np.uintp),
        *map(at_nodes, (grid.dt, grid.substeps, grid.ticks, grid.at_start, grid.at_end, grid.at_node)),
        *map(same, (np.asarray(request.p, dtype=float), np.asarray(request.width, dtype=float))),
        own_row(np.asarray(request.x0, dtype=float)),
        *map(at_nodes, (piece.resets, None if by is None else by.measured)),
        *map(same, (None if by is None else by.noise, loss)),
        *map(at_nodes, (piece.course, into.states, into.y if piece.observed else None, into.dy)),
        *map(own_row, (into.end, None if into.dend is None else into.dend.transpose(0, 2, 1), *score)),
    ]
    return SegmentTable(np.column_stack(columns), piece.steps, tuple(kept))


def _rows(array: FloatArray | IntArray | None, index: IntArray, kept: list[npt.NDArray[np.generic]]) -> Addresses:
    """Return the addresses of rows of an array in memory order; what is written to must be in that order already."""
    if array is None:
        return np.full(index.size, NOTHING, dtype=np.uintp)
    whole: npt.NDArray[Any] = np.ascontiguousarray(array)
    kept.append(whole)
    addresses: IntArray = int(whole.ctypes.data) + index * whole.strides[0]
    return addresses.astype(np.uintp)


def shares(steps: IntArray, lanes: int, count: int) -> list[int]:
    """Return where to cut segments, the longest first, into about `count` parts of equal work and whole lanes."""
    work = steps[::lanes]
    total: IntArray = np.cumsum(work)
    goals: FloatArray = total[-1] * np.arange(1, count) / count
    edges = [int(edge) + 1 for edge in np.searchsorted(total, goals)]
    return [0, *(min(edge * lanes, steps.size) for edge in edges), steps.size]
