"""A recording: named channels of one run of a machine, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One measured signal; NaN marks a missing sample."""

    name: str
    time: FloatArray
    """(n,) s, strictly increasing, on the clock of the channel."""
    values: FloatArray
    """(n,) in SI units."""
    unit: str
    """The SI unit of `values`, such as "rad" or "A"."""
    clock: str = "time"
    """Name of the time axis; channels that share it share their clock."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One run: its channels and where they came from; equal to itself alone."""

    name: str
    channels: Mapping[str, Channel]
    title: str = ""
    source: str = ""
    licence: str = ""
    path: Path | None = None
    sha256: str = ""
    attributes: Mapping[str, str] = field(default_factory=dict[str, str])
    """Further text attributes of the file, kept as found."""
    log_began: float | None = None
    """s, when the log began of which this is a piece; None is the first sample."""
    counted_from: float | None = None
    """s, where time is 0 for what changes with it, the same in all pieces of a log; None is the first sample."""

    @property
    def first_sample(self) -> float:
        """The earliest stamp of all channels, s; 0 of no sample."""
        return min((float(channel.time[0]) for channel in self.channels.values() if channel.time.size), default=0.0)

    @property
    def zero(self) -> float:
        """Where time is 0 for what changes with it, s."""
        return self.first_sample if self.counted_from is None else self.counted_from
