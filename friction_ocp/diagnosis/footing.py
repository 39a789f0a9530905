"""What stays the same while models compete: noise of channels and inputs, and how recordings are cut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import casadi as ca
import numpy as np

from friction_ocp.diagnosis.excerpts import cut_out, excerpts
from friction_ocp.diagnosis.gathered_noise import alike, motions_of, slopes_about, unit_covariances
from friction_ocp.diagnosis.noisy_nodes import sampled, with_noise
from friction_ocp.diagnosis.standstill import without_jumps
from friction_ocp.drive.mechanism import Mechanism
from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gap import acceleration_noise, start_weight
from friction_ocp.estimation.horizon import is_held
from friction_ocp.estimation.model import Model, seen_by
from friction_ocp.estimation.noise import noise_floor
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.estimation.stages import measured_from, windows
from friction_ocp.estimation.torque_noise import (
    MOST_SEGMENTS,
    QUARTERS,
    SHORTEST,
    driving,
    input_power,
    seen_variance,
    shown_speed,
    speed_ratio,
)
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.losses import AbstractLoss, Squares
from friction_ocp.simulation.sweep import sweep_of

FOLDS = 4
"""Pieces of a single training recording, to leave out one at a time."""
LONGEST, MOST_CUTS = 50, 200
"""Samples in a segment, and intervals of doubtful torque in one recording that are cut out; more cost time."""
WITHIN = 0.01
"""Variance that torque noise may add within a segment over that of a channel. What it does there counts as noise of the
channel, and again in the gap behind: with as much as the channel's own, slow torques look twice as certain as they
are."""
NUMERICAL_INPUT = 1e-3
"""Error of a measured input over its rms, sample by sample, that a simulation between samples makes anyway."""
MORE_THAN_ALL = 1.2
"""What high frequencies tell of noise, over the rms of all that was measured, above which it is no noise: white noise
alone tells 1, give or take what chance does to few samples."""
SMOOTH = 4.0 * np.sqrt(6.0)
"""Second difference over the noise of an input above which it jumps: four deviations of what noise alone bends."""
STILL_GAP, LOOSE_GAP = 1e-5, 1e-3
"""Gap over the typical size of a state that no noise enters, and the most for a deflection."""
QUIET_GAP = 0.01
"""Torque of such a jump over that of the noise of a sample, where noise is told from sample to sample."""
NEGLIGIBLE_GAP = 0.1
"""Gap over the noise floor that stands for a state that no noise enters."""


@dataclass(frozen=True)
class Footing:
    """Noise and cuts, from the recordings and the base model, the same for every model that is compared."""

    density: Mapping[str, float]
    """Torque noise by shaft, N m/sqrt(Hz): what is stated, and what noise of the measured inputs makes."""
    numbers: Mapping[str, Mapping[str, float]]
    """By recording: the numbers of the base model, with which noise of torque becomes noise of motion."""
    segment_s: float | None
    """Length of the segments; None is the free run over whole recordings."""
    noise: FloatArray
    """(outputs,) noise floors with what torque noise adds within a segment."""
    train: tuple[Experiment, ...]
    """Training recordings, or pieces of the only one, with the inputs of the base model."""
    inputs: tuple[str, ...]
    """Names of the inputs of the base model."""
    loss: AbstractLoss = Squares()
    """Of measurement errors: the one that the problem asks for where free runs are compared."""
    divided: Mapping[str, tuple[float, ...]] = field(default_factory=dict[str, tuple[float, ...]])
    """By recording: times of further cuts, s."""
    predicted: bool = False
    """Whether models are compared by short predictions, each from the measured motion, instead."""
    noisy_inputs: tuple[str, ...] = ()
    """Inputs whose noise is an unknown of every sample; where there are such, a segment is one sample."""

    @property
    def joined(self) -> bool:
        """Whether segments begin where the best nodes are, and torque noise joins them."""
        return self.segment_s is not None and not self.predicted

    def program(self, model: Model, experiments: tuple[Experiment, ...]) -> Program:
        """Return the likelihood of some recordings under a model, as a least-squares program."""
        segments = tuple(self._segments(model, item) for item in experiments)
        width, drive, sweep = 0.0 * model.speed_scale, model.drive, model.sweep
        if self.noisy_inputs:
            sweep = sweep_of(model.problem.drive, sweep.active, noisy=self.noisy_inputs)
            drive, inputs = sweep.drive, model.problem.drive.inputs
            known = {item.name: input_noise(model, item)[0] for item in inputs if item.name in self.noisy_inputs}
            pairs = zip(experiments, segments, strict=True)
            segments = tuple(with_noise(drive, item, cut, known) for item, cut in pairs)
            experiments = tuple(item.told_once() for item in experiments)
        return Program(model.space, drive, sweep, experiments, segments, self.noise, width, self.loss)

    def training(self, model: Model) -> Program:
        """Return the likelihood of training recordings and static points; the grids are those of the model."""
        return replace(self.program(model, self.training_items(model)), static=model.static)

    def training_items(self, model: Model) -> tuple[Experiment, ...]:
        """Return the training recordings with the inputs and the steps of a model."""
        return tuple(self._regridded(item, model) for item in self.train)

    def _regridded(self, item: Experiment, model: Model) -> Experiment:
        stepped = replace(item, grid=item.grid.with_step(model.max_step))
        return seen_by(model, model.drive, stepped, self.inputs)

    def _segments(self, model: Model, item: Experiment) -> Segments:
        if self.predicted:
            return measured_from(item)
        impulses = {} if self.segment_s is None else input_impulses(model, item, self.numbers[item.name])
        first = sampled(item) if self.noisy_inputs else cuts(item, self.segment_s)
        if impulses:
            total = sum(np.square(values) for values in impulses.values())
            first = with_cuts(first, np.asarray(total))
        further = np.flatnonzero(np.isin(item.grid.time, self.divided.get(item.name, ())))
        first = np.unique(np.concatenate([first, further[further < first[-1]]])).astype(np.int64)
        start = np.zeros((len(first) - 1, model.state_scale.size))
        start[0] = start_weight(model, item)
        quiet = replace(self, density={}) if self.noisy_inputs else None
        weights = gap_roots(model, self, item, first, impulses, quiet)
        if model.problem.estimation.initial_state == "measured":
            return Segments(first, weights, measured=1)
        return Segments(first, weights, start_weight=start)


def cuts(item: Experiment, seconds: float | None) -> IntArray:
    """Return the first nodes of segments of about `seconds`, the last node behind them."""
    return windows(item, None if seconds is None else max(seconds, _shortest(item)))


def _shortest(item: Experiment) -> float:
    """Return the length of segments, s, of which a recording has as many as it may have."""
    return float(item.grid.time[-1] - item.grid.time[0]) / MOST_SEGMENTS


def pieces(item: Experiment, count: int) -> list[Experiment]:
    """Cut a recording into pieces that begin afresh; they keep its name."""
    edges = [round(edge) for edge in np.linspace(0, item.grid.time.size - 1, count + 1).tolist()]
    return [cut_out(item, begin, end + 1) for begin, end in pairwise(edges)]


def training_pieces(model: Model) -> tuple[Experiment, ...]:
    """Return what the search goes by of the training recordings, without samples beside jumps: of one piece, pieces.

    Samples that share their errors of rounding are marked.
    """
    first, *others = known = excerpts(model)
    whole = known if others else tuple(pieces(first, FOLDS))
    outputs = model.drive.mechanism.drive.outputs
    return tuple(without_jumps(item, outputs, model.noise).marked(outputs) for item in whole)


def footing(model: Model, theta: FloatArray, loss: AbstractLoss = Squares()) -> Footing:
    """Return the common footing of all models, from the base model at `theta`; `loss` is that of free runs."""
    first, train = model.train[0], training_pieces(model)
    numbers = {use.name: model.space.numbers_by_path(theta, use.name) for use in model.problem.recordings}
    density = torque_noise(model, numbers[first.name])
    if is_held(model.problem.drive) and not any(density.values()):
        return Footing(density, numbers, None, model.noise, train, model.drive.input_names, loss)
    bare = Footing(density, numbers, None, model.noise, train, model.drive.input_names)
    seconds = max(_segment_length(model, bare, first), *map(_shortest, train))
    inflated = np.sqrt(model.noise**2 + within(model, bare, first, seconds))
    return Footing(density, numbers, seconds, inflated, train, model.drive.input_names)


def torque_noise(model: Model, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the density of torque noise by shaft, N m/sqrt(Hz): stated, and from the noise of measured inputs.

    Noise that is to be estimated counts for nothing here: it would take in the gap.
    """
    options = model.problem.estimation
    stated = options.process_noise.keys() - set(options.estimated_noise)
    power = {shaft: options.process_noise[shaft] ** 2 for shaft in sorted(stated)}
    for shaft, value in input_power(model.problem.drive, numbers, partial(input_noise, model)).items():
        power[shaft] = power.get(shaft, 0.0) + value
    return {shaft: float(np.sqrt(value)) for shaft, value in power.items()}


def input_noise(model: Model, channel: Channel) -> tuple[float, float]:
    """Return the noise floor of an input and its sampling interval.

    High frequencies of an input that a loop throws from one end to the other, sample by sample, are its motion.
    """
    signals = [use.recording.channels[channel.name] for use in model.problem.recordings]
    step = float(np.median(np.diff(signals[0].time)))
    size = max(float(np.sqrt(np.nanmean(item.values**2))) for item in signals)
    floor = noise_floor(channel, [(item.time, item.values) for item in signals])
    known = 0.0 if floor.source == "high_frequency" and floor.std > MORE_THAN_ALL * size else floor.std
    return max(known, NUMERICAL_INPUT * size), step


def group_inertias(mech: Mechanism, numbers: Mapping[str, float]) -> FloatArray:
    """Return the inertia of every group at given numbers."""
    inertias = ca.vertcat(*[ca.SX(mech.inertia(g)) for g in range(len(mech.topology.roots))])
    function = ca.Function("inertia", list(mech.parameters.values()), [inertias])
    return np.asarray(function(*(numbers.get(name, 1.0) for name in mech.parameters))).ravel()


def group_density(model: Model, foot: Footing, recording: str) -> FloatArray:
    """Return the density of the acceleration noise of every group, rad/s^2/sqrt(Hz)."""
    mech = model.drive.mechanism
    numbers = _known_numbers(model, foot, recording)
    values = np.array([numbers.get(name, 1.0) for name in mech.parameters])
    return acceleration_noise(mech, foot.density, values)


def gap_roots(
    model: Model,
    foot: Footing,
    item: Experiment,
    first: IntArray,
    impulses: Mapping[str, FloatArray],
    moving: Footing | None = None,
) -> FloatArray:
    """Return (gaps, states, states) W with W'W the inverse covariance of each gap.

    Torque noise makes the states wander, more so where an input jumps between two samples; states that no noise
    enters may jump by a share of the noise floor, and deflections by what torque noise makes of their torque.
    `moving` holds the torque noise, and the inertias that it moves, where these are not those of the footing.
    """
    mover = foot if moving is None else moving
    spans = np.diff(item.grid.time[first])
    states = len(model.drive.state_names)
    if spans.size < 2:
        return np.zeros((0, states, states))
    numbers = _leaf_numbers(model, foot, item.name)
    distinct, motions, which = alike(spans, motions_of(model, numbers, item, (first[:-1] + first[1:]) // 2))
    slopes = slopes_about(model, numbers, np.concatenate([motions, np.zeros((1, states))]))
    units = unit_covariances(model, slopes[:-1], distinct)
    still = still_gaps(model, foot, item.name, float(np.median(spans)), slopes[-1])
    power = group_density(model, mover, item.name)[:, None] ** 2 + _jump_power(model, mover, item, first, impulses)
    covariance: FloatArray = np.einsum("gs,gsij->sij", power, units[:, which]) + np.diag(still**2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance[:-1])), dtype=np.float64)


def _jump_power(
    model: Model, foot: Footing, item: Experiment, first: IntArray, impulses: Mapping[str, FloatArray]
) -> FloatArray:
    """Return (groups, segments) the power density of acceleration that jumps of inputs may hide."""
    mech = model.drive.mechanism
    inertias = group_inertias(mech, _known_numbers(model, foot, item.name))
    spans = np.diff(item.grid.time[first])
    power = np.zeros((len(inertias), spans.size))
    for shaft, values in impulses.items():
        group = mech.topology.group_of[shaft]
        ratio = speed_ratio(mech, foot.numbers[item.name], shaft) / max(float(inertias[group]), 1e-300)
        power[group] += np.add.reduceat(values**2, first[:-1]) * ratio**2 / spans
    return power


def _leaf_numbers(model: Model, foot: Footing, recording: str) -> FloatArray:
    """Return the numbers of the drive in the order of the model functions."""
    numbers = _known_numbers(model, foot, recording)
    return np.array([numbers[name] for name in model.space.leaf_names])


def _known_numbers(model: Model, foot: Footing, recording: str) -> dict[str, float]:
    return {**model.space.numbers_by_path(model.space.guess, recording), **foot.numbers[recording]}


def input_impulses(model: Model, item: Experiment, numbers: Mapping[str, float]) -> dict[str, FloatArray]:
    """Return by shaft (n,) N m s: how far the torque of each interval may be off because an input jumps inside it.

    A jump at an unknown instant between two samples that are joined by a line leaves its size times the interval
    over sqrt(12); what bends less than noise would bend counts as smooth.
    """
    found: dict[str, FloatArray] = {}
    for shaft, channel, factor in driving(model.problem.drive, numbers):
        if channel.hold == "zero":
            continue
        column = model.drive.input_names.index(channel.name)
        bend = np.abs(np.diff(item.grid.at_node[:, column], 2, prepend=np.nan, append=np.nan))
        std, _ = input_noise(model, channel)
        jump = np.fmax(bend, np.append(bend[1:], np.nan))
        jump = np.where(jump > SMOOTH * std, np.nan_to_num(jump), 0.0)
        impulse = factor * jump * item.grid.dt / np.sqrt(12.0)
        found[shaft] = np.hypot(found.get(shaft, 0.0), impulse)
    return found


def with_cuts(first: IntArray, power: FloatArray) -> IntArray:
    """Add cuts around the intervals whose torque is most in doubt, so that nothing else bears it."""
    largest = np.argsort(power)[::-1][:MOST_CUTS]
    doubtful = largest[power[largest] > 0]
    return np.unique(np.concatenate([first, doubtful, doubtful + 1]).clip(0, first[-1])).astype(np.int64)


def still_gaps(model: Model, foot: Footing, recording: str, span: float, slopes: FloatArray) -> FloatArray:
    """Return (states,) how far states may jump that no noise enters: less than the channels can see.

    `slopes` (states, states) say how the rates depend on the states at rest.
    """
    mech = model.drive.mechanism
    size = STILL_GAP * model.state_scale
    deflected = mech.columns((*mech.bristle_names, *mech.loop_names))
    if deflected:
        loose = _loose_gaps(model, foot, recording, span, slopes[:, deflected])
        size[deflected] = np.clip(loose, size[deflected], LOOSE_GAP * model.state_scale[deflected])
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part)
        if group is None or channel.signal not in ("theta", "omega"):
            continue
        ratio = abs(shown_speed(mech, foot.numbers[recording], channel))
        floor = NEGLIGIBLE_GAP * float(model.noise[k]) / max(ratio, 1e-300)
        names = {f"{mech.topology.roots[group]}.theta": floor, f"{mech.topology.roots[group]}.omega": floor / span}
        for state, limit in names.items():
            if state in model.drive.state_names:
                at = model.drive.state_names.index(state)
                size[at] = min(size[at], limit)
    if foot.noisy_inputs:
        size = np.minimum(size, QUIET_GAP * _loose_gaps(model, foot, recording, span, slopes))
    return np.maximum(size, 1e-12 * model.state_scale)


def _loose_gaps(model: Model, foot: Footing, recording: str, span: float, slopes: FloatArray) -> FloatArray:
    """Return (k,) how far states may jump, deflections of bristles and loops above all, which `slopes` (states, k) show
    in the rates.

    As far as changes the power of their torque, at typical speeds, by that of torque noise over a segment: a stiffness
    that changes moves them all, and does so in steps as long as gaps let it.
    """
    mech = model.drive.mechanism
    moved, speeds = list(mech.free_groups), len(mech.angle_groups) + np.arange(len(mech.free_groups))
    momentum = group_inertias(mech, _known_numbers(model, foot, recording))[moved] * model.state_scale[speeds]
    noise = np.max(momentum * group_density(model, foot, recording)[moved], initial=0.0) / np.sqrt(span)
    power = np.max(momentum[:, None] * np.abs(slopes[speeds]), axis=0, initial=1e-300)
    return noise / power


def _segment_length(model: Model, foot: Footing, item: Experiment) -> float:
    """Return the longest segments, s, in which torque noise hardly moves a channel."""
    step = float(np.median(np.diff(item.grid.time)))
    lengths = np.unique(np.geomspace(SHORTEST, LONGEST, 12).round()) * step
    fitting = [
        length for length in lengths if np.all(within(model, foot, item, float(length)) <= WITHIN * model.noise**2)
    ]
    return float(max(fitting, default=lengths[0]))


def _typical_motion(model: Model, foot: Footing, item: Experiment) -> FloatArray:
    """Return (quarters, states) a motion of rms speed; rest where no bristle tells it from any other."""
    numbers = _leaf_numbers(model, foot, item.name)
    moves = motions_of(model, numbers, item, np.arange(item.grid.time.size, dtype=np.int64))
    speeds = moves[:, len(model.drive.mechanism.angle_groups) :][:, : len(model.drive.mechanism.free_groups)]
    power: FloatArray = np.sum(speeds**2, axis=1)
    return np.tile(moves[int(np.argmin(np.abs(power - np.mean(power))))], (QUARTERS.size, 1))


def within(model: Model, foot: Footing, item: Experiment, seconds: float) -> FloatArray:
    """Return (outputs,) the mean variance that torque noise adds from a known start on, over some seconds."""
    numbers, motion = _leaf_numbers(model, foot, item.name), _typical_motion(model, foot, item)
    units = unit_covariances(model, slopes_about(model, numbers, motion), seconds * QUARTERS)
    covariances: FloatArray = np.einsum("g,gsij->sij", group_density(model, foot, item.name) ** 2, units)
    return seen_variance(model.drive.mechanism, foot.numbers[item.name], covariances)
