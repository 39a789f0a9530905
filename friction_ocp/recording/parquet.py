"""Parquet files: columns of numbers, instants and texts of them; units stand in a column's metadata, or in its name."""

from __future__ import annotations

import importlib
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.recording.foreign import (
    MAX_SAMPLES,
    ForeignFile,
    Library,
    Signal,
    Values,
    instant,
    no_clock,
    opened,
    reading,
)
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.stamps import LOOKED_AT, Writing, first_instant, stamped

KIND = "a Parquet file"
LIBRARY = Library("pyarrow.parquet", "pyarrow", "parquet")
_UNIT_KEYS = (b"unit", b"units", b"Unit")


@contextmanager
def open_parquet(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the columns of a Parquet file; columns of dates become s since the earliest of their first rows."""
    parquet: Any = LIBRARY.load(path)
    pyarrow: Any = importlib.import_module("pyarrow")
    with opened(path, KIND, lambda: parquet.ParquetFile(path)) as file:
        reader = _Reader(pyarrow, file, path)
        fields = list(file.schema_arrow)
        origin = reader.origin(fields)
        signals = tuple(reader.signal(field) for field in fields)

        def read(wanted: Sequence[int]) -> Mapping[int, Values]:
            with reading(path, KIND):
                return {k: reader.column(fields[k], origin) for k in wanted}

        summary = f"{file.metadata.num_rows} rows"
        yield ForeignFile(signals, read, no_clock, summary, instant(origin))


def _as_texts(column: Any) -> list[str]:
    """Return the texts of a column, "" where one is missing."""
    return [cell or "" for cell in column.to_pylist()]


class _Reader:
    """The columns of one open file."""

    def __init__(self, pyarrow: Any, file: Any, path: Path) -> None:
        self.arrow, self.file, self.path = pyarrow, file, path
        self.types: Any = pyarrow.types
        texts = {field.name: self._cells(field.name) for field in file.schema_arrow if self._is_stamped(field)}
        self.stamps: Mapping[str, tuple[Writing, list[str]]] = {
            name: (writing, cells) for name, cells in texts.items() if (writing := stamped(cells)) is not None
        }

    def signal(self, field: Any) -> Signal:
        metadata: Mapping[bytes, bytes] = field.metadata or {}
        stated = next((metadata[key].decode(errors="replace") for key in _UNIT_KEYS if key in metadata), "")
        is_text = field.name in self.stamps
        unit = "s" if is_text or self._is_date(field.type) or self._is_span(field.type) else stated
        unit = unit or header_unit(field.name)
        return Signal(field.name, self.file.metadata.num_rows, unit, numeric=is_text or self._is_numeric(field.type))

    def origin(self, fields: Sequence[Any]) -> int:
        """Return the earliest first instant of all columns of dates, ns since 1970."""
        stamped = first_instant(list(self.stamps.values()))
        firsts = [stamped] if stamped else []
        for field in fields if self.file.metadata.num_rows else ():
            if self._is_date(field.type):
                batch = next(self.file.iter_batches(batch_size=1, columns=[field.name]))
                column = batch.column(0)
                firsts += [] if column[0].as_py() is None else [int(self._nanoseconds(column)[0])]
        return min(firsts, default=0)

    def column(self, field: Any, origin: int) -> Values:
        if field.name in self.stamps:
            writing, cells = self.stamps[field.name]
            return writing.times_of(cells, origin)
        column = self.file.read(columns=[field.name]).column(0).combine_chunks()
        missing = np.asarray(column.is_null())
        if self._is_date(field.type) or self._is_span(field.type):
            counts = self._nanoseconds(column) - np.int64(origin if self._is_date(field.type) else 0)
            return np.where(missing, np.nan, counts * 1e-9)
        if self.types.is_integer(field.type) and not missing.any():
            return np.asarray(column)
        return np.where(missing, np.nan, np.asarray(column.cast(self.arrow.float64(), safe=False).fill_null(0)))

    def _is_stamped(self, field: Any) -> bool:
        """Whether the first texts of a column are stamps."""
        is_text = self.types.is_string(field.type) or self.types.is_large_string(field.type)
        if not is_text or self.file.metadata.num_rows > MAX_SAMPLES:  # which is refused
            return False
        first = next(self.file.iter_batches(batch_size=LOOKED_AT, columns=[field.name]), None)
        return first is not None and stamped(_as_texts(first.column(0))) is not None

    def _cells(self, name: str) -> list[str]:
        return _as_texts(self.file.read(columns=[name]).column(0))

    def _nanoseconds(self, column: Any) -> Values:
        kind: Any = self.arrow.duration("ns") if self._is_span(column.type) else self.arrow.timestamp("ns")
        return np.asarray(column.cast(kind).cast(self.arrow.int64()).fill_null(0))

    def _is_date(self, kind: Any) -> bool:
        return bool(self.types.is_timestamp(kind))

    def _is_span(self, kind: Any) -> bool:
        return bool(self.types.is_duration(kind))

    def _is_numeric(self, kind: Any) -> bool:
        tests = ("is_integer", "is_floating", "is_boolean", "is_decimal", "is_timestamp", "is_duration")
        return any(getattr(self.types, test)(kind) for test in tests)
