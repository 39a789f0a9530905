"""Delimited text: sniff its layout, read columns of numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.foreign import ForeignFile, Signal, check_sizes, no_clock
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.recording import FloatArray

_DELIMITERS = ("\t", ";", ",", " ")
_SNIFFED_LINES = 200
_ROWS_AT_ONCE = 50_000
_MISSING = ("", "nan", "na", "n/a", "null", "none", "-")
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)(e[-+]?\d+)?", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """How a delimited file is written."""

    delimiter: str
    """One character; " " is any run of spaces and tabs."""
    names: tuple[str, ...]
    first_row: int
    """Line of the first row of numbers, from 1."""
    encoding: str
    decimal: str = "."


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
        yield ForeignFile(tuple(signals), partial(_read_columns, path, layout), no_clock, summary)
        return
    check_sizes(path, signals)
    values, commas = _whatever_is_a_number(path, layout), list[str]()
    if layout.delimiter != ",":
        with_comma = _whatever_is_a_number(path, replace(layout, decimal=","))
        more = np.count_nonzero(np.isfinite(with_comma), axis=1) > np.count_nonzero(np.isfinite(values), axis=1)
        values[more] = with_comma[more]
        commas = [f"'{name}'" for name, has in zip(layout.names, more, strict=True) if has]
    if commas:
        summary = f"{summary}, decimal comma in {', '.join(commas)} (decimal: ',' in the map)"
    known = [
        replace(signal, samples=len(column), numeric=bool(np.any(np.isfinite(column))))
        for signal, column in zip(signals, values, strict=True)
    ]
    yield ForeignFile(tuple(known), lambda wanted: {k: values[k] for k in wanted}, no_clock, summary)


def _estimated_rows(path: Path) -> int:
    with path.open("rb") as file:
        head = file.read(65_536)
    return path.stat().st_size * (head.count(b"\n") + 1) // max(len(head), 1)


def _whatever_is_a_number(path: Path, layout: Layout) -> FloatArray:
    """Return (columns, rows), NaN for everything else."""
    width = len(layout.names)
    chunks = [_numbers(cells, layout.decimal)[0] for _, cells in _chunks(path, layout, range(width), [])]
    return np.concatenate(chunks, axis=1) if chunks else np.empty((width, 0))


def sniff_layout(path: Path, delimiter: str | None = None, decimal: str = ".") -> Layout:
    """Find delimiter, header and first row of numbers; raises FrictionOcpError where there are none."""
    if not path.is_file():
        raise FrictionOcpError(Finding(str(path), "there is no such file", remedy="correct the path"))
    encoding = _encoding(path)
    with path.open(encoding=encoding, errors="replace", newline="") as file:
        lines = [line.rstrip("\r\n") for line in islice(file, _SNIFFED_LINES)]
    candidates = [found for found in (_DELIMITERS if delimiter is None else (delimiter,)) if found != decimal]
    splits = {candidate: [_split(line, candidate) for line in lines] for candidate in candidates}
    best = max(candidates, key=lambda candidate: _count_numbers(splits[candidate]), default="")
    if not best or _count_numbers(splits[best]) == 0:
        allowed = "at least two columns, separated by comma, semicolon, tab or space"
        raise FrictionOcpError(Finding(str(path), "there are no rows of numbers", allowed, "state the delimiter"))
    names, first_row = _header(splits[best])
    return Layout(best, names, first_row + 1, encoding, decimal)


def _encoding(path: Path) -> str:
    with path.open("rb") as file:
        head = file.read(65_536)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        head[: head.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    if len(line) > csv.field_size_limit():  # no row of a table, and more than the parser takes
        return []
    return [cell.strip() for row in csv.reader([line], delimiter=delimiter, skipinitialspace=True) for cell in row]


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None


def _rows_of_numbers(rows: Sequence[Sequence[str]]) -> list[int]:
    """Return which lines are rows of the table: as wide as most lines with numbers, with the usual first number.

    The usual first number (the time, mostly) tells rows from settings above them, such as "rate, 1000".
    """
    some = [cells for cells in rows if len(cells) > 1 and any(map(_is_number, cells)) and not cells[0].startswith("#")]
    if not some:
        return []
    width = Counter(map(len, some)).most_common(1)[0][0]
    some = [cells for cells in some if len(cells) == width]
    shares = [sum(_is_number(cells[column]) for cells in some) / len(some) for column in range(width)]
    usual = next((column for column, share in enumerate(shares) if share > 0.5), 0)
    return [
        index
        for index, cells in enumerate(rows)
        if len(cells) == width
        and any(map(_is_number, cells))
        and (_is_number(cells[usual]) or cells[usual].lower() in _MISSING)
    ]


def _count_numbers(rows: Sequence[Sequence[str]]) -> int:
    return sum(_is_number(cell) for index in _rows_of_numbers(rows) for cell in rows[index])


def _header(rows: Sequence[Sequence[str]]) -> tuple[tuple[str, ...], int]:
    """Return the names of the columns and the index of the first row of numbers.

    The header is the first of the lines right above the numbers that have as many cells; a line of units may follow it.
    """
    first = _rows_of_numbers(rows)[0]
    width = len(rows[first])
    names: Sequence[str] = [""] * width
    for cells in reversed(rows[:first]):
        bare = [cells[0].lstrip("# "), *cells[1:]] if cells else []
        bare = bare[1:] if len(bare) == width + 1 and not bare[0] else bare
        if len(bare) != width or any(map(_is_number, bare)):
            break
        names = bare
    return tuple(name or f"column {index}" for index, name in enumerate(names)), first


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


def _read_columns(path: Path, layout: Layout, indices: Sequence[int]) -> Mapping[int, FloatArray]:
    """Read the wanted columns; raises FrictionOcpError for cells that are no numbers."""
    findings: list[Finding] = []
    chunks: list[FloatArray] = []
    for lines, cells in _chunks(path, layout, indices, findings):
        values, bad = _numbers(cells, layout.decimal)
        chunks.append(values)
        for column, row in bad[: max(0, 10 - len(findings))]:
            cell, name = cells[column][row], layout.names[indices[column]]
            comma = layout.decimal == "." and bool(_NUMBER.fullmatch(cell))
            remedy = "set decimal: ','" if comma else "correct or empty the cell"
            what = f"line {lines[row]}: '{cell}' in column '{name}' is not a number"
            findings.append(Finding(str(path), what, remedy=remedy))
    if findings:
        raise FrictionOcpError(findings)
    values = np.concatenate(chunks, axis=1)
    return {index: values[row] for row, index in enumerate(indices)}


def _numbers(columns: Sequence[Sequence[str]], decimal: str) -> tuple[FloatArray, list[tuple[int, int]]]:
    """Return (columns, rows) numbers, NaN for empty cells, and the places of cells that are neither."""
    bad: list[tuple[int, int]] = []
    values = np.full((len(columns), len(columns[0]) if columns else 0), np.nan)
    for index, cells in enumerate(columns):
        texts = cells if decimal == "." else [cell.replace(decimal, ".") for cell in cells]
        try:
            values[index] = np.asarray(texts, dtype=np.float64)
        except ValueError:
            for row, text in enumerate(texts):
                try:
                    values[index, row] = float(text)
                except ValueError:
                    if text.strip().lower() not in _MISSING:
                        bad.append((index, row))
    return values, bad
