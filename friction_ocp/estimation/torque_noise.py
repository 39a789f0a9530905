"""Torque noise that the noise of measured inputs makes, and segments short enough for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from friction_ocp.drive.mechanism import Mechanism
from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gap import acceleration_noise, torque_covariance
from friction_ocp.estimation.horizon import fits_free_run
from friction_ocp.estimation.model import Model, prepare_fit
from friction_ocp.estimation.problem import SEGMENT, Problem
from friction_ocp.simulation.grid import FloatArray

SHORTEST, MOST_SEGMENTS = 2, 3000
"""Samples in a segment, and segments in one recording; more cost time."""
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


def stated_input_noise(model: Model) -> dict[str, float]:
    """Return by shaft the torque noise, N m/sqrt(Hz), that the `noise_std` of measured inputs makes at the guesses."""
    first = model.problem.train[0]
    values = model.space.numbers(model.nominal, first.name)
    numbers = dict(zip(model.space.leaf_names, map(float, values), strict=True))
    power: dict[str, float] = {}
    for shaft, channel, factor in driving(model.problem.drive, numbers):
        if channel.noise_std:
            step = float(np.median(np.diff(first.recording.channels[channel.name].time)))
            power[shaft] = power.get(shaft, 0.0) + (factor * channel.noise_std) ** 2 * step
    return {shaft: float(np.sqrt(value)) for shaft, value in power.items()}


def _with_options(model: Model, **changes: object) -> Model:
    options = replace(model.problem.estimation, **changes)  # pyright: ignore[reportArgumentType]
    return replace(model, problem=replace(model.problem, estimation=options))


def _longest(model: Model) -> int:
    """Return the samples in the longest segments, no longer than usual, within which noise hardly moves a channel."""
    item = model.train[0]
    step = float(np.median(np.diff(item.grid.time)))
    least = max(SHORTEST, *(-(-other.grid.time.size // MOST_SEGMENTS) for other in model.train))
    lengths = np.unique(np.geomspace(SHORTEST, SEGMENT, 12).round().astype(int))
    short = [int(n) for n in lengths if np.all(_within(model, item, n * step) <= WITHIN * model.noise**2)]
    return max(least, *short, SHORTEST)


def _within(model: Model, item: Experiment, seconds: float) -> FloatArray:
    """Return (outputs,) the mean variance that torque noise adds from a known start on, over some seconds."""
    mech, drive = model.drive.mechanism, model.drive
    numbers = model.space.numbers(model.nominal, item.name)
    states = len(drive.state_names)
    noise = acceleration_noise(mech, model.process_noise, numbers)
    found = torque_covariance(mech, np.zeros((states, states)), noise, seconds * QUARTERS)
    by_name = dict(zip(drive.state_names, np.einsum("sii->i", found) / QUARTERS.size, strict=True))
    added = np.zeros(len(mech.drive.outputs))
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part)
        name = "" if group is None else f"{mech.topology.roots[group]}.{channel.signal}"
        if name in by_name:
            by_number = dict(zip(mech.parameters, numbers, strict=True))
            added[k] = speed_ratio(mech, by_number, channel.part) ** 2 * by_name[name]
    return added
