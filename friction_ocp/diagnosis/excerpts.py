"""What of long logs a search goes by: the stretches that show most of what the machine did.

A search fits dozens of models, and a log of an hour tells it little more than a few minutes that hold the same motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.experiment import COLUMNS, Experiment
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.simulation.grid import FloatArray, IntArray

MOST_SAMPLES, FEWEST_SAMPLES = 30_000, 1_000
"""Samples of the training recordings that a search goes by, and the least that may be stated."""
SPANS = 12
"""Stretches that are chosen at least: slow and fast motion are seldom in the same one."""
SHORTEST = 200
"""Samples in a stretch at least."""
POINTS = 128
"""Points of a stretch that are looked at."""
BINS, PAIR_BINS, PARTS = 12, 6, 4
"""Intervals of a variable, of each of two variables together, and of the time of a recording."""


def samples_of(problem: Problem) -> float:
    """Return how many samples the search goes by at most; raises FrictionOcpError where that is no number."""
    stated = problem.diagnosis.get("samples", MOST_SAMPLES)
    if not isinstance(stated, (int, float)) or isinstance(stated, bool) or not stated >= FEWEST_SAMPLES:
        allowed = f"a number, {FEWEST_SAMPLES} or more; .inf means all"
        where = f"{problem.path or problem.title}: diagnosis.samples"
        raise FrictionOcpError(Finding(where, f"this is {stated!r}", allowed))
    return float(stated)


@dataclass(frozen=True)
class Stretch:
    """A stretch of a training recording, from one sample on and before another."""

    recording: int
    begin: int
    end: int


def cut_out(item: Experiment, begin: int, end: int) -> Experiment:
    """Return the nodes of a recording from one on and before another; the piece keeps its name and begins afresh."""
    at = slice(begin, end)
    grid = replace(item.grid, **{part.name: getattr(item.grid, part.name)[at] for part in fields(item.grid)})
    return replace(item, grid=grid, **{name: getattr(item, name)[at] for name in COLUMNS})


def excerpts(model: Model) -> tuple[Experiment, ...]:
    """Return the training recordings, or of long ones pieces that keep their names: the same for all that compete.

    Pieces are chosen by what was recorded alone, whatever a model reads later or earlier.
    """
    sizes = [item.grid.time.size for item in model.train]
    if sum(sizes) <= samples_of(model.problem):
        return model.train
    chosen = _merged(_chosen(model.problem, sizes))
    return tuple(cut_out(model.train[item.recording], item.begin, item.end) for item in chosen)


def _chosen(problem: Problem, sizes: Sequence[int]) -> list[Stretch]:
    """Return the stretches in which variables and pairs of them visit their ranges most evenly, some of each recording.

    What a stretch is worth is the sum over all intervals of the root of how often they are visited: the first visits
    count most. Each choice adds most to those before it.
    """
    most = samples_of(problem)
    length = max(int(most) // max(SPANS, len(sizes)), SHORTEST)
    cut = [
        Stretch(k, begin, min(begin + length, size))
        for k, size in enumerate(sizes)
        for begin in range(0, max(size - length // 2, 1), length)
    ]
    visits = _visits(problem, sizes, cut)
    owner, known = np.array([item.recording for item in cut]), np.zeros(visits.shape[1])
    free, chosen = np.ones(len(cut), dtype=bool), list[Stretch]()
    for turn in range(max(int(most) // length, len(sizes))):
        open_now = free & (owner == turn) if turn < len(sizes) else free
        if not open_now.any():
            continue
        worth = np.where(open_now, np.sum(np.sqrt(known + visits), axis=1), -np.inf)
        best = int(np.argmax(worth))
        free[best], known = False, known + visits[best]
        chosen.append(cut[best])
    return chosen


def _merged(chosen: Sequence[Stretch]) -> list[Stretch]:
    """Return stretches in the order of the recordings, neighbours as one."""
    found = list[Stretch]()
    for item in sorted(chosen, key=lambda each: (each.recording, each.begin)):
        if found and (found[-1].recording, found[-1].end) == (item.recording, item.begin):
            found[-1] = replace(found[-1], end=item.end)
        else:
            found.append(item)
    return found


def _visits(problem: Problem, sizes: Sequence[int], cut: Sequence[Stretch]) -> FloatArray:
    """Return (stretches, intervals) how many of its points lie in each interval."""
    own = [[item for item in cut if item.recording == k] for k in range(len(sizes))]
    points = np.concatenate([_points(problem, problem.train[k], size, own[k]) for k, size in enumerate(sizes)])
    low, high = points.min(axis=0), points.max(axis=0)
    place = (points - low) / np.maximum(high - low, 1e-300)
    stretch = np.repeat(np.arange(len(cut)), POINTS - 1)
    parts = np.array([item.recording * PARTS + PARTS * item.begin // sizes[item.recording] for item in cut])[stretch]
    found = [_counted(stretch, parts, len(cut))]
    single, double = ((place * count).astype(np.int64).clip(0, count - 1) for count in (BINS, PAIR_BINS))
    found += [_counted(stretch, column, len(cut)) for column in single.T]
    pairs = combinations(double.T, 2)
    found += [_counted(stretch, one * PAIR_BINS + other, len(cut)) for one, other in pairs]
    return np.concatenate(found, axis=1)


def _counted(stretch: IntArray, interval: IntArray, count: int) -> FloatArray:
    found = np.zeros((count, int(interval.max()) + 1))
    np.add.at(found, (stretch, interval), 1.0)
    return found


def _points(problem: Problem, use: RecordingUse, size: int, cut: Sequence[Stretch]) -> FloatArray:
    """Return (points, variables) what channels of a recording show along stretches, and how fast angles change."""
    drive, known = problem.drive, use.recording.channels
    clocks = [known[channel.name].time for channel in drive.outputs]
    begin, end = min(float(clock[0]) for clock in clocks), max(float(clock[-1]) for clock in clocks)
    along = np.stack([np.linspace(item.begin, item.end, POINTS) for item in cut])
    time = begin + (end - begin) * along / size
    columns = list[FloatArray]()
    for channel in (*drive.inputs, *drive.outputs):
        seen = np.isfinite(known[channel.name].values)
        stamps, values = known[channel.name].time[seen], known[channel.name].values[seen]
        passed = np.interp(time, stamps, values) if values.size else np.zeros(time.shape)
        columns.append(passed[:, 1:].ravel())
        if channel.signal == "theta":
            columns.append(np.diff(passed, axis=1).ravel())
    return np.column_stack(columns)
