"""Arrays of NumPy: .npy and .npz; objects in them are refused, as they would have to be unpickled."""

from __future__ import annotations

import zipfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.recording.foreign import ForeignFile, Values, reading, refuse_large
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.in_memory import in_memory
from friction_ocp.recording.matrix_columns import matrix_columns

KIND = "a NumPy file"


@contextmanager
def open_numpy(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the arrays of a file; a matrix has columns `name[0]`, `name[1]`, a structured array fields `name.field`."""
    with reading(path, KIND):
        refuse_large(path, _unpacked(path), "arrays")
        columns = dict(_columns(path))
    yield in_memory(columns, "NumPy")


def _unpacked(path: Path) -> int:
    """Return the bytes of all arrays; a plain array is as large as its file."""
    if not zipfile.is_zipfile(path):
        return path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        return sum(item.file_size for item in archive.infolist())


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
