"""Torque noise that moves a drive: what is stated, and what noise of the measured inputs makes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from friction_ocp.drive.coordinates import ORDERS
from friction_ocp.drive.mechanism import Mechanism
from friction_ocp.drive.parts import Channel
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gathered_noise import motions_of, slopes_about, unit_covariances
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.noise import NoiseFloor, noise_floor
from friction_ocp.estimation.torque_noise import QUARTERS, acceleration_noise, driving, input_power, seen_variance
from friction_ocp.recording import recording
from friction_ocp.recording.feedback import unexplained_noise
from friction_ocp.simulation.grid import FloatArray

NUMERICAL_INPUT = 1e-3
"""Error of a measured input over its rms, sample by sample, that a simulation between samples makes anyway."""
MORE_THAN_ALL = 1.2
"""What high frequencies tell of noise, over the rms of all that was measured, above which it is no noise: white noise
alone tells 1, give or take what chance does to few samples."""
SMOOTH = 4.0 * np.sqrt(6.0)
"""Second difference over the noise of an input above which it jumps: four deviations of what noise alone bends."""


@dataclass(frozen=True)
class TorqueNoise:
    """Torque noise of the shafts, and the numbers of the drive that it moves."""

    density: Mapping[str, float]
    """Torque noise by shaft, N m/sqrt(Hz): what is stated, and what noise of the measured inputs makes."""
    numbers: Mapping[str, Mapping[str, float]]
    """By recording: the numbers of the drive, with which noise of torque becomes noise of motion."""


def made_by_inputs(model: Model) -> TorqueNoise:
    """Return the torque noise that noise of measured inputs makes, at what gaps between segments are laid for."""
    numbers = _numbers_at(model, model.nominal)
    return TorqueNoise(_input_density(model, numbers[model.train[0].name]), numbers)


def joining(model: Model) -> TorqueNoise:
    """Return the torque noise that segments of a model are joined by, at what its gaps are laid for."""
    return joining_at(model)(model.nominal)


def joining_at(model: Model) -> Callable[[FloatArray], TorqueNoise]:
    """Return what tells the torque noise that segments of a model are joined by, at parameters (parameters,).

    What noise of inputs makes is as much as their torque constants, which may be fitted, have changed since guessed.
    """
    first, noise = model.train[0].name, cache(partial(input_noise, model))
    guessed = model.space.numbers_by_path(model.space.guess, first)
    before = input_power(model.problem.drive, guessed, noise) if model.joins_noise else {}

    def at(theta: FloatArray) -> TorqueNoise:
        numbers = _numbers_at(model, theta)
        now = input_power(model.problem.drive, numbers[first], noise) if model.joins_noise else {}
        grown = {shaft: float(np.sqrt(now[shaft] / max(power, 1e-300))) for shaft, power in before.items()}
        return TorqueNoise({key: grown.get(key, 1.0) * value for key, value in model.process_noise.items()}, numbers)

    return at


def _numbers_at(model: Model, theta: FloatArray) -> dict[str, dict[str, float]]:
    return {use.name: model.space.numbers_by_path(theta, use.name) for use in model.problem.recordings}


def torque_noise(model: Model, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the density of torque noise by shaft, N m/sqrt(Hz): stated, and from the noise of measured inputs.

    Noise that is to be estimated counts for nothing here: it would take in the gap.
    """
    options = model.problem.estimation
    stated = options.process_noise.keys() - set(options.estimated_noise)
    density = {shaft: options.process_noise[shaft] for shaft in sorted(stated)}
    for shaft, value in _input_density(model, numbers).items():
        density[shaft] = float(np.hypot(density.get(shaft, 0.0), value))
    return density


def _input_density(model: Model, numbers: Mapping[str, float]) -> dict[str, float]:
    power = input_power(model.problem.drive, numbers, partial(input_noise, model))
    return {shaft: float(np.sqrt(value)) for shaft, value in power.items()}


def input_noise(model: Model, channel: Channel) -> tuple[float, float]:
    """Return the noise floor of an input and its sampling interval.

    High frequencies of an input that a loop throws from one end to the other, sample by sample, are its motion.
    """
    signals = _recorded(model, channel)
    step = float(np.median(np.diff(signals[0].time)))
    size = max(float(np.sqrt(np.nanmean(item.values**2))) for item in signals)
    floor = input_floor(model, channel)
    known = 0.0 if floor.source == "high_frequency" and floor.std > MORE_THAN_ALL * size else floor.std
    return max(known, NUMERICAL_INPUT * size), step


def input_floor(model: Model, channel: Channel) -> NoiseFloor:
    """Return the noise floor of an input, as stated or as its samples show it.

    What a loop makes of the measured motion is no noise, however fast it is.
    """
    floor = noise_floor(channel, [(item.time, item.values) for item in _recorded(model, channel)])
    if floor.source != "high_frequency":
        return floor
    motions = tuple(item.name for item in model.problem.drive.outputs if item.signal in ORDERS)
    recordings = [use.recording for use in model.problem.recordings]
    levels = [_KNOWN.setdefault(item, _Levels(item)).of(channel.name, motions) for item in recordings]
    known = [level for level in levels if np.isfinite(level)]
    return replace(floor, std=min(floor.std, float(np.median(known)))) if known else floor


class _Levels:
    """By channel of a recording and motions beside it: the noise that these do not explain; see `unexplained_noise`."""

    def __init__(self, recorded: recording.Recording) -> None:
        self._channels = recorded.channels
        self._known: dict[tuple[str, tuple[str, ...]], float] = {}

    def of(self, name: str, motions: tuple[str, ...]) -> float:
        """Return the level of a channel; motions on other clocks say nothing."""
        if (name, motions) not in self._known:
            own, channels = self._channels[name], self._channels
            beside = [
                channels[item].values for item in motions if item in channels and channels[item].clock == own.clock
            ]
            self._known[name, motions] = unexplained_noise(own.time, own.values, beside)
        return self._known[name, motions]


_KNOWN: WeakKeyDictionary[recording.Recording, _Levels] = WeakKeyDictionary()
"""What was found of recordings that are still in use: many a fit asks again."""


def _recorded(model: Model, channel: Channel) -> list[recording.Channel]:
    return [use.recording.channels[channel.name] for use in model.problem.recordings]


def group_inertias(mech: Mechanism, numbers: Mapping[str, float]) -> FloatArray:
    """Return the inertia of every group at given numbers."""
    inertias = ca.vertcat(*[ca.SX(mech.inertia(g)) for g in range(len(mech.topology.roots))])
    function = ca.Function("inertia", list(mech.parameters.values()), [inertias])
    return np.asarray(function(*(numbers.get(name, 1.0) for name in mech.parameters))).ravel()


def group_density(model: Model, noise: TorqueNoise, recording: str) -> FloatArray:
    """Return the density of the acceleration noise of every group, rad/s^2/sqrt(Hz)."""
    mech = model.drive.mechanism
    numbers = known_numbers(model, noise, recording)
    values = np.array([numbers.get(name, 1.0) for name in mech.parameters])
    return acceleration_noise(mech, noise.density, values)


def leaf_numbers(model: Model, noise: TorqueNoise, recording: str) -> FloatArray:
    """Return the numbers of the drive in the order of the model functions."""
    numbers = known_numbers(model, noise, recording)
    return np.array([numbers[name] for name in model.space.leaf_names])


def known_numbers(model: Model, noise: TorqueNoise, recording: str) -> dict[str, float]:
    """Return the numbers of a drive by path: those that torque noise moves, and guesses of what these lack."""
    return {**model.space.numbers_by_path(model.space.guess, recording), **noise.numbers[recording]}


def input_impulses(model: Model, item: Experiment, numbers: Mapping[str, float]) -> dict[str, FloatArray]:
    """Return by shaft (n,) N m s: how far the torque of each interval may be off because an input jumps inside it.

    A jump at an unknown instant between two samples that are joined by a line leaves its size times the interval
    over sqrt(12); what bends less than noise would bend counts as smooth.
    """
    found: dict[str, FloatArray] = {}
    for shaft, channel, factor in driving(model.problem.drive, numbers):
        if channel.hold == "zero":
            continue
        column = model.drive.input_names.index(channel.name)
        bend = np.abs(np.diff(item.grid.at_node[:, column], 2, prepend=np.nan, append=np.nan))
        std, _ = input_noise(model, channel)
        jump = np.fmax(bend, np.append(bend[1:], np.nan))
        jump = np.where(jump > SMOOTH * std, np.nan_to_num(jump), 0.0)
        impulse = factor * jump * item.grid.dt / np.sqrt(12.0)
        found[shaft] = np.hypot(found.get(shaft, 0.0), impulse)
    return found


def _typical_motion(model: Model, noise: TorqueNoise, item: Experiment) -> FloatArray:
    """Return (quarters, states) a motion of rms speed; rest where no bristle tells it from any other."""
    numbers = leaf_numbers(model, noise, item.name)
    moves = motions_of(model, numbers, item, np.arange(item.grid.time.size, dtype=np.int64))
    speeds = moves[:, len(model.drive.mechanism.angle_groups) :][:, : len(model.drive.mechanism.free_groups)]
    power: FloatArray = np.sum(speeds**2, axis=1)
    return np.tile(moves[int(np.argmin(np.abs(power - np.mean(power))))], (QUARTERS.size, 1))


def within(model: Model, noise: TorqueNoise, item: Experiment, seconds: float) -> FloatArray:
    """Return (outputs,) the mean variance that torque noise adds from a known start on, over some seconds."""
    numbers, motion = leaf_numbers(model, noise, item.name), _typical_motion(model, noise, item)
    units = unit_covariances(model, slopes_about(model, numbers, motion), seconds * QUARTERS)
    covariances: FloatArray = np.einsum("g,gsij->sij", group_density(model, noise, item.name) ** 2, units)
    return seen_variance(model.drive.mechanism, noise.numbers[item.name], covariances)
