"""Programs in which the noise of measured inputs is an unknown of every sample.

Where the noise of a measured current moves a fine encoder within two samples by more than the encoder's own noise, a
model is judged by how much it answers to noise that its machine does not answer to: gaps are laid for one inertia, and
a rotor that is stated rightly looks too light. With the noise of every sample an unknown, none is favoured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.estimation.drive_noise import (
    TorqueNoise,
    group_density,
    input_impulses,
    input_noise,
    made_by_inputs,
    within,
)
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gap import start_weight
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_gaps import NodeGaps
from friction_ocp.estimation.noisy_nodes import sampled, with_noise
from friction_ocp.estimation.program import Program
from friction_ocp.estimation.segments import Segments
from friction_ocp.estimation.torque_noise import SHORTEST, driving, seen_variance
from friction_ocp.parameters import is_off
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import AbstractLoss
from friction_ocp.simulation.sweep import sweep_of

LATE = 0.01
"""Share of a sampling interval by which a node may miss a sample."""
MOST_SAMPLES = 30_000
"""Samples of all recordings together up to which the noise of each is an unknown: more cost time."""


def tellable_inputs(model: Model, items: Sequence[Experiment]) -> tuple[str, ...]:
    """Return the inputs that turn motors, whose noise may be an unknown of every sample of some recordings.

    None where recordings are too long or not sampled as their inputs are.
    """
    turning = driving(model.problem.drive, {})
    inputs = tuple(dict.fromkeys(channel.name for _, channel, _ in turning))
    short = sum(item.grid.time.size for item in items) <= MOST_SAMPLES
    return inputs if short and _in_step(items, model, inputs) else ()


def noise_moves(model: Model, noise: TorqueNoise, share: float = 1.0) -> bool:
    """Whether torque noise moves a channel, within the shortest segment, by more variance than a share of its own."""
    first = model.train[0]
    moved = within(model, noise, first, SHORTEST * float(np.median(first.grid.dt)))
    return bool(np.any(moved > share * model.noise**2))


def blurred(model: Model, noise: TorqueNoise) -> FloatArray:
    """Return (outputs,) noise floors with what late channels leave out of the noise that moves them."""
    return np.sqrt(model.noise**2 + _late_variance(model, noise, model.train[0]))


def telling_program(model: Model, width: float, loss: AbstractLoss) -> Program:
    """Return the program of the training recordings that takes the noise of the noisy inputs of a model as unknowns.

    `width` is the smoothing of the sign over the typical speed.
    """
    noise, outputs = made_by_inputs(model), model.drive.mechanism.drive.outputs
    known = (model.noisy_inputs, tuple(item.marked(outputs) for item in model.train), blurred(model, noise))
    program = unknown_noise_program(model, noise, *known, width * model.speed_scale, loss)
    return replace(program, static=model.static)


def unknown_noise_program(
    model: Model,
    noise: TorqueNoise,
    inputs: tuple[str, ...],
    experiments: tuple[Experiment, ...],
    floors: FloatArray,
    width: FloatArray,
    loss: AbstractLoss,
) -> Program:
    """Return segments of one sample each that feel some inputs without their noise, which is part of the nodes.

    `floors` (outputs,) are those of the channels, `width` (groups + 1,) is the smoothing of the sign. Samples that
    share an error of rounding count once.
    """
    drive = model.problem.drive
    sweep = sweep_of(drive, model.sweep.active, noisy=inputs)
    known = {item.name: input_noise(model, item)[0] for item in drive.inputs if item.name in inputs}
    segments = tuple(with_noise(sweep.drive, item, _sampled(model, noise, item), known) for item in experiments)
    once = tuple(item.told_once() for item in experiments)
    return Program(model.space, sweep.drive, sweep, once, segments, floors, width, loss)


def _sampled(model: Model, noise: TorqueNoise, item: Experiment) -> Segments:
    """Return segments of one sample each of a recording, whose gaps hold jumps of inputs and no noise of them."""
    first = sampled(item)
    impulses = input_impulses(model, item, noise.numbers[item.name])
    weights = NodeGaps(model, noise, item, first, impulses, told=True).roots()
    if model.problem.estimation.initial_state == "measured":
        return Segments(first, weights, measured=1)
    start = np.zeros((len(first) - 1, model.state_scale.size))
    start[0] = start_weight(model, item)
    return Segments(first, weights, start_weight=start)


def _late_variance(model: Model, noise: TorqueNoise, item: Experiment) -> FloatArray:
    """Return (outputs,) the variance of what delays of half a sample leave out of the noise that moves a channel.

    They are expanded about the nearest sample to as many derivatives of the motion as are known: not to the rate of
    an acceleration, which with noise that runs in lines changes by sqrt(2) of its deviation a sample.
    """
    mech, step = model.drive.mechanism, float(np.median(item.grid.dt))
    rate = np.sqrt(2.0) * group_density(model, noise, item.name) / step**1.5
    unknown = np.zeros((1, len(mech.state_names), len(mech.state_names)))
    for k, group in enumerate(mech.angle_groups):
        unknown[0, k, k] = (rate[group] * (0.5 * step) ** 3 / 6.0) ** 2
    for k, group in enumerate(mech.free_groups, len(mech.angle_groups)):
        unknown[0, k, k] = (rate[group] * (0.5 * step) ** 2 / 2.0) ** 2
    late = np.array([not is_off(channel.delay) or bool(channel.clock) for channel in model.problem.drive.outputs])
    return np.where(late, seen_variance(mech, noise.numbers[item.name], unknown), 0.0)


def _in_step(items: Sequence[Experiment], model: Model, inputs: Sequence[str]) -> bool:
    """Whether recordings have a node at every sample of some inputs, and at no other time."""
    named = {use.name: use.recording for use in model.problem.recordings}
    for item in items:
        times, near = item.grid.time, LATE * float(np.median(item.grid.dt))
        for name in inputs:
            samples = named[item.name].channels[name].time
            own = samples[(samples >= times[0] - near) & (samples <= times[-1] + near)]
            if own.size != times.size or not np.allclose(own, times, rtol=0.0, atol=near):
                return False
    return True
