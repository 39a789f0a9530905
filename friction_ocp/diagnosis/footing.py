"""What stays the same while models compete: noise of channels and inputs, and how recordings are cut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from friction_ocp.diagnosis.excerpts import cut_out, excerpts
from friction_ocp.diagnosis.jumps import without_jumps
from friction_ocp.estimation.drive_noise import TorqueNoise, input_impulses, torque_noise, within
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gap import start_weight
from friction_ocp.estimation.horizon import is_held
from friction_ocp.estimation.model import Model, seen_by
from friction_ocp.estimation.node_gaps import NodeGaps
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.estimation.stages import measured_from, windows
from friction_ocp.estimation.torque_noise import MOST_SEGMENTS, SHORTEST
from friction_ocp.estimation.unknown_noise import unknown_noise_program
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.losses import AbstractLoss, Squares

FOLDS = 4
"""Pieces of a single training recording, to leave out one at a time."""
LONGEST, MOST_CUTS = 50, 200
"""Samples in a segment, and intervals of doubtful torque in one recording that are cut out; more cost time."""
WITHIN = 0.01
"""Variance that torque noise may add within a segment over that of a channel. What it does there counts as noise of the
channel, and again in the gap behind: with as much as the channel's own, slow torques look twice as certain as they
are."""


@dataclass(frozen=True)
class Footing(TorqueNoise):
    """Noise and cuts, from the recordings and the base model, the same for every model that is compared."""

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
        width = 0.0 * model.speed_scale
        if self.noisy_inputs:
            known = (self.noisy_inputs, experiments, self.noise, width, self.loss)
            return unknown_noise_program(model, self, *known)
        segments = tuple(self._segments(model, item) for item in experiments)
        return Program(model.space, model.drive, model.sweep, experiments, segments, self.noise, width, self.loss)

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
        first = cuts(item, self.segment_s)
        if impulses:
            total = sum(np.square(values) for values in impulses.values())
            first = with_cuts(first, np.asarray(total))
        further = np.flatnonzero(np.isin(item.grid.time, self.divided.get(item.name, ())))
        first = np.unique(np.concatenate([first, further[further < first[-1]]])).astype(np.int64)
        start = np.zeros((len(first) - 1, model.state_scale.size))
        start[0] = start_weight(model, item)
        weights = NodeGaps(model, self, item, first, impulses).roots()
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


def with_cuts(first: IntArray, power: FloatArray) -> IntArray:
    """Add cuts around the intervals whose torque is most in doubt, so that nothing else bears it."""
    largest = np.argsort(power)[::-1][:MOST_CUTS]
    doubtful = largest[power[largest] > 0]
    return np.unique(np.concatenate([first, doubtful, doubtful + 1]).clip(0, first[-1])).astype(np.int64)


def _segment_length(model: Model, foot: Footing, item: Experiment) -> float:
    """Return the longest segments, s, in which torque noise hardly moves a channel."""
    step = float(np.median(np.diff(item.grid.time)))
    lengths = np.unique(np.geomspace(SHORTEST, LONGEST, 12).round()) * step
    fitting = [
        length for length in lengths if np.all(within(model, foot, item, float(length)) <= WITHIN * model.noise**2)
    ]
    return float(max(fitting, default=lengths[0]))
