"""Free-running simulation of recordings and how far it is from what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.horizon import fits_free_run, horizon
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import RELATIVE, solve_nodes
from friction_ocp.estimation.own_numbers import own_numbers, with_numbers
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import free_run, relaxed
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares


@dataclass(frozen=True)
class FreeRun:
    """One recording simulated."""

    name: str
    time: FloatArray
    """(n,) s."""
    measured: FloatArray
    """(n, outputs), NaN where there is no sample."""
    simulated: FloatArray
    """(n, outputs)."""
    states: FloatArray
    """(n, states)."""
    late: Mapping[str, float]
    """By channel: how much later than `time` the stamps of its samples are, s."""
    own: Mapping[str, float] = field(default_factory=dict[str, float])
    """By path: numbers that were fitted to this recording alone, which took no part in the fit."""


def numbers_of_own(runs: Sequence[FreeRun]) -> dict[str, float]:
    """Return the numbers that were fitted to single recordings, each as `path@recording`."""
    return {f"{path}@{run.name}": value for run in runs for path, value in run.own.items()}


@dataclass(frozen=True)
class Errors:
    """Errors of one channel over some recordings, in SI units of the channel."""

    rms: float
    mae: float
    relative: float
    """rms over the rms of the measured signal about its mean."""
    relative_norm: float
    """Norm of the error over the norm of the signal."""
    noise_ratio: float


def simulate_recordings(
    model: Model,
    experiments: tuple[Experiment, ...],
    theta: FloatArray,
    width: float = 0.0,
    fitted: bool = True,
    relative: float = RELATIVE,
) -> tuple[FreeRun, ...]:
    """Simulate recordings freely with exact friction, over windows where the drive drifts.

    Windows of a fitted free run start where they come closest, as far as that is found: from what was measured, or from
    the smoothed state, whichever leads to less. A number that each recording has for itself is fitted to one that took
    no part in the fit, and to every one where nothing was `fitted`. Starts are found until a step gains less than is
    `relative` to what is left.
    """
    if not experiments:
        return ()
    own, span = own_numbers(model, experiments, theta, fitted), horizon(model)
    known = dict(zip(model.space.names, map(float, theta), strict=True))
    model = with_numbers(model, own)
    theta = model.space.with_known(known)
    program = free_run(model, experiments, width, Squares(), span)
    point = suggested_point(program, theta)
    if not fits_free_run(model):
        point = _smoothed(model, experiments, program, point)
    elif span is None:
        point = solve_nodes(program, point, relative=relative)
    else:
        starts = (point, _smoothed(model, experiments, program, point))
        point = _better(program, *(solve_nodes(program, start, relative=relative) for start in starts))
    runs: list[FreeRun] = []
    for index, item in enumerate(experiments):
        result = program.simulate(index, point, with_states=True)
        assert result.states is not None
        seen = (item.name, item.grid.time, item.measured, result.y, result.states, item.late)
        runs.append(FreeRun(*seen, own.get(item.name, {})))
    return tuple(runs)


def _smoothed(model: Model, experiments: tuple[Experiment, ...], program: Program, point: Point) -> Point:
    """Start every window from the state that the relaxed program smooths out of the measurement."""
    smoother = relaxed(model, experiments, 0.0, Squares())
    solved = solve_nodes(smoother, suggested_point(smoother, point.theta))
    return program.point_along(smoother, solved)


def _better(program: Program, one: Point, other: Point) -> Point:
    """Return the start of every window from the point with which it costs less."""
    nodes: list[FloatArray] = []
    for index in range(len(program.segments)):
        costs = [_window_costs(program, index, point) for point in (one, other)]
        nodes.append(np.where((costs[0] <= costs[1])[:, None], one.nodes[index], other.nodes[index]))
    return Point(one.theta, tuple(nodes))


def _window_costs(program: Program, index: int, point: Point) -> FloatArray:
    """Return (windows,) what the samples of each window cost; infinite where the simulation breaks down."""
    errors = program.sample_errors(index, program.simulate(index, point).y)
    costs = np.add.reduceat(np.sum(program.loss.cost(errors), axis=1), program.segments[index].first[:-1])
    return np.where(np.isfinite(costs), costs, np.inf)


def errors_of(runs: tuple[FreeRun, ...], column: int, floor: float) -> Errors:
    """Return the errors of one output over recordings."""
    measured = np.concatenate([run.measured[:, column] for run in runs])
    error = np.concatenate([run.simulated[:, column] for run in runs]) - measured
    seen = np.isfinite(measured)
    error, signal = error[seen], measured[seen]
    rms = float(np.sqrt(np.mean(error**2)))
    return Errors(
        rms=rms,
        mae=float(np.mean(np.abs(error))),
        relative=rms / max(float(np.std(signal)), 1e-300),
        relative_norm=float(np.linalg.norm(error)) / max(float(np.linalg.norm(signal)), 1e-300),
        noise_ratio=rms / floor,
    )


def channel_errors(model: Model, runs: tuple[FreeRun, ...]) -> Mapping[str, tuple[Errors, Mapping[str, Errors]]]:
    """Return for each output channel its errors over all recordings and by recording."""
    table: dict[str, tuple[Errors, Mapping[str, Errors]]] = {}
    for column, name in enumerate(model.drive.output_names):
        if not runs:
            continue
        floor = model.floors[name].std
        by_recording = {run.name: errors_of((run,), column, floor) for run in runs if _has_samples(run, column)}
        table[name] = (errors_of(runs, column, floor), by_recording)
    return table


def _has_samples(run: FreeRun, column: int) -> bool:
    return bool(np.any(np.isfinite(run.measured[:, column])))
