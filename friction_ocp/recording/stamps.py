"""Dates and times of day, as text (2026-11-30 12:00:00.125, 11/30/2026 12:00:00 PM, 12:00:00) or as NumPy has them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import lru_cache

import numpy as np

from friction_ocp.recording.csv_cells import is_missing
from friction_ocp.recording.foreign import Values, seconds_since
from friction_ocp.recording.recording import FloatArray

_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MONTH, _YEAR = rf"(?:{'|'.join(_MONTHS)})[a-z]{{0,6}}", r"(?:19|20)\d\d"
_DAY_FORMS = (
    rf"{_YEAR}(?P<first>[-/.])\d{{1,2}}(?P=first)\d{{1,2}}",
    rf"\d{{1,2}}(?P<last>[-/.])\d{{1,2}}(?P=last){_YEAR}",
    rf"\d{{1,2}}[- ]{_MONTH}[- ]{_YEAR}",
    rf"{_MONTH} \d{{1,2}},? {_YEAR}",
)
_STAMP = re.compile(
    rf"(?:(?P<day>{'|'.join(_DAY_FORMS)})(?:T|,? +))?"
    r"(?P<hour>\d{1,2}):(?P<minute>[0-5]\d):(?P<second>[0-5]\d)(?:[.,:](?P<part>\d{1,9}))?"
    r"(?: ?(?P<half>[ap])\.?m\.?)? ?(?P<zone>Z|UTC|(?P<ahead>[-+])(?P<hours>\d\d):?(?P<minutes>\d\d))?",
    re.ASCII | re.IGNORECASE,
)
_SWAPPABLE = re.compile(rf"\s*\d{{1,2}}[-/]\d{{1,2}}[-/]{_YEAR}", re.ASCII)
"""Dates in which some write the day first, and others the month."""
_SECOND, _DAY = 10**9, 86_400
_EPOCH = date(1970, 1, 1).toordinal()
LOOKED_AT = 200
"""Cells at the beginning of a column that tell how it is written, beside its last one."""


@dataclass(frozen=True)
class Writing:
    """How a column writes its stamps."""

    dated: bool
    """With dates; times of day alone otherwise."""
    day_first: bool = False
    """Whether 03/04/2026 is in April."""

    def nanoseconds(self, cell: str) -> int | None:
        """Return ns since 1970, UTC, of a date, ns since midnight of a time of day, None for what is neither."""
        known = _nanoseconds(cell, self.day_first)
        return None if known is None else known[0]

    def first_of(self, cells: Sequence[str]) -> int | None:
        """Return the first instant of a column, as `nanoseconds` does; None where it has none."""
        return next((known for cell in cells if (known := self.nanoseconds(cell)) is not None), None)

    def seconds_of(self, cells: Sequence[str], origin: int) -> tuple[FloatArray, list[int]]:
        """Return (n,) s since `origin`, ns since 1970, times of day as s since midnight, and the rows that are neither.

        Missing cells are NaN; differences are taken in integers, so that no digit of a date is lost.
        """
        values, bad = np.full(len(cells), np.nan), list[int]()
        for row, cell in enumerate(cells):
            known = _nanoseconds(cell, self.day_first)
            if known is not None:
                nanoseconds, dated = known
                values[row] = (nanoseconds - origin if dated else nanoseconds) * 1e-9
            elif not is_missing(cell):
                bad.append(row)
        return values, bad

    def times_of(self, cells: Sequence[str], origin: int) -> FloatArray:
        """Return (n,) s of a whole column, times of day going on to grow where a day ends."""
        seconds = self.seconds_of(cells, origin)[0]
        return seconds if self.dated else past_midnight(seconds)


def is_stamp(text: str) -> bool:
    """Whether a text is a date with a time of day, or a time of day."""
    return any(_nanoseconds(text, day_first) is not None for day_first in (False, True))


def writing_of(cells: Sequence[str]) -> Writing:
    """Return how a column writes its stamps, from its first cells and its last one.

    Where the day may stand before or after the month, that holds by which most dates exist, then by which they are
    nearest to one another, then the month first.
    """
    stamps = [cell for cell in (*cells[:LOOKED_AT], *cells[-1:]) if is_stamp(cell)]
    swappable = [cell for cell in stamps if _SWAPPABLE.match(cell)]
    if not swappable:
        known = _nanoseconds(stamps[0], day_first=False) if stamps else None
        return Writing(dated=known is not None and known[1])

    def unlikelihood(writing: Writing) -> tuple[int, int]:
        read = [instant for cell in swappable if (instant := writing.nanoseconds(cell)) is not None]
        return -len(read), max(read) - min(read) if read else 0

    return min((Writing(dated=True), Writing(dated=True, day_first=True)), key=unlikelihood)


def first_instant(columns: Sequence[tuple[Writing, Sequence[str]]]) -> int:
    """Return the earliest of the first instants of columns of dates, ns since 1970; 0 where no column has dates."""
    firsts = [writing.first_of(cells) for writing, cells in columns if writing.dated]
    return min((first for first in firsts if first is not None), default=0)


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
    texts = {name: cells for name, values in series.items() if (cells := _texts(values))}
    writings = {name: writing for name, cells in texts.items() if (writing := stamped(cells)) is not None}
    dates = {name: values.astype("datetime64[ns]") for name, values in series.items() if values.dtype.kind == "M"}
    spans = {name: values.astype("timedelta64[ns]") for name, values in series.items() if values.dtype.kind == "m"}
    first: list[int] = [
        int(known[0].astype(np.int64)) for values in dates.values() if (known := values[~np.isnat(values)]).size
    ]
    first += [earliest] if (earliest := first_instant([(writings[name], texts[name]) for name in writings])) else []
    origin = min(first, default=0)
    found: dict[str, Values] = {name: known.times_of(texts[name], origin) for name, known in writings.items()}
    for known, since in ((dates, origin), (spans, 0)):
        found |= {
            name: np.where(np.isnat(values), np.nan, seconds_since(values.astype(np.int64), since))
            for name, values in known.items()
        }
    return dict(columns) | found, frozenset(found), origin


def stamped(cells: Sequence[str]) -> Writing | None:
    """Return how a column writes its stamps; None where a cell is neither one nor missing, or all are missing."""
    if not any(map(is_stamp, cells[:LOOKED_AT])):
        return None
    writing = writing_of(cells)
    neither = (cell for cell in cells if writing.nanoseconds(cell) is None and not is_missing(cell))
    return writing if next(neither, None) is None else None


def _texts(values: Values) -> list[str]:
    """Return the cells of an array of texts; none where it holds anything else."""
    return list(map(str, values)) if values.dtype.kind == "U" else []


def _nanoseconds(text: str, day_first: bool) -> tuple[int, bool] | None:
    """Return ns since 1970, UTC, and True for a date, ns since midnight and False for a time of day."""
    match = _STAMP.fullmatch(text.strip())
    if match is None:
        return None
    hours, minutes, seconds = int(match["hour"]), int(match["minute"]), int(match["second"])
    part, half = match["part"], match["half"]
    if half is not None:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if half in "pP" else 0)
    nanoseconds = (3600 * hours + 60 * minutes + seconds) * _SECOND + (int(part.ljust(9, "0")) if part else 0)
    if match["ahead"]:
        shift = (60 * int(match["hours"]) + int(match["minutes"])) * 60 * _SECOND
        nanoseconds -= shift if match["ahead"] == "+" else -shift
    if match["day"] is None:
        return nanoseconds, False
    days = _days(match["day"], day_first)
    return None if days is None or hours > 23 else (days * _DAY * _SECOND + nanoseconds, True)


@lru_cache(maxsize=1000)
def _days(text: str, day_first: bool) -> int | None:
    """Return the days from 1970 to a date; None for one that does not exist."""
    numbers = [int(number) for number in re.findall(r"\d+", text)]
    name = re.search(r"[a-z]+", text.lower())
    if name is not None:
        day, year = numbers
        month = _MONTHS.index(name[0][:3]) + 1
    elif numbers[0] > 31:
        year, month, day = numbers
    else:
        in_order = day_first or not _SWAPPABLE.match(text)
        (day, month), year = numbers[:2] if in_order else numbers[1::-1], numbers[2]
    try:
        return date(year, month, day).toordinal() - _EPOCH
    except ValueError:
        return None
