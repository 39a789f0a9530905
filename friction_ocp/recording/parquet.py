"""Parquet files: columns of numbers and instants; units stand in the metadata of a column, or in its name."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from friction_ocp.recording.foreign import ForeignFile, Signal, Values, instant, library, no_clock, opened, reading
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap

KIND = "a Parquet file"
_UNIT_KEYS = (b"unit", b"units", b"Unit")


@contextmanager
def open_parquet(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the columns of a Parquet file; columns of dates become s since the earliest of their first rows."""
    pyarrow: Any = library("pyarrow", "pyarrow", "parquet", path)
    parquet: Any = library("pyarrow.parquet", "pyarrow", "parquet", path)
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


class _Reader:
    """The columns of one open file."""

    def __init__(self, pyarrow: Any, file: Any, path: Path) -> None:
        self.arrow, self.file, self.path = pyarrow, file, path
        self.types: Any = pyarrow.types

    def signal(self, field: Any) -> Signal:
        metadata: Mapping[bytes, bytes] = field.metadata or {}
        stated = next((metadata[key].decode(errors="replace") for key in _UNIT_KEYS if key in metadata), "")
        unit = "s" if self._is_date(field.type) or self._is_span(field.type) else stated
        unit = unit or header_unit(field.name)
        return Signal(field.name, self.file.metadata.num_rows, unit, numeric=self._is_numeric(field.type))

    def origin(self, fields: Sequence[Any]) -> int:
        """Return the earliest first instant of all columns of dates, ns since 1970."""
        firsts: list[int] = []
        for field in fields if self.file.metadata.num_rows else ():
            if self._is_date(field.type):
                batch = next(self.file.iter_batches(batch_size=1, columns=[field.name]))
                column = batch.column(0)
                firsts += [] if column[0].as_py() is None else [int(self._nanoseconds(column)[0])]
        return min(firsts, default=0)

    def column(self, field: Any, origin: int) -> Values:
        column = self.file.read(columns=[field.name]).column(0).combine_chunks()
        missing = np.asarray(column.is_null())
        if self._is_date(field.type) or self._is_span(field.type):
            counts = self._nanoseconds(column) - np.int64(origin if self._is_date(field.type) else 0)
            return np.where(missing, np.nan, counts * 1e-9)
        if self.types.is_integer(field.type) and not missing.any():
            return np.asarray(column)
        return np.where(missing, np.nan, np.asarray(column.cast(self.arrow.float64(), safe=False).fill_null(0)))

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
