"""Is there a slow torque or a slow error of a channel that the model lacks, of whatever shape, and where.

Each place is given a constant of its own over every stretch of time: a torque on a shaft, an internal torque in an
elastic transmission (a twist), an error of a channel. What the constants of a place explain is compared with what noise
makes of them, and with that of the other places.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.optimize as _optimize  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.diagnosis.blocks import stats
from friction_ocp.diagnosis.contrast import contrast
from friction_ocp.diagnosis.excess import DOUBTED
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.input_rounding import STRETCHES, input_columns, stretch_of
from friction_ocp.diagnosis.rounding import Rounding, rounding_of
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
from friction_ocp.simulation.grid import FloatArray

optimize: Any = _optimize  # its own types are incomplete

SHARE = 0.05
"""Size of a constant, over what is typical there, at which it is simulated: small enough to be linear."""
FAR = 1e9
"""Period of a wave that is a constant wherever a drive goes, rad."""
TOLD = 1e-4
"""Power of a combination of constants over the largest one below which it says nothing: where parameters absorb all but
a hundredth of it, noise of the inputs and the model's curvature make what is left."""
REACH = 3.0
"""How far, by its logarithm, the spread of constants is looked for beyond what the largest of them alone would mean."""
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
    density: float = 0.0
    """White torque noise of a shaft that makes as much beyond that, N m/sqrt(Hz)."""


@dataclass(frozen=True)
class Probe:
    """A drive with a constant at one place, and the values at which it is simulated."""

    component: str
    drive: Drive
    values: Mapping[str, float]
    torque: float = 0.0
    """The constant, N m, where it is a torque on a shaft."""


def slow_torques(fitted: FittedModel, clues: Clues) -> tuple[SlowTorque, ...]:
    """Test shafts, elastic transmissions and channels; free runs, whose errors add up, are left out.

    And so are short predictions, whose starts are as measured.
    """
    if not fitted.footing.joined:
        return ()
    places = [(probe, stretched(fitted, probe)) for probe in probes(fitted, clues)]
    by_torque = dict[str, FloatArray]()
    for probe, columns in places:  # shafts come first: a channel may have the name of one
        if probe.component in clues.typical_torque:
            by_torque.setdefault(probe.component, columns / (SHARE * clues.typical_torque[probe.component]))
    rounding = replace(rounding_of(fitted), inputs=input_columns(fitted, by_torque))
    return tuple(slow_torque_of(fitted, probe, columns, rounding) for probe, columns in places)


def significant(found: Sequence[SlowTorque], level: float) -> bool:
    """Whether there is a slow torque or error somewhere, at a level that is shared among the places (Bonferroni)."""
    return any(item.p_value * len(found) < level for item in found)


def probes(fitted: FittedModel, clues: Clues) -> Iterator[Probe]:
    """Yield the places that compete."""
    drive = fitted.model.problem.drive
    for shaft in moving_shafts(drive):
        path, size = f"{shaft.name}.external_torque.constant", SHARE * clues.typical_torque[shaft.name]
        added = change_shaft(drive, shaft.name, external_torque=ExternalTorque(either_way(size)))
        yield Probe(shaft.name, added, {path: _constant(fitted, shaft) + size}, size)
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


def stretched(fitted: FittedModel, probe: Probe) -> FloatArray:
    """Return (rows, stretches) what the constant of a place does to the residuals, over each stretch alone.

    The stretches of all recordings are numbered through; parameters and node states have absorbed what they can.
    """
    built = contrast(fitted.model, fitted.linear, probe.drive)
    rows = fitted.linear.rows
    theta, columns, begin = built.theta(probe.values), list[FloatArray](), 0
    recordings = fitted.linear.recordings
    tracks = built.simulate([(index, theta) for index in range(len(recordings))])
    for item, track in zip(recordings, tracks, strict=True):
        marks = (stretch_of(item)[:, None] == np.arange(STRETCHES)).astype(float)
        by_end = (track.end - item.end)[:, :, None] * marks[:, None, :]
        by_y = (track.y - item.y)[:, :, None] * marks[item.segment][:, None, :]
        own = item.change(by_y, by_end)
        whole = np.zeros((rows.residual.size, STRETCHES))
        whole[begin : begin + own.shape[0]] = own
        columns.append(whole)
        begin += own.shape[0]
    return rows.absorbed(np.concatenate(columns, axis=1))


def slow_torque_of(fitted: FittedModel, probe: Probe, columns: FloatArray, rounding: Rounding) -> SlowTorque:
    """Test the amplitudes of one place, which do `columns`, against what noise makes of them; see `rounding`."""
    rows = fitted.linear.rows
    powers, axes = np.linalg.eigh(rounding.covariance(columns))
    told = powers > TOLD * max(float(powers[-1]), 1e-300)
    freedom = int(np.sum(told))
    if freedom == 0:
        return SlowTorque(probe.component, 1.0, 1.0)
    amplitudes = axes[:, told].T @ (columns.T @ rows.residual) / np.sqrt(powers[told])
    ratio = float(np.mean(amplitudes**2))
    p_value = float(stats.chi2.sf(freedom * ratio / DOUBTED, freedom))
    spans = [float(np.ptp(item.item.grid.time)) / STRETCHES for item in fitted.linear.recordings]
    density = probe.torque * spread(amplitudes, powers[told]) * float(np.sqrt(np.mean(spans)))
    return SlowTorque(probe.component, ratio, p_value, density)


def spread(amplitudes: FloatArray, powers: FloatArray) -> float:
    """Return the likeliest deviation of constants whose amplitudes (k,), over noise of 1, have it by roots of `powers`.

    A normal variance component, by maximum likelihood; 0 where noise alone is likelier.
    """
    squares = amplitudes**2

    def loss(log_size: float) -> float:
        variance = 1.0 + powers * np.exp(2.0 * log_size)
        return float(np.sum(np.log(variance) + squares / variance))

    middle = 0.5 * np.log(max(float(np.max(squares)), 1.0) / powers)
    ends = float(np.min(middle)) - REACH, float(np.max(middle)) + REACH
    best = optimize.minimize_scalar(loss, bounds=ends, method="bounded")
    return float(np.exp(best.x)) if best.fun < float(np.sum(squares)) else 0.0
