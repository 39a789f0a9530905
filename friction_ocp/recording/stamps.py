"""Dates and times of day, as text (2026-11-30 12:00:00.125, 30.11.2026 12:00:00, 12:00:00.125) or as NumPy has them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import date
from functools import lru_cache

import numpy as np

from friction_ocp.recording.csv_cells import is_missing
from friction_ocp.recording.foreign import Values, seconds_since
from friction_ocp.recording.recording import FloatArray

_STAMP = re.compile(
    r"(?P<day>(?:19|20)\d\d([-/.])\d{1,2}\2\d{1,2}[T ] *|\d{1,2}\.\d{1,2}\.(?:19|20)\d\d +)?"
    r"(?P<hour>\d{1,2}):(?P<minute>[0-5]\d):(?P<second>[0-5]\d)(?:[.,:](?P<part>\d{1,9}))?"
    r" ?(?P<zone>Z|UTC|(?P<ahead>[-+])(?P<hours>\d\d):?(?P<minutes>\d\d))?"
)
_SECOND, _DAY = 10**9, 86_400
_EPOCH = date(1970, 1, 1).toordinal()


def is_stamp(text: str) -> bool:
    """Whether a text is a date with a time of day, or a time of day."""
    return _nanoseconds(text) is not None


def are_dates(cells: Sequence[str]) -> bool:
    """Whether the first stamp among texts has a date."""
    return next((known[1] for cell in cells if (known := _nanoseconds(cell)) is not None), False)


def first_instant(columns: Sequence[Sequence[str]]) -> int:
    """Return the earliest of the first instants of columns of dates, ns since 1970; 0 where no column has dates."""
    firsts: list[int] = []
    for cells in columns:
        nanoseconds, dated = next((known for cell in cells if (known := _nanoseconds(cell)) is not None), (0, False))
        firsts += [nanoseconds] if dated else []
    return min(firsts, default=0)


def seconds_of(cells: Sequence[str], origin: int) -> tuple[FloatArray, list[int]]:
    """Return (n,) s since `origin`, ns since 1970, times of day as s since midnight, and the rows that are neither.

    Missing cells are NaN; differences are taken in integers, so that no digit of a date is lost.
    """
    values, bad = np.full(len(cells), np.nan), list[int]()
    for row, cell in enumerate(cells):
        known = _nanoseconds(cell)
        if known is not None:
            nanoseconds, dated = known
            values[row] = (nanoseconds - origin if dated else nanoseconds) * 1e-9
        elif not is_missing(cell):
            bad.append(row)
    return values, bad


def past_midnight(seconds: FloatArray) -> FloatArray:
    """Return times of day, s, (n,), that go on to grow where a day ends."""
    known = np.flatnonzero(np.isfinite(seconds))
    days = np.cumsum(np.diff(seconds[known], prepend=seconds[known[:1]]) < -0.5 * _DAY)
    grown = seconds.copy()
    grown[known] += _DAY * days
    return grown


def as_seconds(columns: Mapping[str, Values]) -> tuple[dict[str, Values], frozenset[str], int]:
    """Return columns with those of dates, spans and times of day in s, which these are, and their origin, ns."""
    series = {name: values for name, values in columns.items() if values.size > 1}  # one date alone is no time axis
    texts = {name: list(map(str, values)) for name, values in series.items() if _is_stamped(values)}
    dates = {name: values.astype("datetime64[ns]") for name, values in series.items() if values.dtype.kind == "M"}
    spans = {name: values.astype("timedelta64[ns]") for name, values in series.items() if values.dtype.kind == "m"}
    first: list[int] = [
        int(known[0].astype(np.int64)) for values in dates.values() if (known := values[~np.isnat(values)]).size
    ]
    first += [stamped] if (stamped := first_instant(list(texts.values()))) else []
    origin = min(first, default=0)
    found: dict[str, Values] = {name: seconds_of(cells, origin)[0] for name, cells in texts.items()}
    found |= {name: past_midnight(found[name]) for name, cells in texts.items() if not are_dates(cells)}
    for known, since in ((dates, origin), (spans, 0)):
        found |= {
            name: np.where(np.isnat(values), np.nan, seconds_since(values.astype(np.int64), since))
            for name, values in known.items()
        }
    return dict(columns) | found, frozenset(found), origin


def _is_stamped(values: Values) -> bool:
    """Whether an array holds texts that are stamps, all but those that are missing."""
    if values.dtype.kind != "U":
        return False
    stated = [text for text in map(str, values) if not is_missing(text)]
    return bool(stated) and all(map(is_stamp, stated))


def _nanoseconds(text: str) -> tuple[int, bool] | None:
    """Return ns since 1970, UTC, and True for a date, ns since midnight and False for a time of day."""
    match = _STAMP.fullmatch(text.strip())
    if match is None:
        return None
    hours, minutes, seconds = int(match["hour"]), int(match["minute"]), int(match["second"])
    part = match["part"]
    nanoseconds = (3600 * hours + 60 * minutes + seconds) * _SECOND + (int(part.ljust(9, "0")) if part else 0)
    if match["ahead"]:
        shift = (60 * int(match["hours"]) + int(match["minutes"])) * 60 * _SECOND
        nanoseconds -= shift if match["ahead"] == "+" else -shift
    if match["day"] is None:
        return nanoseconds, False
    days = _days(match["day"])
    return None if days is None or hours > 23 else (days * _DAY * _SECOND + nanoseconds, True)


@lru_cache(maxsize=1000)
def _days(text: str) -> int | None:
    """Return the days from 1970 to a date, whose year stands first or last."""
    numbers = [int(number) for number in re.findall(r"\d+", text)]
    year, month, day = numbers if numbers[0] > 31 else reversed(numbers)
    try:
        return date(year, month, day).toordinal() - _EPOCH
    except ValueError:
        return None
