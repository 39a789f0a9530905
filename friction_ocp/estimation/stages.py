"""The stages of a fit: from predictions out of measured motion, over relaxed segments, to the free run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.drive.mechanism import WARMTH
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gap import gap_weights, start_weight
from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.horizon import fits_free_run
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.simulation.grid import IntArray
from friction_ocp.simulation.losses import Absolute, AbstractLoss, Huber, Squares, StudentT

PREDICTION_SAMPLES = 20
TIED = (".friction.z", ".hysteresis.z", WARMTH)
"""States that nothing but a prior keeps in reach where a window starts."""
ROUNDINGS = (1.0, 0.2, 0.05, 0.01, 0.002, 0.0004)
"""Rounding of the absolute loss over the mean error, stage by stage."""
WIDTHS = (0.1, 0.02, 0.0)
"""Smoothing of the sign over the typical speed, stage by stage; the last is exact. Relaxed segments do without the
first: there a wide smoothing only invents slopes and breaks at low speed."""

NO_GAP = 1e-7
"""Standard deviation of a gap over the typical size of its state where segments stand for one free run."""

Experiments = tuple[Experiment, ...]


def program_of(
    model: Model, experiments: Experiments, segments: tuple[Segments, ...], width: float, loss: AbstractLoss
) -> Program:
    """Return the program of some recordings cut into `segments`."""
    return Program(
        space=model.space,
        drive=model.drive,
        sweep=model.sweep,
        experiments=experiments,
        segments=segments,
        noise=model.noise,
        width=width * model.speed_scale,
        loss=loss,
        static=model.static,
    )


def cuts(experiment: Experiment, samples: int) -> IntArray:
    """Return the first nodes of segments of `samples` intervals, the last node behind them.

    The last segment takes what remains, between half of that and one and a half.
    """
    last = experiment.grid.time.size - 1
    count = max(1, round(last / samples))
    return np.append(samples * np.arange(count), last).astype(np.int64)


def predictions(model: Model, experiments: Experiments, width: float) -> Program:
    """Return short predictions from the smoothed motion: nearly linear in the parameters, right from any start."""
    return program_of(model, experiments, tuple(map(measured_from, experiments)), width, Squares())


def measured_from(item: Experiment) -> Segments:
    """Return short segments of a recording that begin where the measured motion is."""
    first = cuts(item, PREDICTION_SAMPLES)
    return Segments(first, None, measured=len(first) - 1)


def relaxed(model: Model, experiments: Experiments, width: float, loss: AbstractLoss) -> Program:
    """Return segments joined by process noise."""
    pieces = [(item, cuts(item, model.problem.estimation.samples)) for item in experiments]
    segments = tuple(segments_at(model, item, first) for item, first in pieces)
    return program_of(model, experiments, segments, width, loss)


def segments_at(model: Model, item: Experiment, first: IntArray) -> Segments:
    """Return segments of a recording joined by process noise, from their first nodes and the one behind them."""
    return _with_start(model, item, Segments(first, gap_weights(model, item, first)))


def along_measurement(model: Model, width: float) -> Program:
    """Return short segments along the measured motion, joined as the fit joins them.

    A free run is joined by gaps of next to nothing: to first order the segments then move as one.
    """
    segments: list[Segments] = []
    for item in model.train:
        first = cuts(item, model.problem.estimation.samples)
        weight = gap_weights(model, item, first)
        if fits_free_run(model):
            weight = np.tile(np.diag(1.0 / (NO_GAP * model.state_scale)), (len(first) - 2, 1, 1))
        segments.append(_with_start(model, item, Segments(first, weight)))
    return program_of(model, model.train, tuple(segments), width, Squares())


def free_run(
    model: Model, experiments: Experiments, width: float, loss: AbstractLoss, horizon: float | None
) -> Program:
    """Return the free run over whole recordings, or over windows of `horizon` s that each start afresh."""
    segments = tuple(_with_start(model, item, Segments(windows(item, horizon), None)) for item in experiments)
    return program_of(model, experiments, segments, width, loss)


def windows(item: Experiment, horizon: float | None) -> IntArray:
    """Return the first nodes of windows of about `horizon` s; the whole recording where it is None."""
    start, end = float(item.grid.time[0]), float(item.grid.time[-1])
    count = 1 if horizon is None else max(1, round((end - start) / horizon))
    edges = np.linspace(start, end, count + 1)
    return np.unique(np.clip(np.searchsorted(item.grid.time, edges - 1e-9), 0, item.grid.time.size - 1))


def _with_start(model: Model, item: Experiment, cut: Segments) -> Segments:
    """Tie the first state to the measurement: exactly, or with a prior of its typical size.

    A bristle's deflection is tied so at the start of every window, and how far friction has warmed up: nothing else
    would keep them in reach.
    """
    if model.problem.estimation.initial_state == "measured":
        return replace(cut, measured=1)
    weight = np.zeros((cut.count, model.state_scale.size))
    weight[0] = start_weight(model, item)
    if cut.gap_weight is None:
        tied = [any(part in name for part in TIED) for name in model.drive.state_names]
        weight[1:, tied] = 1.0 / model.state_scale[tied]
    return replace(cut, start_weight=weight)


def mean_error(program: Program, point: Point) -> float:
    """Return the mean absolute error of all samples over their noise floors."""
    results = program.simulate_all(point)
    errors = np.concatenate([program.seen_errors(index, result.y) for index, result in enumerate(results)])
    return float(np.mean(np.abs(errors)))


def roundings_of(model: Model) -> tuple[float, ...]:
    """Return the roundings that a fit by the absolute loss goes through; none for another loss."""
    return ROUNDINGS if model.problem.estimation.loss == "absolute" else ()


def keeps_the_loss(model: Model, program: Program) -> bool:
    """Whether a fit keeps the absolute loss as it is: the solver that can needs a program without nodes."""
    options = model.problem.estimation
    return options.loss == "absolute" and options.solver == "gauss_newton" and program.without_nodes


def loss_of_round(model: Model, program: Program, best: Point, number: int) -> AbstractLoss:
    """Return the loss of a round; the absolute loss is rounded relative to the error of the best point so far."""
    match model.problem.estimation.loss:
        case "squares":
            return Squares()
        case "huber":
            return Huber()
        case "student_t":
            return StudentT()
        case "absolute":
            return Absolute(ROUNDINGS[min(number, len(ROUNDINGS) - 1)] * mean_error(program, best))


def is_noise(program: Program, end: Solution) -> bool:
    """Whether a fit by squares leaves no more than noise of the stated size would, within five deviations."""
    if not isinstance(program.loss, Squares):
        return False
    samples = program.samples
    return end.objective <= 0.5 * samples * (1.0 + 5.0 * float(np.sqrt(2.0 / samples)))
