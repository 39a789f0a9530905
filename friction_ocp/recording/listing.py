"""What a foreign file holds, for whoever is about to write its map."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from friction_ocp.errors import FrictionOcpError
from friction_ocp.quantities import dimension_of, to_si
from friction_ocp.recording.counters import looks_like_counter
from friction_ocp.recording.foreign import ForeignFile, Signal, check_sizes, is_real
from friction_ocp.recording.recording import FloatArray
from friction_ocp.recording.sampling import held_for

READ_SAMPLES = 20_000_000
"""Samples in a file up to which all values are looked at, not only the times."""
_SHOWN = 40
"""Characters of a text that are shown."""


@dataclass(frozen=True)
class Listed:
    """One signal and what it looks like."""

    signal: Signal
    rate: float | None
    """Samples per s (median) that are not missing, where the file or an increasing column gives times."""
    seconds: float | None
    """From the first of them to the last."""
    low: float | None = None
    high: float | None = None
    turn: float | None = None
    """What it seems to lose each time it starts over."""
    held: int | None = None
    """How many times each value is repeated, where that is so."""
    empty: int = 0
    """Samples that are missing."""
    timed_by: str = ""
    """The column that was taken for the time, and its unit; "" where the file has a time axis, or there is none."""


@dataclass(frozen=True)
class _Axis:
    """Times of a signal, s, and what `Listed.timed_by` says of them."""

    time: FloatArray
    timed_by: str = ""


_NO_TIMES = _Axis(np.empty(0))


def list_signals(file: ForeignFile, path: Path) -> tuple[Listed, ...]:
    """Return every signal of a file with its rate, length and range."""
    numeric = [k for k, signal in enumerate(file.signals) if signal.numeric]
    values: dict[int, FloatArray] = {}
    if sum(file.signals[k].samples for k in numeric) <= READ_SAMPLES:
        check_sizes(path, [file.signals[k] for k in numeric])
        found = {k: column for k, column in file.read(numeric).items() if is_real(column)}
        values = {k: np.asarray(column, dtype=np.float64) for k, column in found.items()}
    clocks = dict.fromkeys(signal.clock for signal in file.signals if signal.clock)
    axes = {clock: _Axis(file.clock(clock)) for clock in clocks}
    guessed = {k: _as_time(file.signals[k], column) for k, column in values.items() if not file.signals[k].clock}
    times = {k: axis for k, axis in guessed.items() if axis is not None}

    def axis_of(k: int, signal: Signal) -> _Axis:
        return axes[signal.clock] if signal.clock else _guessed_axis(k, signal, file.signals, times)

    return tuple(_listed(signal, axis_of(k, signal), values.get(k)) for k, signal in enumerate(file.signals))


def describe(file: ForeignFile, path: Path) -> str:
    """Return a file as text: a line of its own, then one a signal."""
    listed = list_signals(file, path)
    count = f"{len(listed)} column" + ("s" if len(listed) != 1 else "")
    lines = [f"{path}: {count}" + (f", {file.summary}" if file.summary else "")]
    guesses = list(dict.fromkeys(item.timed_by for item in listed if item.timed_by))
    if guesses:
        lines.append(f"Rates and lengths hold if times are in {', '.join(guesses)}.")
    if file.origin:
        lines.append(f"Times count from {file.origin}.")
    heads = ("", "column", "unit", "samples", "per s", "s", "lowest", "highest", "")
    return "\n".join([*lines, *_aligned([heads, *(_cells(k, item) for k, item in enumerate(listed))])])


def _as_time(signal: Signal, column: FloatArray) -> _Axis | None:
    """Return a column as a time axis where it always grows and its unit, if it has one, is one of time."""
    present = column[np.isfinite(column)]
    if len(present) < 2 or not bool(np.all(np.diff(present) > 0.0)):
        return None
    seconds, unit = (to_si(column, signal.unit)[0], signal.unit) if _is_time(signal) else (column, "s")
    return _Axis(seconds, f"'{signal.name}' ({unit})") if _is_time(signal) or not signal.unit else None


def _is_time(signal: Signal) -> bool:
    try:
        return bool(signal.unit) and dimension_of(signal.unit) == "time"
    except FrictionOcpError:
        return False


def _guessed_axis(k: int, signal: Signal, signals: Sequence[Signal], times: dict[int, _Axis]) -> _Axis:
    """Return the likely times of a signal that has none of its own: a column that is as long.

    Units tell better than names which columns are times. Of several, one of the same struct or table comes first,
    then the nearest one before it.
    """
    fitting = [j for j in times if signals[j].samples == signal.samples]
    known = [j for j in fitting if _is_time(signals[j])] or [j for j in fitting if _is_called_time(signals[j])]
    if not fitting:
        return _NO_TIMES
    if not known:
        return times[fitting[0]]
    beside = [j for j in known if _whole(signals[j]) == _whole(signal)] or known
    return times[next((j for j in reversed(beside) if j <= k), beside[0])]


def _is_called_time(signal: Signal) -> bool:
    """Whether the name of a signal says that it is a time."""
    return bool(re.match(r"t$|t[\W_]|time|stamp", signal.name.rpartition(".")[2].lower()))


def _whole(signal: Signal) -> str:
    """Return the struct or table that a signal is a part of; "" for one that stands alone."""
    return signal.name.rpartition(".")[0]


def _listed(signal: Signal, axis: _Axis, values: FloatArray | None) -> Listed:
    present = np.ones(signal.samples, dtype=bool) if values is None else np.isfinite(values)
    time = axis.time[present] if len(axis.time) == present.size else np.empty(0)
    counter = None
    if values is not None:
        timed = len(time) == np.count_nonzero(present) and bool(np.all(np.isfinite(time)))
        counter = looks_like_counter(values[present], time if timed else None)
    time = time[np.isfinite(time)]
    step = float(np.quantile(np.diff(time), 0.5, method="lower")) if len(time) > 1 else 0.0
    rate, seconds = (1.0 / step, float(time[-1] - time[0])) if step > 0.0 else (None, None)
    timed_by = "" if rate is None else axis.timed_by
    if values is None or not present.any():
        return Listed(signal, rate, seconds, timed_by=timed_by)
    seen = values[present]
    empty = int(np.count_nonzero(~present))
    turn = None if counter is None else counter.turn
    held = held_for(values)
    return Listed(signal, rate, seconds, float(seen.min()), float(seen.max()), turn, held, empty, timed_by)


def _cells(index: int, item: Listed) -> tuple[str, ...]:
    numbers = (item.rate, item.seconds, item.low, item.high)
    notes = [] if item.turn is None else [f"starts over: wrap: {item.turn:.10g}?"]
    if item.held is not None:
        new = "" if item.rate is None else f", {item.rate / item.held:.6g} new ones per s"
        notes.append(f"repeats every value: held: {item.held}?{new}")
    if item.empty:
        notes.append(f"{item.empty} empty")
    if not item.signal.numeric:
        text = item.signal.text[:_SHOWN].strip()
        notes = [f"'{text}'" if text.isprintable() and text else "no numbers"]
    texts = ("" if number is None else f"{number:.6g}" for number in numbers)
    return (str(index), item.signal.name, item.signal.unit, str(item.signal.samples), *texts, ", ".join(notes))


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
