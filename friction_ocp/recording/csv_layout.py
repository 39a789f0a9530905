"""How delimited text is written: its delimiter, its header, and where its numbers begin."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.csv_cells import is_missing, is_number
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.stamps import Writing, first_instant, is_stamp, writing_of

_DELIMITERS = ("\t", ";", ",", " ")
_SNIFFED_LINES = 200
_TAIL = 65_536
"""Bytes at the end of a file in which its last line is looked for."""
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True)
class Layout:
    """How a delimited file is written."""

    delimiter: str
    """One character; " " is any run of spaces and tabs."""
    names: tuple[str, ...]
    units: tuple[str, ...]
    """From a line of its own below the header; "" where there is none."""
    first_row: int
    """Line of the first row of numbers, from 1."""
    encoding: str
    stamped: Mapping[int, Writing]
    """Columns of dates or times of day."""
    origin: int
    """The earliest of their first instants, ns since 1970; 0 where there are no dates."""

    @property
    def times_of_day(self) -> list[int]:
        """Columns of times of day, which begin again at midnight."""
        return [column for column, writing in self.stamped.items() if not writing.dated]


def sniff_layout(path: Path, delimiter: str | None = None, decimal: str | None = None) -> Layout:
    """Find delimiter, header and first row of numbers; raises FrictionOcpError where there are none."""
    if not path.is_file():
        raise FrictionOcpError(Finding(str(path), "there is no such file", remedy="correct the path"))
    encoding = _encoding(path)
    with path.open(encoding=encoding, errors="replace", newline="") as file:
        lines = [line.rstrip("\r\n") for line in islice(file, _SNIFFED_LINES)]
    candidates = _DELIMITERS if delimiter is None else (delimiter,)
    splits = {candidate: [_split(line, candidate) for line in lines] for candidate in candidates}
    counts = {candidate: _count_numbers(splits[candidate]) for candidate in candidates}
    usual = [candidate for candidate in candidates if candidate != decimal and counts[candidate]]
    best = max(usual or candidates, key=lambda candidate: counts[candidate])  # a decimal comma in quotes may be both
    if counts[best] == 0:
        allowed = "at least two columns, separated by comma, semicolon, tab or space"
        raise FrictionOcpError(Finding(str(path), "there are no rows of numbers", allowed, "state the delimiter"))
    names, units, first_row = header_of(splits[best])
    stamps = _stamps(splits[best], len(names))
    last = _split(_last_line(path, encoding), best) if stamps else []
    ends = last if len(last) == len(names) else [""] * len(names)
    stamped = {column: writing_of([*cells, ends[column]]) for column, cells in stamps.items()}
    origin = first_instant([(stamped[column], cells) for column, cells in stamps.items()])
    return Layout(best, names, units, first_row + 1, encoding, stamped, origin)


def _encoding(path: Path) -> str:
    with path.open("rb") as file:
        head = file.read(65_536)
    if head.startswith(UTF16_MARKS):
        return "utf-16"
    try:
        head[: head.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _last_line(path: Path, encoding: str) -> str:
    """Return the last line that is not empty; "" where it is longer than what is looked at."""
    with path.open("rb") as file:
        mark = file.read(2)
        file.seek(max(0, path.stat().st_size - _TAIL) // 2 * 2)
        tail = file.read()
    wide = {UTF16_MARKS[0]: "utf-16-le", UTF16_MARKS[1]: "utf-16-be"}
    lines = tail.decode(wide.get(mark, encoding), errors="replace").splitlines()[1:]
    return next((line for line in reversed(lines) if line.strip()), "")


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    if len(line) > csv.field_size_limit():  # no row of a table, and more than the parser takes
        return []
    return [cell.strip() for row in csv.reader([line], delimiter=delimiter, skipinitialspace=True) for cell in row]


def rows_of_numbers(rows: Sequence[Sequence[str]]) -> list[int]:
    """Return which lines are rows of the table: as wide as most lines with numbers, with the usual first number.

    The usual first number (the time, mostly) tells rows from settings above them, such as "rate, 1000".
    """
    some = [cells for cells in rows if len(cells) > 1 and any(map(is_number, cells)) and not cells[0].startswith("#")]
    if not some:
        return []
    width = Counter(map(len, some)).most_common(1)[0][0]
    some = [cells for cells in some if len(cells) == width]
    shares = [sum(is_number(cells[column]) for cells in some) / len(some) for column in range(width)]
    usual = next((column for column, share in enumerate(shares) if share > 0.5), 0)
    return [
        index
        for index, cells in enumerate(rows)
        if len(cells) == width and any(map(is_number, cells)) and (is_number(cells[usual]) or is_missing(cells[usual]))
    ]


def _stamps(rows: Sequence[Sequence[str]], width: int) -> dict[int, list[str]]:
    """Return the cells of columns that mostly hold dates or times of day."""
    table = [rows[index] for index in rows_of_numbers(rows)]
    cells = {column: [row[column] for row in table if not is_missing(row[column])] for column in range(width)}
    return {column: stated for column, stated in cells.items() if 2 * sum(map(is_stamp, stated)) > len(stated)}


def _count_numbers(rows: Sequence[Sequence[str]]) -> int:
    """Return how many numbers there are in the rows of the table; a date with its time is as many as it has."""
    return sum(_numbers_in(cell) for index in rows_of_numbers(rows) for cell in rows[index])


def _numbers_in(cell: str) -> int:
    return 1 if is_number(cell) else len(re.findall(r"\d+", cell)) if is_stamp(cell) else 0


def header_of(rows: Sequence[Sequence[str]]) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return the names of the columns, the units in a line of their own, and the index of the first row of numbers.

    The header is among the lines right above the numbers that have as many cells: the first of those with the most
    names in them, as what stands above it may be padded to its width. A line of units may follow it.
    """
    table = rows_of_numbers(rows)
    first, width = table[0], len(rows[table[0]])
    padded = all(not rows[index][-1] for index in table)
    lines: list[list[str]] = []
    for cells in reversed(rows[:first]):
        line = _fitted(cells, width, padded)
        if line is None or (any(map(is_number, line)) and not (_are_units(line) or (not lines and _counts_up(line)))):
            break
        lines.insert(0, line)
    titles = [line for line in lines if not _are_units(line)] or lines[:1] or [[""] * width]
    names = max(titles, key=lambda line: sum(map(bool, line)))
    below = lines[lines.index(names) + 1 :] if lines else []
    units = next((line for line in below if _are_units(line)), [""] * width)
    return tuple(name or f"column {k}" for k, name in enumerate(names)), tuple(map(_known_unit, units)), first


def _fitted(cells: Sequence[str], width: int, padded: bool) -> list[str] | None:
    """Return the cells of a line above the table, None where they are none of its columns.

    There may be a mark of a comment before them, or a delimiter at the end of the line or of each row of the table.
    """
    bare = [cells[0].lstrip("# "), *cells[1:]] if cells else []
    if len(bare) == width + 1 and not (bare[0] and bare[-1]):
        bare = bare[1:] if not bare[0] else bare[:-1]
    if len(bare) == width - 1 > 0 and padded:
        bare = [*bare, ""]
    return bare if len(bare) == width else None


def _are_units(cells: Sequence[str]) -> bool:
    """Whether most cells of a line are units, such as s, [deg] or 1, and not all of them 1."""
    stated = [cell for cell in cells if cell not in ("", "-")]
    known = [unit for cell in stated if (unit := _known_unit(cell))]
    return 2 * len(known) > len(stated) and any(unit != "1" for unit in known)


def _known_unit(cell: str) -> str:
    """Return the unit that a cell is, "" where it is none."""
    bare = re.fullmatch(r"[\[(]?([^\[\]()]+)[\])]?", cell)
    return "" if bare is None else "1" if bare[1] == "1" else header_unit(f"[{bare[1]}]")


def _counts_up(cells: Sequence[str]) -> bool:
    """Whether what is a number in a line counts columns: 1, 2, 3."""
    counted = [cell for cell in cells if is_number(cell)]
    first = counted[0]
    return len(counted) > 1 and first.isdigit() and counted == [str(int(first) + k) for k in range(len(counted))]
