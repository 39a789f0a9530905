"""What a sweep asks for and what it gives, and the interface of those who compute it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from friction_ocp.simulation.grid import FloatArray, Grid, IntArray
from friction_ocp.simulation.losses import AbstractLoss

DERIVATIVES = 5.0
"""What a step with derivatives counts for, in steps without them: it takes two to five times as long."""


@dataclass(frozen=True)
class Yardstick:
    """Measurements that outputs are compared with while they are simulated."""

    measured: FloatArray
    """(n, outputs), NaN where there is no sample."""
    noise: FloatArray
    """(outputs,) noise floors."""
    loss: AbstractLoss


@dataclass(frozen=True)
class SweepRequest:
    """Segments of one recording to simulate; segment j covers the grid's nodes first[j] .. first[j + 1]."""

    grid: Grid
    first: IntArray
    """(segments + 1,) first node of each segment; last the last node of the recording."""
    x0: FloatArray
    """(segments, states) state at the start of each segment."""
    p: FloatArray
    """(parameters,) all numbers of the drive."""
    width: FloatArray
    """(groups + 1,) smoothing; zeros are exact."""
    derivatives: bool = False
    with_states: bool = False
    carried: IntArray | None = None
    """States that go on where the segment before ended, the others beginning anew; without derivatives only."""
    yardstick: Yardstick | None = None
    """With it the sweep sums a score over each segment in place of keeping every derivative of its outputs."""
    with_course: bool = False
    """Whether the course of the states is wanted, where the kernel keeps it; without derivatives only."""
    course: FloatArray | None = None
    """The course that the same request has without derivatives, where it is known: it is not simulated again."""
    by_active: bool = True
    """Whether derivatives are wanted by the active parameters, and not by the states at the segments' starts alone."""


@dataclass(frozen=True)
class Score:
    """Losses of all samples of each segment; derivatives by [initial state, active parameters]."""

    cost: FloatArray
    """(segments,)."""
    gradient: FloatArray | None = None
    """(segments, columns)."""
    square: FloatArray | None = None
    """(segments, columns, columns) Gauss-Newton Hessian."""


@dataclass(frozen=True)
class SweepResult:
    """Outputs at every node and states at every segment's end; derivatives by [initial state, active parameters]."""

    y: FloatArray
    """(n, outputs); at a node that closes a segment the value of the segment that begins there."""
    end: FloatArray
    """(segments, states)."""
    dy: FloatArray | None = None
    """(n, outputs, columns): states, then active parameters where wanted; None with a yardstick."""
    dend: FloatArray | None = None
    """(segments, states, columns)."""
    states: FloatArray | None = None
    """(n, states), where asked for."""
    course: FloatArray | None = None
    """(n, states) states before the ticks of each node, where asked for and kept."""
    score: Score | None = None
    """Where there is a yardstick."""


@dataclass(frozen=True)
class Piece:
    """A request and its result, and what else is wanted of the simulation."""

    request: SweepRequest
    into: SweepResult
    """Its `dend` is a view of memory in the order (segments, columns, states)."""
    course: FloatArray | None = None
    """(n, states), to be filled with the states before the ticks of each node."""
    resets: FloatArray | None = None
    """(n, states) states from each node on, before its ticks; NaN where they go on."""
    observed: bool = True
    """Whether outputs are wanted."""

    @property
    def steps(self) -> IntArray:
        """(segments,) how many integrator steps each segment takes."""
        return np.diff(self.request.grid.steps_before[self.request.first])

    @property
    def columns(self) -> int:
        """How many columns derivatives have; 0 without."""
        return 0 if self.into.dend is None else int(self.into.dend.shape[2])

    @property
    def effort(self) -> float:
        """Integrator steps, those with derivatives as DERIVATIVES each."""
        return float(np.sum(self.steps)) * (DERIVATIVES if self.request.derivatives else 1.0)


class AbstractKernel(ABC):
    """Computes sweeps of one drive."""

    keeps_course: ClassVar[bool] = False
    """Whether it has a use for the course of the states."""

    @abstractmethod
    def run(self, pieces: Sequence[Piece], threads: int = 1) -> None:
        """Simulate pieces and fill their results, in several threads where that helps."""


def empty_result(request: SweepRequest, states: int, outputs: int, active: int) -> SweepResult:
    """Return the arrays that a kernel fills."""
    nodes, segments = request.grid.time.size, len(request.first) - 1
    columns = states + (active if request.by_active else 0)
    wanted, scored = request.derivatives, request.yardstick is not None
    return SweepResult(
        y=np.zeros((nodes, outputs)),
        end=np.empty((segments, states)),
        dy=np.zeros((nodes, outputs, columns)) if wanted and not scored else None,
        dend=np.empty((segments, columns, states)).transpose(0, 2, 1) if wanted else None,
        states=np.empty((nodes, states)) if request.with_states else None,
        score=_empty_score(segments, columns, wanted) if scored else None,
    )


def _empty_score(segments: int, columns: int, derivatives: bool) -> Score:
    if not derivatives:
        return Score(np.zeros(segments))
    return Score(np.zeros(segments), np.zeros((segments, columns)), np.zeros((segments, columns, columns)))
