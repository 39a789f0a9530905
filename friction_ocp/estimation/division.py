"""Segments cut into shorter ones where small differences grow, as at breakaway."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.estimation.stages import cuts, relaxed, segments_at
from friction_ocp.simulation.grid import FloatArray, IntArray

GROWTH = 4.0
"""Factor by which differences at the start of a segment may grow to its end. Beyond it a step that its linearisation
promises much of leaves where that holds, and the damping that this calls for holds back all other segments."""


def divided(model: Model, program: Program, point: Point) -> tuple[Program, Point]:
    """Return relaxed segments of which none lets differences grow by more than GROWTH, new nodes on their motion.

    Differences grow by the largest eigenvalue of the end of a segment by its start, whatever the units of the states.
    The same program and point where nothing is to cut.
    """
    cut_again: list[Segments] = []
    nodes: list[FloatArray] = []
    for index, (item, cut) in enumerate(zip(program.experiments, program.segments, strict=True)):
        track = program.simulate(index, point, derivatives=True, with_states=True)
        assert track.states is not None and track.dend is not None
        first = cut_where_they_grow(cut.first, track.dend[:, :, : track.states.shape[1]])
        own = track.states[first[:-1]].copy()
        own[np.searchsorted(first, cut.first[:-1])] = point.nodes[index]
        nodes.append(own)
        cut_again.append(segments_at(model, item, first))
    if all(new.count == old.count for new, old in zip(cut_again, program.segments, strict=True)):
        return program, point
    return replace(program, segments=tuple(cut_again)), Point(point.theta, tuple(nodes))


def divided_afresh(model: Model, program: Program, point: Point) -> tuple[Program, Point]:
    """Return segments cut where differences grow along the motion at hand alone, not where they once did on the way."""
    whole = replace(program, segments=relaxed(model, program.experiments, 0.0, program.loss).segments)
    after, _ = divided(model, whole, whole.point_along(program, point))
    return after, after.point_along(program, point)


def is_divided(model: Model, program: Program) -> bool:
    """Whether relaxed segments were cut further than they were to begin with."""
    pairs = zip(program.experiments, program.segments, strict=True)
    return any(not np.array_equal(cut.first, cuts(item, model.problem.estimation.samples)) for item, cut in pairs)


def reweighed(model: Model, program: Program) -> Program:
    """Return relaxed segments, cut as they are, with the gaps of a model."""
    return cut_at(model, program, [cut.first for cut in program.segments])


def moved_share(program: Program, other: Program) -> float:
    """Return the share of cuts that two programs of the same recordings do not have in common."""
    pairs = list(zip(program.segments, other.segments, strict=True))
    moved = sum(np.setxor1d(cut.first, its.first).size for cut, its in pairs)
    return moved / max(sum(cut.count + its.count for cut, its in pairs), 1)


def are_alike(program: Program, other: Program, theta: FloatArray, share: float) -> bool:
    """Whether two programs are cut alike and their gaps differ by less than a share of their size.

    At parameters `theta` (parameters,), which these follow in both or in none.
    """
    for cut, before in zip(program.segments, other.segments, strict=True):
        if not np.array_equal(cut.first, before.first) or (cut.slopes is None) != (before.slopes is None):
            return False
        if cut.gap_weight is None or before.gap_weight is None or not cut.gap_weight.size:
            continue
        ratio = np.linalg.solve(before.weights(theta).transpose(0, 2, 1), cut.weights(theta).transpose(0, 2, 1))
        if np.max(np.abs(ratio - np.eye(ratio.shape[-1]))) > share:
            return False
    return True


def cut_at(model: Model, program: Program, firsts: Sequence[IntArray]) -> Program:
    """Return a program of relaxed segments cut elsewhere, by recording at the first nodes of the segments."""
    pairs = zip(program.experiments, firsts, strict=True)
    return replace(program, segments=tuple(segments_at(model, item, first) for item, first in pairs))


def cut_where_they_grow(first: IntArray, slopes: FloatArray) -> IntArray:
    """Return the first nodes of segments of which none lets differences grow by more than GROWTH.

    `slopes` (segments, states, states) are the derivatives of the ends of the segments by their starts.
    """
    return _divided(first, _growth(slopes))


def _growth(slopes: FloatArray) -> FloatArray:
    """Return (segments,) the factor by which differences grow; (segments, states, states) end by start."""
    usable = np.all(np.isfinite(slopes), axis=(1, 2))
    factor = np.ones(len(slopes))
    factor[usable] = np.max(np.abs(np.linalg.eigvals(slopes[usable])), axis=1)
    return factor


def _divided(first: IntArray, growth: FloatArray) -> IntArray:
    """Return the first nodes of segments cut into as many equal parts as their growth asks for and nodes allow."""
    parts = np.ceil(np.log(np.maximum(growth, 1.0)) / np.log(GROWTH) - 1e-9)
    parts = np.clip(parts, 1, np.diff(first))
    edges: list[FloatArray] = []
    for start, end, count in zip(first[:-1], first[1:], parts, strict=True):
        edges.append(float(start) + float(end - start) / float(count) * np.arange(int(count), dtype=np.float64))
    return np.append(np.concatenate(edges), first[-1]).astype(np.int64)
