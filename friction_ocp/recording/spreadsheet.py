"""Spreadsheets (Excel, OpenDocument): the tables in their sheets, laid out as in delimited text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.csv_cells import is_missing, is_number, no_number, numbers
from friction_ocp.recording.csv_layout import header_of, rows_of_numbers
from friction_ocp.recording.foreign import ForeignFile, Library, Values, opened
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.in_memory import in_memory
from friction_ocp.recording.stamps import is_stamp

KIND = "a spreadsheet"
LIBRARY = Library("python_calamine", "python-calamine", "spreadsheet")
_SNIFFED_ROWS = 200
_TOLD = 10
"""Faults of one file that are told."""


@dataclass(frozen=True)
class _Column:
    """One column of a table."""

    name: str
    unit: str
    values: Values
    faults: tuple[Finding, ...] = ()
    """Cells that are no numbers, in a column of numbers."""


@contextmanager
def open_spreadsheet(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the columns of the tables in all sheets; they are called `sheet.column` where several sheets have tables."""
    calamine: Any = LIBRARY.load(path)
    tables: dict[str, list[_Column]] = {}
    with opened(path, KIND, lambda: calamine.CalamineWorkbook.from_path(str(path))) as book:
        for name in book.sheet_names:
            rows: Sequence[Sequence[object]] = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
            tables[name] = _columns(rows, f"{path}: sheet '{name}'")
    several = sum(map(bool, tables.values())) > 1
    found = [
        replace(column, name=f"{sheet}.{column.name}" if several else column.name)
        for sheet, columns in tables.items()
        for column in columns
    ]
    units = {column.name: column.unit for column in found}
    file = in_memory({column.name: column.values for column in found}, f"sheets {', '.join(tables)}", units)
    faults = {column.name: column.faults for column in found}

    def read(wanted: Sequence[int]) -> Mapping[int, Values]:
        findings = [finding for k in wanted for finding in faults[file.signals[k].name]]
        if import_map is not None and findings:
            raise FrictionOcpError(findings[:_TOLD])
        return file.read(wanted)

    yield replace(file, read=read)


def _columns(rows: Sequence[Sequence[object]], where: str) -> list[_Column]:
    """Return the columns of the table in a sheet; none where it has none."""
    texts = [[_text(cell) for cell in row] for row in rows]
    begin = _begin(texts[:_SNIFFED_ROWS])
    head = texts[begin : begin + _SNIFFED_ROWS]
    if not rows_of_numbers(head):
        return []
    names, units, first = header_of(head)
    filled = [k for k in range(begin + first, len(texts)) if any(texts[k])]
    spans = [any(isinstance(rows[k][column], timedelta) for k in filled[:1]) for column in range(len(names))]
    return [
        _column(_unique(names, column), "s" if spans[column] else units[column], filled, texts, column, where)
        for column in range(len(names))
    ]


def _begin(rows: Sequence[Sequence[str]]) -> int:
    """Return the first row that is as wide as the table, whose header has no fewer cells than most of its rows.

    What stands above it, a setting a row, is narrower; a sheet pads all rows to the widest.
    """
    widths = [max((k for k, cell in enumerate(row, 1) if cell), default=0) for row in rows]
    usual = Counter(width for width, row in zip(widths, rows, strict=True) if any(map(is_number, row))).most_common(1)
    return next(k for k, width in enumerate(widths) if width >= usual[0][0]) if usual else 0


def _unique(names: Sequence[str], column: int) -> str:
    """Return the name of a column, with its place where another one has the same."""
    return names[column] if names.count(names[column]) == 1 else f"{names[column]} (column {column})"


def _column(
    name: str, unit: str, filled: Sequence[int], texts: Sequence[Sequence[str]], column: int, where: str
) -> _Column:
    """Return one column: numbers where most cells that are not empty are, else text."""
    cells = [texts[k][column] for k in filled]
    stated = [cell for cell in cells if not is_missing(cell)]
    if 2 * sum(map(is_number, stated)) <= len(stated) and any(map(is_stamp, stated)):
        return _Column(name, unit, np.array(cells, dtype=np.str_))
    values, bad = numbers(cells, None)
    if 2 * len(bad) > len(stated):
        return _Column(name, unit, np.array(cells, dtype=np.str_))
    places = [(f"row {filled[row] + 1}: '{cells[row]}' in column '{name}'", cells[row]) for row in bad[:_TOLD]]
    return _Column(name, unit, values, tuple(no_number(where, place, cell, None) for place, cell in places))


def _text(cell: object) -> str:
    """Return what a cell says; a date, a time of day or a span as loggers write it."""
    if isinstance(cell, bool):
        return str(int(cell))
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, date):  # which is what becomes of midnight
        return (cell if isinstance(cell, datetime) else datetime.combine(cell, time())).isoformat(" ")
    return cell.isoformat() if isinstance(cell, time) else str(cell).strip()
