"""Gaps between segments as wide as the torque noise that a drive gathers about its motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_ocp.estimation.drive_noise import TorqueNoise, group_density, group_inertias, known_numbers, leaf_numbers
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.factors import inverse_roots
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


@dataclass(frozen=True)
class NodeGaps:
    """Gaps between segments of a recording, laid about the motion that a drive has with the numbers of a torque noise.

    Torque noise makes the states wander, more so where an input jumps between two samples; states that no noise
    enters may jump by a share of the noise floor, and by as much in sum where a segment is cut, and deflections by what
    torque noise makes of their torque.
    """

    model: Model
    noise: TorqueNoise
    item: Experiment
    first: IntArray
    """(segments + 1,) the first node of every segment, the last node behind them."""
    impulses: Mapping[str, FloatArray]
    """By shaft (n,) N m s: how far the torque of each interval may be off because an input jumps inside it."""
    told: bool = False
    """Whether torque noise is told from sample to sample: none of it moves a state then."""

    def roots(self, moving: TorqueNoise | None = None) -> FloatArray:
        """Return (gaps, states, states) W with W'W the inverse covariance of each gap.

        `moving` is the torque noise, with the inertias that it moves, where these are not those that gaps are laid for.
        """
        if len(self.first) < 3:
            states = len(self.model.drive.state_names)
            return np.zeros((0, states, states))
        mover = replace(self.noise, density={}) if self.told else moving or self.noise
        return self._roots(self.noise, mover)

    def slopes(self, sides: Sequence[tuple[TorqueNoise, TorqueNoise]], steps: FloatArray) -> FloatArray:
        """Return (gaps, states, states, parameters) derivatives of the roots by the parameters.

        `sides` hold the torque noise, and the numbers that it moves, with each parameter less and more by its step of
        `steps` (parameters,): central differences, about the same motion and with the same jumps of states that no
        noise enters.
        """

        def one(less: TorqueNoise, more: TorqueNoise, step: float) -> FloatArray:
            return (self._roots(more, more) - self._roots(less, less)) / (2.0 * step)

        return np.stack([one(*side, step) for side, step in zip(sides, steps, strict=True)], axis=-1)

    def _roots(self, noise: TorqueNoise, mover: TorqueNoise) -> FloatArray:
        """Return the roots where a torque noise `mover` moves a drive that has the numbers of another."""
        model, (spans, motions, which) = self.model, self._kinds
        units = unit_covariances(model, slopes_about(model, self._numbers(noise), motions), spans)
        power = group_density(model, mover, self.item.name)[:, None] ** 2 + self._jump_power(mover)
        part = np.minimum(1.0, self._spans / np.median(self._spans))[:, None, None]
        gathered: FloatArray = np.einsum("gs,gsij->sij", power, units[:, which])
        covariance = gathered + part * np.diag(self._still**2)
        return inverse_roots(covariance[:-1])

    def _numbers(self, noise: TorqueNoise) -> FloatArray:
        return leaf_numbers(self.model, noise, self.item.name)

    @cached_property
    def _spans(self) -> FloatArray:
        """(segments,) s."""
        return np.diff(self.item.grid.time[self.first])

    @cached_property
    def _kinds(self) -> tuple[FloatArray, FloatArray, IntArray]:
        """(kinds,) s of segments that are alike, (kinds, states) how these move, (segments,) the kind of each."""
        middles = (self.first[:-1] + self.first[1:]) // 2
        return alike(self._spans, motions_of(self.model, self._numbers(self.noise), self.item, middles))

    @cached_property
    def _still(self) -> FloatArray:
        """(states,) how far those may jump that no noise enters."""
        model, span = self.model, float(np.median(self._spans))
        at_rest = slopes_about(model, self._numbers(self.noise), np.zeros((1, len(model.drive.state_names))))[0]
        return still_gaps(model, self.noise, self.item.name, span, at_rest, self.told)

    def _jump_power(self, noise: TorqueNoise) -> FloatArray:
        """Return (groups, segments) the power density of acceleration that jumps of inputs may hide."""
        mech = self.model.drive.mechanism
        inertias = group_inertias(mech, known_numbers(self.model, noise, self.item.name))
        power = np.zeros((len(inertias), self._spans.size))
        for shaft, values in self.impulses.items():
            group = mech.topology.group_of[shaft]
            ratio = speed_ratio(mech, noise.numbers[self.item.name], shaft) / max(float(inertias[group]), 1e-300)
            power[group] += np.add.reduceat(values**2, self.first[:-1]) * ratio**2 / self._spans
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
