"""Blocks of time that are nearly independent of one another: what autocorrelated residuals are counted in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.diagnosis.linear import Rows
from friction_ocp.simulation.grid import FloatArray, IntArray

stats: Any = _stats  # its own types are incomplete

FEWEST, MOST = 24, 200
"""Blocks over all recordings: enough to average, long enough to be independent."""
CORRELATION_LENGTHS = 4.0
"""Length of a block over the integrated autocorrelation time."""


@dataclass(frozen=True)
class Blocks:
    """A block number for every row."""

    of_row: IntArray
    """(rows,); -1 for rows that belong to no time, such as priors."""
    recording: IntArray
    """(blocks,) the recording of each block."""
    independent: float = 1.0
    """Independent samples that a block has on average: one for each integrated autocorrelation time that it is meant to
    be long, fewer where recordings are too short for such blocks, and one at least."""

    @property
    def count(self) -> int:
        """Number of blocks."""
        return self.recording.size

    def sums(self, values: FloatArray) -> FloatArray:
        """Return (blocks, ...) sums of values (rows, ...) over blocks."""
        inside = self.of_row >= 0
        total = np.zeros((self.count, *values.shape[1:]))
        np.add.at(total, self.of_row[inside], values[inside])
        return total


def blocks_of(rows: Rows) -> Blocks:
    """Cut every recording into blocks several correlation times long."""
    recordings = [int(k) for k in np.unique(rows.recording) if k >= 0]
    of_row = np.full(rows.residual.size, -1, dtype=np.int64)
    owner: list[int] = []
    independent = 0.0
    for k in recordings:
        own = np.flatnonzero(rows.recording == k)
        time = rows.time[own]
        begin, end = float(time.min()), float(time.max())
        length = CORRELATION_LENGTHS * max(
            _correlation_time(rows, k, c) for c in np.unique(rows.channel[own]) if c >= 0
        )
        fewest, lengths = int(np.ceil(FEWEST / len(recordings))), (end - begin) / max(length, 1e-300)
        count = int(np.clip(lengths, fewest, max(MOST // len(recordings), fewest)))
        independent += float(np.clip(CORRELATION_LENGTHS * lengths, count, CORRELATION_LENGTHS * count))
        place = np.minimum(((time - begin) / max(end - begin, 1e-300) * count).astype(np.int64), count - 1)
        of_row[own] = len(owner) + place
        owner += [k] * count
    return Blocks(of_row, np.array(owner, dtype=np.int64), independent / max(len(owner), 1))


def _correlation_time(rows: Rows, recording: int, channel: int) -> float:
    """Return the integrated autocorrelation time of a channel, s (initial positive sequence)."""
    own = (rows.recording == recording) & (rows.channel == channel)
    r, time = rows.residual[own], rows.time[own]
    if r.size < 8 or not np.any(r):
        return 0.0
    power = np.abs(np.fft.rfft(r - r.mean(), 2 * r.size)) ** 2
    rho = np.fft.irfft(power)[: r.size]
    rho = rho / max(float(rho[0]), 1e-300)
    stop = int(np.argmax(rho <= 0)) or r.size
    return (1.0 + 2.0 * float(np.sum(rho[1:stop]))) * float(np.median(np.diff(time)))


@dataclass(frozen=True)
class Score:
    """What adding some columns to a model would gain, seen from the model without them."""

    sizes: FloatArray
    """(k,) best coefficients of the columns."""
    gain: float
    """Decrease of the objective that the linearisation predicts."""
    p_value: float
    """Probability of a score this large where the columns do not belong, residuals correlated within blocks."""


NOTHING = Score(np.zeros(0), 0.0, 1.0)


def score(rows: Rows, blocks: Blocks, columns: FloatArray) -> Score:
    """Test columns (rows, k) that the parameters have been absorbed from (Lagrange multiplier, block-robust)."""
    own = np.linalg.norm(columns, axis=0)
    if not np.all(np.isfinite(own)) or not np.all(own > 0):
        return NOTHING
    scaled = columns / own
    gram, pull = scaled.T @ scaled, -scaled.T @ rows.residual
    sizes = np.asarray(np.linalg.lstsq(gram, pull, rcond=1e-10)[0], dtype=np.float64)
    gain = 0.5 * float(pull @ sizes)
    return Score(sizes / own, gain, robust_p_value(blocks.sums(scaled * rows.residual[:, None])))


def robust_p_value(sums: FloatArray) -> float:
    """Return the p-value of Hotelling's test that block sums (blocks, k) have mean zero."""
    count, k = sums.shape
    if count <= k:
        return 1.0
    mean = sums.mean(axis=0)
    centred = sums - mean
    spread = centred.T @ centred / (count - 1)
    weighted = np.asarray(np.linalg.lstsq(spread, mean, rcond=1e-12)[0], dtype=np.float64)
    statistic = count * float(mean @ weighted)
    return float(stats.f.sf(statistic * (count - k) / (k * (count - 1)), k, count - k))
