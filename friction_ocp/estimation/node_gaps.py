"""Gaps between segments as wide as the torque noise that a drive gathers about its motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.drive_noise import TorqueNoise, group_density, group_inertias, known_numbers, leaf_numbers
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gathered_noise import alike, motions_of, slopes_about, unit_covariances
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.torque_noise import shown_speed, speed_ratio
from friction_ocp.simulation.grid import FloatArray, IntArray

STILL_GAP, LOOSE_GAP = 1e-5, 1e-3
"""Gap over the typical size of a state that no noise enters, and the most for a deflection."""
QUIET_GAP = 0.01
"""Torque of such a jump over that of the noise of a sample, where noise is told from sample to sample."""
NEGLIGIBLE_GAP = 0.1
"""Gap over the noise floor that stands for a state that no noise enters."""


def gap_roots(
    model: Model,
    noise: TorqueNoise,
    item: Experiment,
    first: IntArray,
    impulses: Mapping[str, FloatArray],
    moving: TorqueNoise | None = None,
    told: bool = False,
) -> FloatArray:
    """Return (gaps, states, states) W with W'W the inverse covariance of each gap.

    Torque noise makes the states wander, more so where an input jumps between two samples; states that no noise
    enters may jump by a share of the noise floor, and by as much in sum where a segment is cut, and deflections by what
    torque noise makes of their torque.
    `moving` holds the torque noise, and the inertias that it moves, where these are not those of `noise`. None of it
    moves a state where it is `told` from sample to sample.
    """
    if len(first) < 3:
        states = len(model.drive.state_names)
        return np.zeros((0, states, states))
    mover = replace(noise, density={}) if told else noise if moving is None else moving
    return _roots(model, noise, item, first, impulses, mover, _ground(model, noise, item, first, told))


def gap_slopes(
    model: Model,
    noise: TorqueNoise,
    item: Experiment,
    first: IntArray,
    impulses: Mapping[str, FloatArray],
    sides: Sequence[tuple[TorqueNoise, TorqueNoise]],
    steps: FloatArray,
) -> FloatArray:
    """Return (gaps, states, states, parameters) derivatives of the roots of gaps by the parameters.

    `sides` hold the torque noise, and the numbers that it moves, with each parameter less and more by its step of
    `steps` (parameters,): central differences, about the motion that `noise` has and with the jumps of states that no
    noise enters.
    """
    ground = _ground(model, noise, item, first, told=False)

    def roots(side: TorqueNoise) -> FloatArray:
        return _roots(model, side, item, first, impulses, side, ground)

    slopes = [(roots(more) - roots(less)) / (2.0 * step) for (less, more), step in zip(sides, steps, strict=True)]
    return np.stack(slopes, axis=-1)


@dataclass(frozen=True)
class _Ground:
    """What gaps are laid about."""

    spans: FloatArray
    """(kinds,) s of segments that are alike."""
    motions: FloatArray
    """(kinds, states) how these move."""
    which: IntArray
    """(segments,) the kind of each."""
    still: FloatArray
    """(states,) how far those may jump that no noise enters."""


def _ground(model: Model, noise: TorqueNoise, item: Experiment, first: IntArray, told: bool) -> _Ground:
    numbers, spans = leaf_numbers(model, noise, item.name), np.diff(item.grid.time[first])
    kinds = alike(spans, motions_of(model, numbers, item, (first[:-1] + first[1:]) // 2))
    at_rest = slopes_about(model, numbers, np.zeros((1, len(model.drive.state_names))))[0]
    return _Ground(*kinds, still_gaps(model, noise, item.name, float(np.median(spans)), at_rest, told))


def _roots(
    model: Model,
    noise: TorqueNoise,
    item: Experiment,
    first: IntArray,
    impulses: Mapping[str, FloatArray],
    mover: TorqueNoise,
    ground: _Ground,
) -> FloatArray:
    spans = np.diff(item.grid.time[first])
    slopes = slopes_about(model, leaf_numbers(model, noise, item.name), ground.motions)
    units = unit_covariances(model, slopes, ground.spans)
    power = group_density(model, mover, item.name)[:, None] ** 2 + _jump_power(model, mover, item, first, impulses)
    part = np.minimum(1.0, spans / np.median(spans))[:, None, None]
    gathered: FloatArray = np.einsum("gs,gsij->sij", power, units[:, ground.which])
    covariance = gathered + part * np.diag(ground.still**2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance[:-1])), dtype=np.float64)


def _jump_power(
    model: Model, noise: TorqueNoise, item: Experiment, first: IntArray, impulses: Mapping[str, FloatArray]
) -> FloatArray:
    """Return (groups, segments) the power density of acceleration that jumps of inputs may hide."""
    mech = model.drive.mechanism
    inertias = group_inertias(mech, known_numbers(model, noise, item.name))
    spans = np.diff(item.grid.time[first])
    power = np.zeros((len(inertias), spans.size))
    for shaft, values in impulses.items():
        group = mech.topology.group_of[shaft]
        ratio = speed_ratio(mech, noise.numbers[item.name], shaft) / max(float(inertias[group]), 1e-300)
        power[group] += np.add.reduceat(values**2, first[:-1]) * ratio**2 / spans
    return power


def still_gaps(
    model: Model, noise: TorqueNoise, recording: str, span: float, slopes: FloatArray, told: bool = False
) -> FloatArray:
    """Return (states,) how far states may jump that no noise enters: less than the channels can see.

    `slopes` (states, states) say how the rates depend on the states at rest; `told` whether torque noise is told from
    sample to sample.
    """
    mech = model.drive.mechanism
    size = STILL_GAP * model.state_scale
    deflected = mech.columns((*mech.bristle_names, *mech.loop_names))
    if deflected:
        loose = _loose_gaps(model, noise, recording, span, slopes[:, deflected])
        size[deflected] = np.clip(loose, size[deflected], LOOSE_GAP * model.state_scale[deflected])
    for k, channel in enumerate(mech.drive.outputs):
        group = mech.topology.group_of.get(channel.part)
        if group is not None and channel.signal == "alpha" and group in mech.free_groups:
            row = len(mech.angle_groups) + mech.free_groups.index(group)
            shown = np.abs(shown_speed(mech, noise.numbers[recording], channel) * slopes[row])
            size = np.minimum(size, NEGLIGIBLE_GAP * float(model.noise[k]) / np.maximum(shown, 1e-300))
        if group is None or channel.signal not in ("theta", "omega"):
            continue
        ratio = abs(shown_speed(mech, noise.numbers[recording], channel))
        floor = NEGLIGIBLE_GAP * float(model.noise[k]) / max(ratio, 1e-300)
        names = {f"{mech.topology.roots[group]}.theta": floor, f"{mech.topology.roots[group]}.omega": floor / span}
        for state, limit in names.items():
            if state in model.drive.state_names:
                at = model.drive.state_names.index(state)
                size[at] = min(size[at], limit)
    if told:
        size = np.minimum(size, QUIET_GAP * _loose_gaps(model, noise, recording, span, slopes))
    return np.maximum(size, 1e-12 * model.state_scale)


def _loose_gaps(model: Model, noise: TorqueNoise, recording: str, span: float, slopes: FloatArray) -> FloatArray:
    """Return (k,) how far states may jump, deflections of bristles and loops above all, which `slopes` (states, k) show
    in the rates.

    As far as changes the power of their torque, at typical speeds, by that of torque noise over a segment: a stiffness
    that changes moves them all, and does so in steps as long as gaps let it.
    """
    mech = model.drive.mechanism
    moved, speeds = list(mech.free_groups), len(mech.angle_groups) + np.arange(len(mech.free_groups))
    momentum = group_inertias(mech, known_numbers(model, noise, recording))[moved] * model.state_scale[speeds]
    push = np.max(momentum * group_density(model, noise, recording)[moved], initial=0.0) / np.sqrt(span)
    power = np.max(momentum[:, None] * np.abs(slopes[speeds]), axis=0, initial=1e-300)
    return push / power
