"""Delimited text: read columns of numbers."""

from __future__ import annotations

import csv
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.csv_cells import no_number, numbers
from friction_ocp.recording.csv_layout import Layout, sniff_layout
from friction_ocp.recording.foreign import ForeignFile, Signal, check_sizes, no_clock
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray

_ROWS_AT_ONCE = 50_000
_DECIMALS = {",": "decimal comma in", ".": "commas between thousands in"}


@contextmanager
def open_csv(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the columns of delimited text; how many rows there are is told from the size of the file.

    Without a map, which would say what has to be a number, whatever is none is left out.
    """
    stated = import_map or ImportMap(None, {})
    layout = sniff_layout(path, stated.delimiter, stated.decimal)
    rows, summary = _estimated_rows(path), f"delimiter {layout.delimiter!r}"
    signals = [Signal(name, rows, header_unit(name)) for name in layout.names]
    if import_map is not None:
        read = partial(_read_columns, path, layout, import_map.decimal)
        yield ForeignFile(tuple(signals), read, no_clock, summary)
        return
    check_sizes(path, signals)
    values, hint = _whatever_is_a_number(path, layout)
    known = [
        replace(signal, samples=len(column), numeric=bool(np.any(np.isfinite(column))))
        for signal, column in zip(signals, values, strict=True)
    ]
    yield ForeignFile(tuple(known), lambda wanted: {k: values[k] for k in wanted}, no_clock, summary + hint)


def _estimated_rows(path: Path) -> int:
    with path.open("rb") as file:
        head = file.read(65_536)
    return path.stat().st_size * (head.count(b"\n") + 1) // max(len(head), 1)


def _whatever_is_a_number(path: Path, layout: Layout) -> tuple[FloatArray, str]:
    """Return (columns, rows), NaN for everything else, and which decimal sign a map has to state for that."""
    values, commas = _numbers_of_all(path, layout, None)
    if not commas:
        return values, ""
    others = {decimal: _numbers_of_all(path, layout, decimal)[0] for decimal in _DECIMALS}
    decimal = max(others, key=lambda sign: np.count_nonzero(np.isfinite(others[sign])))
    before, after = (np.count_nonzero(np.isfinite(found), axis=1) for found in (values, others[decimal]))
    names = [f"'{name}'" for name, more in zip(layout.names, after > before, strict=True) if more]
    values = np.where((after >= before)[:, np.newaxis], others[decimal], values)
    return values, f", {_DECIMALS[decimal]} {', '.join(names)} (decimal: '{decimal}' in the map)" if names else ""


def _numbers_of_all(path: Path, layout: Layout, decimal: str | None) -> tuple[FloatArray, bool]:
    """Return (columns, rows), and whether there are commas in what is no number."""
    width = len(layout.names)
    chunks: list[FloatArray] = []
    commas = False
    for _, cells in _chunks(path, layout, range(width), []):
        values, bad = numbers(cells, decimal)
        chunks.append(values)
        commas = commas or any("," in cells[column][row] for column, row in bad)
    return np.concatenate(chunks, axis=1) if chunks else np.empty((width, 0)), commas


def _rows(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of every row; empty lines and lines that start with # are left out."""
    with path.open(encoding=layout.encoding, errors="replace", newline="") as file:
        lines = islice(file, layout.first_row - 1, None)
        if layout.delimiter == " ":
            numbered = ((number, line.split()) for number, line in enumerate(lines, layout.first_row))
        else:
            reader = csv.reader(lines, delimiter=layout.delimiter, skipinitialspace=True)
            numbered = ((layout.first_row - 1 + reader.line_num, cells) for cells in reader)
        for number, cells in numbered:
            if any(cells) and not cells[0].startswith("#"):
                yield number, cells


def _chunks(
    path: Path, layout: Layout, indices: Sequence[int], findings: list[Finding]
) -> Iterator[tuple[list[int], list[list[str]]]]:
    """Yield line numbers and the cells of the wanted columns, many rows at once; rows of another width are findings."""
    width = len(layout.names)
    rows = _rows(path, layout)
    try:
        while chunk := list(islice(rows, _ROWS_AT_ONCE)):
            for number, cells in chunk:
                if len(cells) != width and len(findings) < 10:
                    what = f"line {number} has {len(cells)} cells where {width} are expected"
                    findings.append(Finding(str(path), what, remedy="complete or remove the line"))
            whole = [(number, cells) for number, cells in chunk if len(cells) == width]
            yield [number for number, _ in whole], [[cells[index] for _, cells in whole] for index in indices]
    except csv.Error as error:
        findings.append(Finding(str(path), f"this is not delimited text ({error})"))


def _read_columns(path: Path, layout: Layout, decimal: str | None, indices: Sequence[int]) -> Mapping[int, FloatArray]:
    """Read the wanted columns; raises FrictionOcpError for cells that are no numbers."""
    findings: list[Finding] = []
    chunks: list[FloatArray] = []
    for lines, cells in _chunks(path, layout, indices, findings):
        values, bad = numbers(cells, decimal)
        chunks.append(values)
        for column, row in bad[: max(0, 10 - len(findings))]:
            cell = cells[column][row].strip()
            place = f"line {lines[row]}: '{cell}' in column '{layout.names[indices[column]]}'"
            findings.append(no_number(str(path), place, cell, decimal))
    if findings:
        raise FrictionOcpError(findings)
    values = np.concatenate(chunks, axis=1)
    return {index: values[row] for row, index in enumerate(indices)}
