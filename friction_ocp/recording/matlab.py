"""MATLAB, version 5 through SciPy, 7.3 through matlab_hdf5.py, tables and other objects through matlab_objects.py."""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.recording.foreign import ForeignFile, Values, reading, refuse_large
from friction_ocp.recording.import_map import ImportMap
from friction_ocp.recording.in_memory import in_memory
from friction_ocp.recording.matlab_hdf5 import has_objects_73, is_hdf5, open_hdf5
from friction_ocp.recording.matlab_objects import columns_with_objects, has_objects
from friction_ocp.recording.matrix_columns import matrix_columns

KIND = "a MATLAB file"
MAX_DEPTH = 20
_COMPRESSED, _HEADER = 15, 128


@contextmanager
def open_matlab(path: Path, import_map: ImportMap | None = None) -> Generator[ForeignFile]:
    """List the variables of a MATLAB file.

    A matrix has columns `name[0]`, `name[1]`, a struct fields `name.field`, a cell or struct array elements `name{0}`.
    """
    newer = is_hdf5(path)
    with reading(path, KIND):
        if not newer:
            refuse_large(path, sum(_declared_sizes(path)), "variables")
        objects = has_objects_73(path) if newer else has_objects(path)
        series, hint = columns_with_objects(path) if objects else ([], "")
    if series:
        columns = {name: values for name, values, _ in series}
        yield in_memory(columns, f"MATLAB with objects{hint}", {name: unit for name, _, unit in series})
    elif newer:
        with open_hdf5(path) as file:
            yield replace(file, summary=file.summary + hint)
    else:
        yield in_memory(_variables(path), "MATLAB up to version 7" + hint)


def _variables(path: Path) -> dict[str, Values]:
    """Return the series in the variables of a version 5 file that are no objects."""
    from scipy import io as _io  # pyright: ignore[reportMissingTypeStubs]

    io: Any = _io
    with reading(path, KIND), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of objects, which have no names there
        content: dict[str, Any] = io.loadmat(path, simplify_cells=True)
    variables = [(name, value) for name, value in content.items() if not name.startswith("__") and name != "None"]
    return dict(pair for name, value in variables for pair in _columns(name, value, 0))


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
