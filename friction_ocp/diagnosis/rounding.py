"""Errors of rounding that samples share: counts at which a drive stays, and counts that beat with the sampling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import LinearRecording
from friction_ocp.estimation.noise import step_of
from friction_ocp.recording.repeats import is_stay
from friction_ocp.simulation.grid import FloatArray, IntArray

WAVES = 12
"""Waves of the rounding error over one count that are looked at; they hold 95 % of its power."""


@dataclass(frozen=True)
class Counter:
    """A channel of a recording that shows whole counts."""

    rows: IntArray
    """Rows of its samples at which the drive does not stay."""
    phase: FloatArray
    """(rows,) where the model passes them, counts."""
    powers: FloatArray
    """(waves,) share of the channel's noise in each wave of the rounding error over one count."""


@dataclass(frozen=True)
class Rounding:
    """What the rounding errors of different samples have in common."""

    stays: IntArray
    """(rows,) the number of the stay, one value of a channel for several samples, to which a row belongs, or -1.

    A counter that shows the same while the drive stands still or turns back errs by the same.
    """
    counters: tuple[Counter, ...] = ()
    inputs: FloatArray | None = None
    """(rows, errors) what slow errors of rounded inputs, each of deviation 1, do to the rows."""

    def covariance(self, columns: FloatArray) -> FloatArray:
        """Return (k, k) the covariance of the sums of noise over columns (rows, k).

        Noise is white but for rounding. Within a stay of n samples errors that are one error have n times the power
        along their sum, and none beside it; the latter is left as it is for noise that is not.
        """
        known = columns.T @ columns + self._shared(columns)
        if self.inputs is not None:
            by_inputs: FloatArray = columns.T @ self.inputs
            known += by_inputs @ by_inputs.T
        return known + _positive(self._beating(columns), known) if self.counters else known

    def _shared(self, columns: FloatArray) -> FloatArray:
        """Return (k, k) what stays add."""
        inside = np.flatnonzero(self.stays >= 0)
        _, number, lengths = np.unique(self.stays[inside], return_inverse=True, return_counts=True)
        sums = np.zeros((lengths.size, columns.shape[1]))
        np.add.at(sums, number, columns[inside])
        return (sums * ((lengths - 1.0) / np.maximum(lengths, 1))[:, None]).T @ sums

    def _beating(self, columns: FloatArray) -> FloatArray:
        """Return (k, k) what is different because a counter's error depends on where between two counts it is read.

        At a steady speed of nearly whole counts per sample (or halves, thirds ...) it is slow, however fast the drive.
        The error of rounding is a sum of waves over one count, of power 6 / (pi m)^2 of its own (Fourier series of the
        sawtooth; Widrow, Kollar, Quantization Noise, 2008, ch. 3), at a phase that is anything.
        """
        found = np.zeros((columns.shape[1], columns.shape[1]))
        for counter in self.counters:
            own = columns[counter.rows]
            for wave, power in enumerate(counter.powers, 1):
                angle = 2.0 * np.pi * wave * counter.phase
                for part in (np.cos(angle) @ own, np.sin(angle) @ own):
                    found += power * np.outer(part, part)
            found -= float(np.sum(counter.powers)) * (own.T @ own)
        return found


def rounding_of(fitted: FittedModel) -> Rounding:
    """Return what the rounding errors of a fit's recordings have in common."""
    rows = fitted.linear.rows
    stays, count, counters = np.full(rows.residual.size, -1, dtype=np.int64), 0, list[Counter]()
    for index, item in enumerate(fitted.linear.recordings):
        for channel in range(item.seen.shape[1]):
            own = np.flatnonzero((rows.recording == index) & (rows.channel == channel))
            own = own[item.seen[rows.node[own], channel]]
            values = item.item.measured[rows.node[own], channel]
            number = np.concatenate(([0], np.cumsum(np.diff(values) != 0.0)))[: own.size]
            long = is_stay(values)[number]
            stays[own[long]] = count + number[long]
            count += int(own.size)
            step = step_of(fitted.model.problem.drive.outputs[channel], values)
            if step is not None:
                counters.append(_counter(item, channel, step, own[~long], rows.node[own[~long]]))
    return Rounding(stays, tuple(counters))


def _counter(item: LinearRecording, channel: int, step: float, rows: IntArray, nodes: IntArray) -> Counter:
    """Return a counter."""
    powers = wave_powers(step, float(item.noise[channel]))
    return Counter(rows, item.y[nodes, channel] / step, powers)


def wave_powers(step: float, noise: float) -> FloatArray:
    """Return (waves,) the share of a noise floor in each wave of the error of rounding to whole steps.

    What else is noise in the floor blurs the finer waves.
    """
    waves = np.arange(1.0, WAVES + 1.0)
    share = step**2 / 12.0 / noise**2
    other = max(noise**2 - step**2 / 12.0, 0.0) / step**2
    powers: FloatArray = min(share, 1.0) * 6.0 / (np.pi * waves) ** 2 * np.exp(-((2.0 * np.pi * waves) ** 2) * other)
    return powers


def _positive(change: FloatArray, known: FloatArray) -> FloatArray:
    """Return the part of a change of a covariance that makes it larger: other noise does not average out as fast."""
    powers, axes = np.linalg.eigh(known)
    told = powers > 1e-12 * max(float(powers[-1]), 1e-300)
    if not np.any(told):
        return np.zeros_like(known)
    root = axes[:, told] * np.sqrt(powers[told])
    back = axes[:, told] / np.sqrt(powers[told])
    sizes, turns = np.linalg.eigh(back.T @ change @ back)
    lifted = root @ turns
    return (lifted * np.maximum(sizes, 0.0)) @ lifted.T
