"""MATLAB, version 5 through SciPy and version 7.3 through matlab_hdf5.py: vectors, matrices, fields of structs."""

from __future__ import annotations

import zlib
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.recording.foreign import ForeignFile, Values, reading, refuse_large
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.in_memory import in_memory
from friction_ocp.recording.matlab_hdf5 import is_hdf5, open_hdf5

KIND = "a MATLAB file"
MAX_DEPTH = 20
_COMPRESSED, _HEADER = 15, 128


@contextmanager
def open_matlab(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the variables of a MATLAB file.

    A matrix has columns `name[0]`, `name[1]`, a struct fields `name.field`, a cell or struct array elements `name{0}`.
    """
    if is_hdf5(path):
        with open_hdf5(path) as file:
            yield file
        return
    from scipy import io as _io  # pyright: ignore[reportMissingTypeStubs]

    io: Any = _io
    with reading(path, KIND):
        refuse_large(path, sum(_declared_sizes(path)), "variables")
        content: dict[str, Any] = io.loadmat(path, simplify_cells=True)
    variables = [(name, value) for name, value in content.items() if not name.startswith("__")]
    columns = dict(pair for name, value in variables for pair in _columns(name, value, 0))
    yield in_memory(columns, "MATLAB up to version 7")


def _declared_sizes(path: Path) -> Iterator[int]:
    """Yield the size in bytes that each variable of a version 5 file declares, unpacked."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if len(head) < _HEADER or head[126:128] not in (b"IM", b"MI"):
            return
        order = "little" if head[126:128] == b"IM" else "big"
        while len(tag := file.read(8)) == 8:
            kind, length = (int.from_bytes(tag[k : k + 4], order) for k in (0, 4))
            inner = b""
            if kind == _COMPRESSED:
                inner = zlib.decompressobj().decompress(file.read(min(length, 4096)), 8)
            yield int.from_bytes(inner[4:8], order) if len(inner) == 8 else length
            after = file.tell() - min(length, 4096) + length if kind == _COMPRESSED else file.tell() + length
            if after <= file.tell() - 8 or after > size:
                return
            file.seek(after)


def _columns(name: str, value: Any, depth: int) -> Iterator[tuple[str, Values]]:
    """Yield the series in a variable; a matrix has one a column, the longer side being the samples."""
    if isinstance(value, dict) and depth < MAX_DEPTH:
        for key, inner in cast(dict[str, Any], value).items():
            yield from _columns(f"{name}.{key}", inner, depth + 1)
    elif isinstance(value, list) and depth < MAX_DEPTH:
        for index, inner in enumerate(cast(list[Any], value)):
            yield from _columns(f"{name}{{{index}}}", inner, depth + 1)
    elif isinstance(value, np.ndarray) and cast(Values, value).dtype == object and depth < MAX_DEPTH:
        for index, inner in np.ndenumerate(cast(Values, value)):
            yield from _columns(f"{name}{{{','.join(map(str, index))}}}", inner, depth + 1)
    elif isinstance(value, np.ndarray):
        yield from matrix_columns(name, cast(Values, value))
    elif isinstance(value, int | float | str):
        yield name, np.atleast_1d(np.asarray(value))


def matrix_columns(name: str, values: Values) -> Iterator[tuple[str, Values]]:
    """Yield a vector as it is, a matrix column by column."""
    flat = np.squeeze(values)
    if flat.ndim <= 1:
        yield name, np.atleast_1d(flat)
    elif flat.ndim == 2:
        rows = flat if flat.shape[0] >= flat.shape[1] else flat.T
        for k in range(rows.shape[1]):
            yield f"{name}[{k}]", rows[:, k]
