"""Torque noise that the noise of measured inputs makes, and segments short enough for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from friction_ocp.drive.mechanism import Mechanism
from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.estimation.gap import acceleration_noise, torque_covariance
from friction_ocp.estimation.horizon import fits_free_run
from friction_ocp.estimation.model import Model, prepare_fit
from friction_ocp.estimation.problem import SEGMENT, Problem
from friction_ocp.simulation.grid import FloatArray

SHORTEST, MOST_SEGMENTS = 2, 3000
"""Samples in a segment, and segments in one recording: more cost time, fewer blur what torque noise gathers within."""
WITHIN = 0.1
"""Variance that torque noise may add within a segment over that of a channel: it is taken for noise of its samples."""
QUARTERS = np.array([0.25, 0.5, 0.75, 1.0])
"""Shares of a segment at which what gathers within it is looked at."""


def prepare_identification(problem: Problem) -> Model:
    """Prepare a problem that is to be identified; raises FrictionOcpError also where nothing has a guess.

    Relaxed segments are joined by the torque noise that the noise of the measured inputs makes, unless torque noise is
    stated or estimated; and they are so short, unless their length is stated, that it hardly moves a channel within.
    """
    model = prepare_fit(problem)
    options = problem.estimation
    if not model.train or fits_free_run(model) or options.estimated_noise:
        return model
    model = _with_options(model, process_noise=dict(options.process_noise) or stated_input_noise(model))
    return model if options.segment or not model.process_noise else _with_options(model, segment=_longest(model))


def driving(drive: Drive, numbers: Mapping[str, float]) -> Iterator[tuple[str, Channel, float]]:
    """Yield the shaft that a motor turns, an input channel that drives this motor, and the torque per unit shown."""
    for motor in drive.motors:
        constant = numbers.get(f"{motor.name}.torque_constant", 1.0)
        factors = {"torque": 1.0, "current": constant, "current_command": constant}
        factors["voltage"] = constant / max(numbers.get(f"{motor.name}.resistance", 1.0), 1e-300)
        for channel in drive.inputs:
            if channel.part == motor.name and channel.signal in factors:
                gain = numbers.get(f"{channel.name}.gain", 1.0) or 1.0
                yield motor.shaft, channel, factors[channel.signal] / gain


def speed_ratio(mech: Mechanism, numbers: Mapping[str, float], shaft: str) -> float:
    """Return the speed of a shaft over that of its group's first shaft."""
    ratio = mech.topology.speed_ratio[shaft]
    if not isinstance(ratio, ca.SX):
        return float(ratio)
    function = ca.Function("ratio", list(mech.parameters.values()), [ratio])
    return float(function(*(numbers.get(name, 1.0) for name in mech.parameters)))


def shown_speed(mech: Mechanism, numbers: Mapping[str, float], channel: Channel) -> float:
    """Return what a channel of an angle or a speed shows of the speed, over that of its group's first shaft."""
    return speed_ratio(mech, numbers, channel.part) * numbers.get(f"{channel.name}.gain", 1.0)


def input_power(
    drive: Drive, numbers: Mapping[str, float], noise: Callable[[Channel], tuple[float, float]]
) -> dict[str, float]:
    """Return by shaft the power density, (N m)^2/Hz, of the torque that noise of inputs makes.

    `noise` gives the deviation of an input and its sampling interval, s.
    """
    power: dict[str, float] = {}
    for shaft, channel, factor in driving(drive, numbers):
        std, step = noise(channel)
        power[shaft] = power.get(shaft, 0.0) + (factor * std) ** 2 * step
    return power


def seen_variance(mech: Mechanism, numbers: Mapping[str, float], covariances: FloatArray) -> FloatArray:
    """Return (outputs,) the mean variance that covariances (k, states, states) make of recorded angles and speeds."""
    mean = dict(zip(mech.state_names, np.mean(np.einsum("sii->si", covariances), axis=0), strict=True))
    added = np.zeros(len(mech.drive.outputs))
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part)
        name = "" if group is None else f"{mech.topology.roots[group]}.{channel.signal}"
        if name in mean:
            added[k] = shown_speed(mech, numbers, channel) ** 2 * float(mean[name])
    return added


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
