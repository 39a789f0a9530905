"""Delimited text: read columns of numbers."""

from __future__ import annotations

import csv
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.csv_cells import is_missing, is_number, joined, no_number, numbers
from friction_ocp.recording.csv_layout import Layout, sniff_layout
from friction_ocp.recording.foreign import ForeignFile, Signal, Values, check_sizes, instant, no_clock
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray
from friction_ocp.recording.stamps import past_midnight

_ROWS_AT_ONCE = 50_000
_TOLD = 10
"""Faults of one file that are told."""
_DECIMALS = {",": "decimal comma in", ".": "commas between thousands in"}


@contextmanager
def open_csv(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the columns of delimited text; how many rows there are is told from the size of the file.

    Without a map, which would say what has to be a number, whatever is none is left out.
    """
    stated = import_map or ImportMap(None, {})
    layout = sniff_layout(path, stated.delimiter, stated.decimal)
    rows, summary = _estimated_rows(path), f"delimiter {layout.delimiter!r}"
    headed = zip(layout.names, layout.units, strict=True)
    signals = [
        Signal(name, rows, "s" if column in layout.stamped else header_unit(name) or unit)
        for column, (name, unit) in enumerate(headed)
    ]
    origin = instant(layout.origin)
    if import_map is not None:
        read = partial(_read_columns, path, layout, import_map.decimal)
        yield ForeignFile(tuple(signals), read, no_clock, summary, origin)
        return
    check_sizes(path, signals)
    odd = _OddRows(len(layout.names))
    values, hint = _whatever_is_a_number(path, layout, odd)
    for column in layout.times_of_day:
        values[column] = past_midnight(values[column])
    known = [
        replace(signal, samples=len(column), numeric=bool(np.any(np.isfinite(column))))
        for signal, column in zip(signals, values, strict=True)
    ]
    yield ForeignFile(
        tuple(known), lambda wanted: {k: values[k] for k in wanted}, no_clock, summary + hint + odd.summary, origin
    )


def _estimated_rows(path: Path) -> int:
    with path.open("rb") as file:
        head = file.read(65_536)
    return path.stat().st_size * (head.count(b"\n") + 1) // max(len(head), 1)


def _whatever_is_a_number(path: Path, layout: Layout, odd: _OddRows) -> tuple[FloatArray, str]:
    """Return (columns, rows), NaN for everything else, and which decimal sign a map has to state for that."""
    values, commas = _numbers_of_all(path, layout, None, odd)
    if not commas:
        return values, ""
    others = {decimal: _numbers_of_all(path, layout, decimal, _OddRows(odd.width))[0] for decimal in _DECIMALS}
    decimal = max(others, key=lambda sign: np.count_nonzero(np.isfinite(others[sign])))
    before, after = (np.count_nonzero(np.isfinite(found), axis=1) for found in (values, others[decimal]))
    names = [f"'{name}'" for name, more in zip(layout.names, after > before, strict=True) if more]
    values = np.where((after >= before)[:, np.newaxis], others[decimal], values)
    return values, f", {_DECIMALS[decimal]} {', '.join(names)} (decimal: '{decimal}' in the map)" if names else ""


def _numbers_of_all(path: Path, layout: Layout, decimal: str | None, odd: _OddRows) -> tuple[FloatArray, bool]:
    """Return (columns, rows), and whether there are commas in what is no number."""
    chunks: list[FloatArray] = []
    commas = False
    for _, columns in _chunks(path, layout, range(odd.width), odd):
        found = [_values(layout, column, cells, decimal) for column, cells in enumerate(columns)]
        chunks.append(np.array([values for values, _ in found], dtype=np.float64))
        commas = commas or any("," in cells[row] for cells, (_, bad) in zip(columns, found, strict=True) for row in bad)
    return np.concatenate(chunks, axis=1) if chunks else np.empty((odd.width, 0)), commas


def _values(layout: Layout, column: int, cells: Sequence[str], decimal: str | None) -> tuple[Values, list[int]]:
    """Return the numbers in cells of a column, dates as s, and the rows of cells that are neither."""
    writing = layout.stamped.get(column)
    return numbers(cells, decimal) if writing is None else writing.seconds_of(cells, layout.origin)


def _fault(layout: Layout, column: int, where: str, place: str, cell: str, decimal: str | None) -> Finding:
    if column in layout.stamped:
        return Finding(where, f"{place} is no date and no time of day", remedy="correct or empty the cell")
    return no_number(where, place, cell, decimal)


def _rows(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of every row; empty lines and comments are left out."""
    with path.open(encoding=layout.encoding, errors="replace", newline="") as file:
        lines = islice(file, layout.first_row - 1, None)
        if layout.delimiter == " ":
            numbered = ((number, line.split()) for number, line in enumerate(lines, layout.first_row))
        else:
            reader = csv.reader(lines, delimiter=layout.delimiter, skipinitialspace=True)
            numbered = ((layout.first_row - 1 + reader.line_num, cells) for cells in reader)
        for number, cells in numbered:
            if any(cells) and not _is_comment(cells, len(layout.names)):
                yield number, cells


def _is_comment(cells: Sequence[str], width: int) -> bool:
    """Whether a line is a comment; a row of the table may begin with #N/A."""
    return cells[0].startswith("#") and not (
        len(cells) == width and (is_missing(cells[0]) or any(map(is_number, cells)))
    )


@dataclass
class _OddRows:
    """Rows that have another width than the table."""

    width: int
    count: int = 0
    told: list[str] = field(default_factory=list[str])

    def add(self, line: int, cells: int) -> None:
        self.tell(f"line {line} has {cells} cells where {self.width} are expected")

    def tell(self, what: str) -> None:
        self.count += 1
        if self.count <= _TOLD:
            self.told.append(what)

    @property
    def summary(self) -> str:
        """What `--inspect` says of them."""
        lines = "1 line does" if self.count == 1 else f"{self.count} lines do"
        return f", {lines} not fit into the table: {self.told[0]}" if self.count else ""


def _whole_rows(
    rows: Iterable[tuple[int, list[str]]], layout: Layout, odd: _OddRows
) -> Iterator[tuple[int, list[str]]]:
    """Yield rows as wide as the table; where its last columns have ended, cells for them are added.

    A row that is shorter than the next one, or than all before it and the last, has been cut off.
    """
    ended, since, last = odd.width, 0, 0
    for number, cells in rows:
        if len(cells) > odd.width or (len(cells) < odd.width and layout.delimiter == " "):
            odd.add(number, len(cells))
            continue
        if len(cells) > ended:
            odd.add(since, ended)
        if len(cells) != ended:
            ended, since = len(cells), number
        last = number
        yield number, cells + [""] * (odd.width - len(cells))
    if ended < odd.width and since == last:
        odd.add(since, ended)


def _chunks(
    path: Path, layout: Layout, indices: Sequence[int], odd: _OddRows
) -> Iterator[tuple[list[int], list[list[str]]]]:
    """Yield line numbers and the cells of the wanted columns, many rows at once."""
    rows = _whole_rows(_rows(path, layout), layout, odd)
    try:
        while chunk := list(islice(rows, _ROWS_AT_ONCE)):
            yield [number for number, _ in chunk], [[cells[index] for _, cells in chunk] for index in indices]
    except csv.Error as error:
        odd.tell(f"this is not delimited text ({error})")


def _read_columns(path: Path, layout: Layout, decimal: str | None, indices: Sequence[int]) -> Mapping[int, Values]:
    """Read the wanted columns; raises FrictionOcpError for cells that are no numbers."""
    odd, findings = _OddRows(len(layout.names)), list[Finding]()
    pieces: dict[int, list[Values]] = {index: [] for index in indices}
    for lines, columns in _chunks(path, layout, indices, odd):
        for index, cells in zip(indices, columns, strict=True):
            values, bad = _values(layout, index, cells, decimal)
            pieces[index].append(values)
            for row in bad[: max(0, _TOLD - len(findings))]:
                place = f"line {lines[row]}: '{cells[row].strip()}' in column '{layout.names[index]}'"
                findings.append(_fault(layout, index, str(path), place, cells[row].strip(), decimal))
    findings = [Finding(str(path), what, remedy="complete or remove the line") for what in odd.told] + findings
    if findings:
        raise FrictionOcpError(findings[:_TOLD])
    whole = {index: joined(found) for index, found in pieces.items()}
    return whole | {index: past_midnight(whole[index]) for index in layout.times_of_day if index in whole}
