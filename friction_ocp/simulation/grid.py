"""The time grid of one recording: nodes, substeps, inputs at every interval, and controller ticks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from friction_ocp.drive.parts import Controller

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

COMPUTE, APPLY = 1, 2

OWN_RATE = 0.05
"""Relative deviation of sampling intervals from the controller's within which both share a clock."""


@dataclass(frozen=True)
class InputSignal:
    """A recorded input on its own time axis."""

    time: FloatArray
    values: FloatArray
    zero_hold: bool


@dataclass(frozen=True)
class Grid:
    """Nodes of one recording and what drives the simulation between them."""

    time: FloatArray
    """(n,) s."""
    substeps: IntArray
    """(n,) integrator steps in each interval; the last entry is unused."""
    ticks: IntArray
    """(n,) bits COMPUTE and APPLY of a sampled controller."""
    at_start: FloatArray
    """(n, inputs) inputs at the start of each interval."""
    at_end: FloatArray
    """(n, inputs) inputs at the end of each interval."""
    at_node: FloatArray
    """(n, inputs) inputs that hold at each node."""

    @cached_property
    def dt(self) -> FloatArray:
        """(n,) interval lengths; the last is 0."""
        return np.append(np.diff(self.time), 0.0)

    @cached_property
    def steps_before(self) -> IntArray:
        """(n + 1,) integrator steps before each node; the last entry is unused."""
        return np.concatenate([[0], np.cumsum(self.substeps)])

    def between(self, k: int, share: float) -> FloatArray:
        """Return (inputs,) the inputs at a share of interval k."""
        return self.at_start[k] + share * (self.at_end[k] - self.at_start[k])

    def with_step(self, max_step: float) -> Grid:
        """Return the same nodes with integrator steps of at most `max_step` s."""
        return replace(self, substeps=_substeps(self.dt, max_step))


def _substeps(dt: FloatArray, max_step: float) -> IntArray:
    return np.maximum(1, np.ceil(dt / max_step - 1e-9)).astype(np.int64)


def controller_ticks(controller: Controller | None, samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the times at which a sampled controller computes and at which its commands are applied.

    Where the recording was sampled at the controller's own rate, its samples are the ticks: a clock that runs some
    parts per million fast or slow does not slip against the controller.
    """
    if controller is None or controller.sample_time is None:
        return np.empty(0), np.empty(0)
    start, end = float(samples[0]), float(samples[-1])
    steps = np.diff(samples)
    if np.all(np.abs(steps - controller.sample_time) < OWN_RATE * controller.sample_time):
        compute = samples
    else:
        count = int(np.floor((end - start) / controller.sample_time + 1e-9)) + 1
        compute = np.asarray(start + controller.sample_time * np.arange(count), dtype=np.float64)
    apply = np.asarray(compute + controller.delay, dtype=np.float64)
    return compute, apply[apply <= end] if controller.delay > 0 else np.empty(0)


def first_tick(controller: Controller | None, samples: FloatArray, time: float) -> float:
    """Return when a sampled controller computes first from a time on, s; that time without one, or after its last."""
    compute, _ = controller_ticks(controller, samples)
    later = compute[compute >= time - 1e-9]
    return float(later[0]) if later.size else time


def _merge(times: list[FloatArray], tolerance: float) -> FloatArray:
    merged = np.unique(np.concatenate(times))
    keep = np.append(True, np.diff(merged) > tolerance)
    return merged[keep]


def build_grid(
    samples: FloatArray,
    inputs: list[InputSignal],
    controller: Controller | None,
    max_step: float,
) -> Grid:
    """Lay nodes at all sample times, controller ticks and jumps of held inputs.

    `samples` (n,) s are the times at which outputs are needed; `max_step` s bounds the integrator step.
    """
    start, end = float(samples[0]), float(samples[-1])
    compute, apply = controller_ticks(controller, samples)
    jumps = [signal.time for signal in inputs if signal.zero_hold]
    inside = [times[(times >= start) & (times <= end)] for times in (samples, compute, apply, *jumps)]
    tolerance = 1e-9 * max(end - start, 1e-6)
    time = _merge(inside, tolerance)
    dt = np.append(np.diff(time), 0.0)
    starts, ends, nodes = (_sample(inputs, time, kind, tolerance) for kind in ("start", "end", "node"))
    return Grid(
        time=time,
        substeps=_substeps(dt, max_step),
        ticks=(_marks(time, compute, tolerance) * COMPUTE + _marks(time, apply, tolerance) * APPLY).astype(np.int64),
        at_start=starts,
        at_end=ends,
        at_node=nodes,
    )


def _marks(time: FloatArray, events: FloatArray, tolerance: float) -> IntArray:
    marks = np.zeros(time.size, dtype=np.int64)
    if events.size:
        at = np.clip(np.searchsorted(time, events - tolerance), 0, time.size - 1)
        near = np.abs(time[at] - events) <= tolerance
        marks[at[near]] = 1
    return marks


def _sample(inputs: list[InputSignal], time: FloatArray, kind: str, tolerance: float) -> FloatArray:
    columns = [_one_input(signal, time, kind, tolerance) for signal in inputs]
    return np.ascontiguousarray(np.column_stack(columns)) if columns else np.zeros((time.size, 0))


def _one_input(signal: InputSignal, time: FloatArray, kind: str, tolerance: float) -> FloatArray:
    known = np.isfinite(signal.values)
    axis, values = signal.time[known], signal.values[known]
    if not signal.zero_hold:
        interpolated = np.interp(time, axis, values)
        return np.append(interpolated[1:], interpolated[-1]) if kind == "end" else interpolated
    index = np.searchsorted(axis, time + tolerance, side="right") - 1
    return values[np.clip(index, 0, axis.size - 1)]
