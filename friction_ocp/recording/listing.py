"""What a foreign file holds, for whoever is about to write its map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from friction_ocp.recording.counters import looks_like_counter
from friction_ocp.recording.foreign import ForeignFile, Signal, check_sizes, is_real
from friction_ocp.recording.recording import FloatArray

READ_SAMPLES = 20_000_000
"""Samples in a file up to which all values are looked at, not only the times."""


@dataclass(frozen=True)
class Listed:
    """One signal and what it looks like."""

    signal: Signal
    rate: float | None
    """Samples per s (median), where the file or its first increasing column gives times."""
    seconds: float | None
    """From the first sample to the last."""
    low: float | None = None
    high: float | None = None
    turn: float | None = None
    """What it seems to lose each time it starts over."""


def list_signals(file: ForeignFile, path: Path) -> tuple[Listed, ...]:
    """Return every signal of a file with its rate, length and range."""
    numeric = [k for k, signal in enumerate(file.signals) if signal.numeric]
    values: dict[int, FloatArray] = {}
    if sum(file.signals[k].samples for k in numeric) <= READ_SAMPLES:
        check_sizes(path, [file.signals[k] for k in numeric])
        found = {k: column for k, column in file.read(numeric).items() if is_real(column)}
        values = {k: np.asarray(column, dtype=np.float64) for k, column in found.items()}
    axes = {clock: file.clock(clock) for clock in dict.fromkeys(signal.clock for signal in file.signals) if clock}
    guessed = _guessed_time(file.signals, values)
    axes[""] = values[guessed] if guessed is not None else np.empty(0)
    return tuple(_listed(signal, axes[signal.clock], values.get(k)) for k, signal in enumerate(file.signals))


def describe(file: ForeignFile, path: Path) -> str:
    """Return a file as text: a line of its own, then one a signal."""
    listed = list_signals(file, path)
    count = f"{len(listed)} column" + ("s" if len(listed) != 1 else "")
    lines = [f"{path}: {count}" + (f", {file.summary}" if file.summary else "")]
    if any(item.rate is not None and not item.signal.clock for item in listed):
        lines.append("Rates and lengths hold if the first increasing column is the time, in s.")
    if file.origin:
        lines.append(f"Times count from {file.origin}.")
    heads = ("", "column", "unit", "samples", "per s", "s", "lowest", "highest", "")
    return "\n".join([*lines, *_aligned([heads, *(_cells(k, item) for k, item in enumerate(listed))])])


def _guessed_time(signals: Sequence[Signal], values: dict[int, FloatArray]) -> int | None:
    """Return the first column that always grows, where the file names no time axis."""
    for k, column in values.items():
        if not signals[k].clock and len(column) > 1 and bool(np.all(np.diff(column) > 0.0)):
            return k
    return None


def _listed(signal: Signal, time: FloatArray, values: FloatArray | None) -> Listed:
    step = float(np.median(np.diff(time))) if len(time) > 1 and len(time) == signal.samples else 0.0
    rate, seconds = (1.0 / step, float(time[-1] - time[0])) if step > 0.0 else (None, None)
    present = np.empty(0) if values is None else values[np.isfinite(values)]
    if not present.size:
        return Listed(signal, rate, seconds)
    turn = looks_like_counter(present)
    return Listed(signal, rate, seconds, float(present.min()), float(present.max()), turn)


def _cells(index: int, item: Listed) -> tuple[str, ...]:
    numbers = (item.rate, item.seconds, item.low, item.high)
    note = "" if item.turn is None else f"starts over: wrap: {item.turn:.10g}?"
    if not item.signal.numeric:
        note = "no numbers"
    texts = ("" if number is None else f"{number:.6g}" for number in numbers)
    return (str(index), item.signal.name, item.signal.unit, str(item.signal.samples), *texts, note)


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines, text to the left and numbers to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    left = (1, 2, len(widths) - 1)
    lines: list[str] = []
    for row in rows:
        cells = [
            cell.ljust(width) if k in left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return lines
