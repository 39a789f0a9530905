"""Fits again with clocks and late channels read as they were found to be, until little of a delay is to be expanded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.clocks import Moves, on_one_clock
from friction_ocp.estimation.first_nodes import suggested_nodes
from friction_ocp.estimation.model import Model, in_time, late_of, prepare, with_late, with_step
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.rounds import Fitted, final_solver, limits, program_builder
from friction_ocp.simulation.grid import FloatArray

NEAR = 0.1
"""Sampling intervals that a clock may be off by at a last fit: a delay is expanded to second order only."""
MOST_TURNS = 8


def synchronised(model: Model, fitted: Fitted, phases: Phases) -> tuple[Model, Fitted]:
    """Return model and fit with stamps so near that the expansion of the delays is exact."""
    for turn in range(MOST_TURNS):
        theta = fitted.solution.point.theta
        nearer = in_time(model, theta)
        if _is_fitted(model) and _distance(model, theta) > NEAR:
            nearer = with_moves(nearer, _found(model, theta))
        if nearer is model:
            break
        model = nearer
        program = program_builder(model)(model, 0.0, fitted.program.loss)
        start = Point(model.space.clip(theta), suggested_nodes(program, theta))
        end = final_solver(model)(program, start, limits(model), phases.begin(f"clocks and delays, turn {turn + 1}"))
        fitted = Fitted(replace(end, iterations=end.iterations + fitted.solution.iterations), program)
    return model, fitted


def with_moves(model: Model, moves: Moves) -> Model:
    """Return a model whose stamps are moved by other amounts; steps, noise, start and late channels stay."""
    if not moves:
        return model
    fresh = with_late(prepare(on_one_clock(model.problem, moves)), late_of(model))
    names = ("noise_levels", "noisy_inputs", "tells_noise", "joins_noise", "floors")
    kept = {name: getattr(model, name) for name in names}
    moved = replace(with_step(fresh, model.max_step), **kept)
    return replace(moved, space=moved.space.moved(model.space.guess))


def moves_of(model: Model) -> Moves:
    """Return by how much the stamps of a model were moved."""
    return {use.name: use.moved for use in model.problem.recordings if use.moved}


def _is_fitted(model: Model) -> bool:
    return any(model.space.leaf_names[k].startswith("clocks.") for k in model.space.active)


def _left(model: Model, theta: FloatArray, recording: str) -> dict[str, tuple[float, float]]:
    """Return by clock what the model still takes for offset and drift."""
    numbers = model.space.numbers_by_path(theta, recording)
    clocks = model.problem.drive.clocks
    return {item.name: (numbers[f"{item.path}.offset"], numbers[f"{item.path}.drift"]) for item in clocks}


def _found(model: Model, theta: FloatArray) -> Moves:
    """Return the whole of what the clocks are fast by."""
    return {
        use.name: {
            name: (offset + use.moved[name][0], drift + use.moved[name][1])
            for name, (offset, drift) in _left(model, theta, use.name).items()
        }
        for use in model.problem.recordings
    }


def _distance(model: Model, theta: FloatArray) -> float:
    """Return the largest delay that is left in the training recordings, in sampling intervals."""
    largest = 0.0
    for item in model.train:
        span = float(item.grid.time[-1] - item.grid.time[0])
        interval = span / max(int(np.isfinite(item.measured).any(axis=1).sum()), 1)
        for offset, drift in _left(model, theta, item.name).values():
            largest = max(largest, max(abs(offset), abs(offset + drift * span)) / interval)
    return largest
