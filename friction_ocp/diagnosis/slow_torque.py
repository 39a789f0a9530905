"""Is there a slow torque or a slow error of a channel that the model lacks, of whatever shape, and where.

Each place is given a constant of its own over every stretch of time: a torque on a shaft, an internal torque in an
elastic transmission (a twist), an error of a channel. What the constants of a place explain is compared with what noise
makes of them, and with that of the other places.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.blocks import stats
from friction_ocp.diagnosis.contrast import contrast
from friction_ocp.diagnosis.excess import DOUBTED
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.drive.parts import Channel, Drive, ExternalTorque, KinematicError, Shaft
from friction_ocp.effects.effect import (
    Clues,
    change_channel,
    change_shaft,
    change_transmission,
    either_way,
    moving_shafts,
)
from friction_ocp.parameters import start_of
from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray

STRETCHES = 24
"""In each recording, a constant in each."""
SHARE = 0.05
"""Size of a constant, over what is typical there, at which it is simulated: small enough to be linear."""
FAR = 1e9
"""Period of a wave that is a constant wherever a drive goes, rad."""
TOLD = 1e-10
"""Power of a combination of constants over the largest one below which it is rounding."""
DEVIATIONS = 10.0
"""Size of a channel's constant over its noise floor at which it is simulated."""


@dataclass(frozen=True)
class SlowTorque:
    """What a torque, or an error, that is constant over stretches of time would explain at one place."""

    component: str
    ratio: float
    """Mean square of its amplitudes over their variance under noise alone."""
    p_value: float
    """Of a ratio this large under noise, the floors being off by their doubt."""


@dataclass(frozen=True)
class Probe:
    """A drive with a constant at one place, and the values at which it is simulated."""

    component: str
    drive: Drive
    values: Mapping[str, float]


def slow_torques(fitted: FittedModel, clues: Clues) -> tuple[SlowTorque, ...]:
    """Test shafts, elastic transmissions and channels; free runs, whose errors add up, are left out."""
    if fitted.footing.segment_s is None:
        return ()
    stays = _stays(fitted)
    return tuple(slow_torque_of(fitted, probe, stays) for probe in probes(fitted, clues))


def significant(found: Sequence[SlowTorque], level: float) -> bool:
    """Whether there is a slow torque or error somewhere, at a level that is shared among the places (Bonferroni)."""
    return any(item.p_value * len(found) < level for item in found)


def probes(fitted: FittedModel, clues: Clues) -> Iterator[Probe]:
    """Yield the places that compete."""
    drive = fitted.model.problem.drive
    for shaft in moving_shafts(drive):
        path, size = f"{shaft.name}.external_torque.constant", SHARE * clues.typical_torque[shaft.name]
        added = change_shaft(drive, shaft.name, external_torque=ExternalTorque(either_way(size)))
        yield Probe(shaft.name, added, {path: _constant(fitted, shaft) + size})
    for item in drive.transmissions:
        if not item.rigid and item.kinematic_error is None:
            stiffness = max(clues.numbers[f"{item.name}.stiffness"], 1e-300)
            size = SHARE * clues.typical_torque[item.to_shaft] / stiffness
            wave = KinematicError(either_way(size), 0.0, FAR)
            added = change_transmission(drive, item.name, kinematic_error=wave)
            yield Probe(item.name, added, {f"{item.name}.kinematic_error.cosine": size})
    for k, channel in enumerate(drive.outputs):
        size = DEVIATIONS * float(fitted.model.noise[k])
        added = change_channel(drive, channel.name, offset=either_way(size))
        yield Probe(channel.name, added, {f"{channel.name}.offset": _offset(fitted, channel) + size})


def _constant(fitted: FittedModel, shaft: Shaft) -> float:
    """Return the constant torque that the model has on a shaft."""
    known = 0.0 if shaft.external_torque is None else shaft.external_torque.constant
    return _number(fitted, f"{shaft.name}.external_torque.constant", known)


def _offset(fitted: FittedModel, channel: Channel) -> float:
    return _number(fitted, f"{channel.name}.offset", channel.offset)


def _number(fitted: FittedModel, path: str, stated: object) -> float:
    guess = start_of(stated)
    return fitted.values.get(path, float(guess) if isinstance(guess, (int, float)) else 0.0)


def _stays(fitted: FittedModel) -> IntArray:
    """Return (rows,) the number of the stay, one value of a channel for several samples, to which a row belongs, or -1.

    A counter that shows the same while the drive stands still or turns back errs by the same.
    """
    rows = fitted.linear.rows
    found, count = np.full(rows.residual.size, -1, dtype=np.int64), 0
    for index, item in enumerate(fitted.linear.recordings):
        for channel in range(item.seen.shape[1]):
            own = np.flatnonzero((rows.recording == index) & (rows.channel == channel))
            own = own[item.seen[rows.node[own], channel]]
            values = item.item.measured[rows.node[own], channel]
            number = np.concatenate(([0], np.cumsum(np.diff(values) != 0.0)))[: own.size]
            long = _is_stay(values)[number]
            found[own[long]] = count + number[long]
            count += int(own.size)
    return found


def _is_stay(values: FloatArray) -> BoolArray:
    """Return (runs of equal values,) which are not just passed through.

    A count that a drive passes at a steady speed errs by as much on the way in as on the way out, which adds up to
    nothing. Where it turns back, or dwells for longer than at the counts beside, that is not so.
    """
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    lengths = np.diff(np.concatenate(([0], edges, [values.size])))
    if lengths.size < 3:
        return lengths > 1
    level = values[np.concatenate(([0], edges))]
    passed = np.zeros(lengths.size, dtype=bool)
    passed[1:-1] = (level[1:-1] - level[:-2]) * (level[2:] - level[1:-1]) > 0
    beside = np.zeros(lengths.size)
    beside[1:-1] = np.maximum(lengths[:-2], lengths[2:])
    return (lengths > 1) & ~(passed & (lengths <= 2 * beside))


def slow_torque_of(fitted: FittedModel, probe: Probe, stays: IntArray) -> SlowTorque:
    """Test one place; `stays` (rows,) numbers the samples that share an error of rounding, -1 for those that do not."""
    built = contrast(fitted.model, fitted.linear, probe.drive)
    rows = fitted.linear.rows
    theta, columns, begin = built.theta(probe.values), list[FloatArray](), 0
    recordings = fitted.linear.recordings
    tracks = built.simulate([(index, theta) for index in range(len(recordings))])
    for item, track in zip(recordings, tracks, strict=True):
        stretch = (np.arange(item.cut.count) * STRETCHES) // item.cut.count
        marks = (stretch[:, None] == np.arange(STRETCHES)).astype(float)
        by_end = (track.end - item.end)[:, :, None] * marks[:, None, :]
        by_y = (track.y - item.y)[:, :, None] * marks[item.segment][:, None, :]
        own = item.change(by_y, by_end)
        whole = np.zeros((rows.residual.size, STRETCHES))
        whole[begin : begin + own.shape[0]] = own
        columns.append(whole)
        begin += own.shape[0]
    return _tested(probe.component, fitted, rows.absorbed(np.concatenate(columns, axis=1)), stays)


def _tested(place: str, fitted: FittedModel, columns: FloatArray, stays: IntArray) -> SlowTorque:
    """Test amplitudes against what noise makes of them: white, and for each stay one error of the same size."""
    rows = fitted.linear.rows
    powers, axes = np.linalg.eigh(columns.T @ columns + _shared(columns, stays))
    told = powers > TOLD * max(float(powers[-1]), 1e-300)
    freedom = int(np.sum(told))
    if freedom == 0:
        return SlowTorque(place, 1.0, 1.0)
    amplitudes = axes[:, told].T @ (columns.T @ rows.residual) / np.sqrt(powers[told])
    ratio = float(np.mean(amplitudes**2))
    return SlowTorque(place, ratio, float(stats.chi2.sf(freedom * ratio / DOUBTED, freedom)))


def _shared(columns: FloatArray, stays: IntArray) -> FloatArray:
    """Return (columns, columns) what stays add to the covariance that white noise gives the sums over columns.

    Within a stay of n samples, errors that are one error have n times the power along their sum, and none beside it;
    the latter is left as it is for noise that is not.
    """
    inside = np.flatnonzero(stays >= 0)
    _, number, lengths = np.unique(stays[inside], return_inverse=True, return_counts=True)
    sums = np.zeros((lengths.size, columns.shape[1]))
    np.add.at(sums, number, columns[inside])
    return (sums * ((lengths - 1.0) / np.maximum(lengths, 1))[:, None]).T @ sums
