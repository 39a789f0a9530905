"""Arrays of NumPy: .npy and .npz; objects in them are refused, as they would have to be unpickled."""

from __future__ import annotations

import zipfile
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.foreign import MAX_SAMPLES, ForeignFile, Signal, Values, free_memory, no_clock, reading
from friction_ocp.recording.header_unit import header_unit
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.matlab import matrix_columns

KIND = "a NumPy file"


@contextmanager
def open_numpy(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the arrays of a file; a matrix has columns `name[0]`, `name[1]`, a structured array fields `name.field`."""
    with reading(path, KIND):
        _refuse_too_large(path)
        columns = dict(_columns(path))
    names = tuple(columns)
    signals = tuple(
        Signal(name, len(values), header_unit(name), numeric=values.dtype.kind in "biuf")
        for name, values in columns.items()
    )

    def read(wanted: Sequence[int]) -> Mapping[int, Values]:
        return {k: columns[names[k]] for k in wanted}

    yield ForeignFile(signals, read, no_clock, "NumPy")


def _refuse_too_large(path: Path) -> None:
    """Refuse archives whose arrays, unpacked, do not fit; a plain array is as large as its file."""
    needed = path.stat().st_size
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            needed = sum(item.file_size for item in archive.infolist())
    limit = min(8 * MAX_SAMPLES * 8, free_memory() // 2)
    if needed > limit:
        what = f"its arrays declare {needed} bytes"
        raise FrictionOcpError(Finding(str(path), what, f"at most {limit}", "save fewer arrays in one file"))


def _columns(path: Path) -> Iterator[tuple[str, Values]]:
    loaded: Any = np.load(path, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        yield from _series("data", cast(Values, loaded))
        return
    with loaded:
        for name in loaded.files:
            yield from _series(name, loaded[name])


def _series(name: str, values: Values) -> Iterator[tuple[str, Values]]:
    if values.dtype.names is None:
        yield from matrix_columns(name, values)
        return
    for key in values.dtype.names:
        yield from matrix_columns(f"{name}.{key}", values[key])
