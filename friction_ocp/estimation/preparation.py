"""Problems made ready to be identified: torque noise that joins segments, and segments short enough for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.drive_noise import made_by_inputs, within
from friction_ocp.estimation.horizon import fits_free_run, is_relaxed
from friction_ocp.estimation.model import Model, prepare_fit
from friction_ocp.estimation.problem import SEGMENT, Problem
from friction_ocp.estimation.torque_noise import (
    MOST_SEGMENTS,
    QUARTERS,
    SHORTEST,
    acceleration_noise,
    input_power,
    seen_variance,
    torque_covariance,
)
from friction_ocp.estimation.unknown_noise import MOST_SAMPLES, noise_moves, tellable_inputs

WITHIN = 0.1
"""Variance that torque noise may add within a segment over that of a channel: it is taken for noise of its samples."""


def prepare_identification(problem: Problem) -> Model:
    """Prepare a problem that is to be identified; raises FrictionOcpError also where nothing has a guess.

    Relaxed segments are joined by the torque noise that the noise of the measured inputs makes, unless torque noise is
    stated or estimated; and they are so short, unless their length is stated, that it hardly moves a channel within.
    Inputs whose noise is to be told sample by sample are found.
    """
    model = prepare_fit(problem)
    options = problem.estimation
    if not model.train or options.fit == "simulation" or options.estimated_noise:
        return model
    plain = not options.process_noise and not options.segment and options.loss == "squares"
    inputs = tellable_inputs(model, model.train) if plain else ()
    if inputs and noise_moves(model, made_by_inputs(model)):
        model = replace(model, noisy_inputs=inputs)
    if fits_free_run(model):
        return model
    model = _with_options(model, process_noise=dict(options.process_noise) or stated_input_noise(model))
    model = replace(model, joins_noise=bool(model.process_noise) and not options.process_noise)
    return model if options.segment or not model.process_noise else _with_options(model, segment=_longest(model))


def joined_by_input_noise(model: Model) -> Model:
    """Return a model of segments so short that noise of measured inputs moves channels the least, joined by it.

    What it moves them by within a segment counts as noise of theirs. A model that is joined so already stays.
    """
    if model.joins_noise:
        return model
    noise = made_by_inputs(model)
    model = _with_options(model, process_noise=noise.density, fit="relaxed")
    model = _with_options(model, segment=_longest(model))
    first = model.train[0]
    seconds = model.problem.estimation.samples * float(np.median(first.grid.dt))
    moved = dict(zip(model.drive.output_names, within(model, noise, first, seconds), strict=True))
    floors = {
        name: replace(floor, std=float(np.hypot(floor.std, np.sqrt(moved[name]))))
        for name, floor in model.floors.items()
    }
    return replace(model, floors=floors, joins_noise=True)


def may_be_joined_by_inputs(model: Model) -> bool:
    """Whether relaxed segments may as well be short ones that noise of measured inputs joins, which nobody states.

    Not where recordings are so long that these take too much time.
    """
    return is_relaxed(model) and _shakes(model)


def may_leave_free_runs(model: Model) -> bool:
    """Whether such segments may be fitted instead of free runs, which nobody asked for by name."""
    named = model.problem.estimation.fit or not model.space.names
    return not named and fits_free_run(model) and _shakes(model)


def _shakes(model: Model) -> bool:
    """Whether noise of measured inputs, and none of torques that is stated, moves a drive; not over long recordings."""
    options = model.problem.estimation
    stated = model.process_noise or options.estimated_noise or options.segment
    short = sum(item.grid.time.size for item in model.train) <= MOST_SAMPLES
    if not model.train or not short or stated or options.loss != "squares":
        return False
    return any(density > 0.0 for density in made_by_inputs(model).density.values())


def is_moved_by_inputs(model: Model) -> bool:
    """Whether noise of measured inputs, not stated, moves a channel of relaxed segments by more than its own."""
    if not may_be_joined_by_inputs(model):
        return False
    seconds = model.problem.estimation.samples * float(np.median(model.train[0].grid.dt))
    return bool(np.any(within(model, made_by_inputs(model), model.train[0], seconds) > model.noise**2))


def stated_input_noise(model: Model) -> dict[str, float]:
    """Return by shaft the torque noise, N m/sqrt(Hz), that the `noise_std` of measured inputs makes at the guesses."""
    recording = model.problem.train[0].recording

    def noise(channel: Channel) -> tuple[float, float]:
        return channel.noise_std or 0.0, float(np.median(np.diff(recording.channels[channel.name].time)))

    power = input_power(model.problem.drive, _numbers(model), noise)
    return {shaft: float(np.sqrt(value)) for shaft, value in power.items() if value > 0.0}


def _numbers(model: Model) -> dict[str, float]:
    return model.space.numbers_by_path(model.nominal, model.train[0].name)


def _with_options(model: Model, **changes: object) -> Model:
    options = replace(model.problem.estimation, **changes)  # pyright: ignore[reportArgumentType]
    return replace(model, problem=replace(model.problem, estimation=options))


def _longest(model: Model) -> int:
    """Return the samples in the longest segments, no longer than usual, within which noise hardly moves a channel."""
    item, mech, numbers = model.train[0], model.drive.mechanism, _numbers(model)
    density = acceleration_noise(mech, model.process_noise, np.array(list(numbers.values())))
    still, step = np.zeros((len(mech.state_names),) * 2), float(np.median(np.diff(item.grid.time)))

    def moves(samples: int) -> bool:
        gathered = torque_covariance(mech, still, density, samples * step * QUARTERS)
        return bool(np.any(seen_variance(mech, numbers, gathered) > WITHIN * model.noise**2))

    least = max(SHORTEST, *(-(-other.grid.time.size // MOST_SEGMENTS) for other in model.train))
    lengths = np.unique(np.geomspace(SHORTEST, SEGMENT, 12).round().astype(int))
    return max([least, *(int(samples) for samples in lengths if not moves(int(samples)))])
