"""One recording made ready for estimation: its time grid, its samples at the nodes, its smoothed motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from friction_ocp.drive.holding import prescribed_accelerations, undetermined_at_rest
from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.parts import Channel
from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.noise import step_of
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.recording.conditioning import high_frequency_noise, reach_of_ends, smooth_motion
from friction_ocp.recording.recording import Recording
from friction_ocp.recording.repeats import repeated
from friction_ocp.recording.sampling import known_span
from friction_ocp.simulation.grid import BoolArray, FloatArray, Grid, InputSignal, IntArray, build_grid, first_tick

STILL, NOISE_OF_REST = 1e-3, 3.0
"""Share of the greatest speed, and standard deviations of its noise, up to which a prescribed speed has no sign."""
MOST_LOST = 0.1
"""Share of a prescribed motion that is left out at an end at most, where noise hides its acceleration."""


COLUMNS = ("measured", "smooth", "rate", "curvature", "lost", "repeated")
"""What an experiment holds of every output at every node."""


@dataclass(frozen=True)
class Experiment:
    """What the estimator needs of one recording."""

    name: str
    grid: Grid
    measured: FloatArray
    """(n, outputs) samples at the nodes, NaN where there is none."""
    smooth: FloatArray
    """(n, outputs) smoothed samples."""
    rate: FloatArray
    """(n, outputs) time derivatives of the smoothed samples."""
    curvature: FloatArray
    """(n, outputs) their second time derivatives."""
    lost: BoolArray
    """(n, outputs) where there was a sample before late channels were read earlier, and is none now."""
    repeated: BoolArray
    """(n, outputs) where a sample has the error of rounding of others, which tell what it would, once `marked`."""
    late: Mapping[str, float] = field(default_factory=dict[str, float])
    """By channel: the part of its delay, s, that is undone by reading its samples earlier."""

    def signals(self, nodes: IntArray | int | slice) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return what makes a state of the measurement: smoothed outputs, two derivatives of them, and inputs."""
        return self.smooth[nodes], self.rate[nodes], self.curvature[nodes], self.grid.at_node[nodes]

    def marked(self, outputs: Sequence[Channel]) -> Experiment:
        """Return the recording with its samples marked whose errors of rounding others have, too.

        That takes longer than to lay a grid, and few programs ask for it.
        """
        found = np.zeros(self.measured.shape, dtype=bool)
        for k, channel in enumerate(outputs):
            seen = np.isfinite(self.measured[:, k])
            values = self.measured[seen, k]
            step = step_of(channel, values)
            if step is not None:
                found[seen, k] = repeated(values, step)
        return replace(self, repeated=found)

    def told_once(self) -> Experiment:
        """Return the recording without the samples that are marked."""
        measured = np.where(self.repeated, np.nan, self.measured)
        return replace(self, measured=measured, lost=self.lost & ~self.repeated)


def known_delay(channel: Channel) -> float:
    """Return a delay that is a plain number, to be undone exactly by shifting the clock; 0 for a fitted one."""
    return float(channel.delay) if isinstance(channel.delay, (int, float)) else 0.0


def experiment(use: RecordingUse, drive: SteppedDrive, inputs: tuple[Channel, ...], max_step: float) -> Experiment:
    """Lay the grid of a recording and put its samples on it.

    Raises FrictionOcpError where the recording lacks a channel.
    """
    recording = use.recording
    outputs = drive.mechanism.drive.outputs
    missing = [channel.name for channel in (*inputs, *outputs) if channel.name not in recording.channels]
    if missing:
        there = ", ".join(recording.channels)
        raise FrictionOcpError(
            [Finding(recording.name, f"the recording has no channel '{name}'", f"it has {there}") for name in missing]
        )
    signals = [_input_signal(use, channel) for channel in inputs]
    samples = np.unique(np.concatenate([recording.channels[channel.name].time for channel in outputs]))
    known = {channel.name: signal for channel, signal in zip(inputs, signals, strict=True)}
    samples = _while_driven(
        samples, drive, {item.name: known[item.name] for item in inputs if item.is_driving}, use.name
    )
    laid = _model_inputs(signals, inputs, drive, _clock(recording))
    grid = build_grid(samples, laid, drive.mechanism.drive.controller, max_step)
    columns = [_on_nodes(grid, use, channel.name) for channel in outputs]
    for k, speed_of in undetermined_at_rest(drive.mechanism).items():
        columns[k] = np.where(_near_rest(grid, drive, speed_of, use), np.nan, columns[k])
    for k, moved_by in prescribed_accelerations(drive.mechanism).items():
        columns[k] = np.where(_beside_ends(grid, known[moved_by]), np.nan, columns[k])
    motions = [_smooth(grid, use, channel.name) for channel in outputs]
    return Experiment(
        name=use.name,
        grid=grid,
        measured=np.column_stack(columns),
        smooth=np.column_stack([value for value, _, _ in motions]),
        rate=np.column_stack([rate for _, rate, _ in motions]),
        curvature=np.column_stack([bend for _, _, bend in motions]),
        lost=np.zeros((grid.time.size, len(columns)), dtype=bool),
        repeated=np.zeros((grid.time.size, len(columns)), dtype=bool),
    )


def with_inputs(item: Experiment, known: Sequence[str], wanted: Sequence[str], recording: Recording) -> Experiment:
    """Return an experiment whose grid holds the inputs `wanted` in their order: those `known`, and the time."""
    if tuple(known) == tuple(wanted):
        return item
    grid, start = item.grid, recording.zero
    ends = np.append(grid.time[1:], grid.time[-1])
    clocks = {"at_start": grid.time - start, "at_end": ends - start, "at_node": grid.time - start}
    columns = {
        key: np.column_stack([clock if name == TIME else getattr(grid, key)[:, known.index(name)] for name in wanted])
        for key, clock in clocks.items()
    }
    laid = {key: np.ascontiguousarray(values, dtype=np.float64) for key, values in columns.items()}
    return replace(item, grid=replace(grid, **laid))


def _input_signal(use: RecordingUse, channel: Channel) -> InputSignal:
    recorded = use.recording.channels[channel.name]
    return InputSignal(recorded.time - known_delay(channel), recorded.values, channel.hold == "zero")


def _while_driven(
    samples: FloatArray, drive: SteppedDrive, driving: Mapping[str, InputSignal], name: str
) -> FloatArray:
    """Return the sample times at which all that moves the machine is known; a sampled controller computes at the first.

    What is held at the ends is not known there. Raises FrictionOcpError where that leaves no two samples.
    """
    if not driving or not samples.size:
        return samples
    spans = {key: known_span(item.time[np.isfinite(item.values)], item.zero_hold) for key, item in driving.items()}
    begin, end = max(span[0] for span in spans.values()), min(span[1] for span in spans.values())
    if begin <= samples[0] and end >= samples[-1]:
        return samples
    begin = first_tick(drive.mechanism.drive.controller, samples, begin)
    kept = samples[(samples >= begin) & (samples <= end)]
    if kept.size < 2:
        known = ", ".join(f"'{key}' from {first:.4f} s to {last:.4f} s" for key, (first, last) in spans.items())
        what = f"nothing is measured while it is known what moves the machine: {known}"
        allowed = f"outputs are recorded from {samples[0]:.4f} s to {samples[-1]:.4f} s"
        raise FrictionOcpError(Finding(name, what, allowed, "correct the time axes, or state a clock with its offset"))
    return kept


def _clock(recording: Recording) -> InputSignal:
    """Return the time since the start of a recording as an input."""
    times = [channel.time for channel in recording.channels.values() if channel.time.size]
    ends = np.array([min(time[0] for time in times), max(time[-1] for time in times)])
    return InputSignal(ends, ends - recording.zero, False)


def _model_inputs(
    signals: list[InputSignal], inputs: tuple[Channel, ...], drive: SteppedDrive, clock: InputSignal
) -> list[InputSignal]:
    """Add the time and the derivatives of inputs that prescribe a motion, in the order of the model's inputs."""
    by_name = {channel.name: signal for channel, signal in zip(inputs, signals, strict=True)}

    @cache
    def smooth(name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        return smooth_motion(by_name[name].time, by_name[name].values)

    laid: list[InputSignal] = []
    for name in drive.input_names:
        if name == TIME:
            laid.append(clock)
        elif name.endswith("'"):
            plain = name.rstrip("'")
            source, motion = by_name[plain], smooth(plain)
            laid.append(InputSignal(source.time[np.isfinite(source.values)], motion[len(name) - len(plain)], False))
        else:
            laid.append(by_name[name])
    return laid


def _beside_ends(grid: Grid, motion: InputSignal) -> BoolArray:
    """Return (n,) whether a node is so near an end of a prescribed motion that its acceleration is not known there."""
    length = float(motion.time[-1] - motion.time[0])
    reach = min(reach_of_ends(motion.time, motion.values), MOST_LOST * length)
    return (grid.time < motion.time[0] + reach) | (grid.time > motion.time[-1] - reach)


def _near_rest(grid: Grid, drive: SteppedDrive, speed_of: str, use: RecordingUse) -> npt.NDArray[np.bool_]:
    """Return (n,) whether a prescribed speed at a node, or beside it, cannot be told from zero."""
    speed = np.abs(grid.at_node[:, drive.input_names.index(speed_of)])
    level = STILL * float(np.nanmax(speed, initial=0.0))
    if not speed_of.endswith("'"):
        recorded = use.recording.channels[speed_of]
        level = max(level, NOISE_OF_REST * high_frequency_noise(recorded.time, recorded.values))
    still = ~(speed > level)
    return still | np.append(still[1:], False) | np.append(False, still[:-1])


def _on_nodes(grid: Grid, use: RecordingUse, name: str) -> FloatArray:
    channel = use.recording.channels[name]
    column = np.full(grid.time.size, np.nan)
    on_it = (channel.time >= grid.time[0] - 1e-9) & (channel.time <= grid.time[-1] + 1e-9)
    at = np.clip(np.searchsorted(grid.time, channel.time[on_it] - 1e-9), 0, grid.time.size - 1)
    column[at] = channel.values[on_it]
    return column


def _smooth(grid: Grid, use: RecordingUse, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    channel = use.recording.channels[name]
    motion = smooth_motion(channel.time, channel.values)
    value, rate, bend = (np.interp(grid.time, channel.time, part) for part in motion)
    return value, rate, bend
