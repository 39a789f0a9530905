"""Objects in MATLAB files of all versions: tables, timetables, dates, durations and others, read through mat-io."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from friction_ocp.errors import FrictionOcpError
from friction_ocp.optional_library import optional_library
from friction_ocp.recording.foreign import Values, reason_of
from friction_ocp.recording.matrix_columns import matrix_columns

MAX_DEPTH = 20
_OFFSET, _NOWHERE = slice(116, 124), (b"\0" * 8, b" " * 8)
"""Where the header of a file up to version 7 says where objects begin, and what it says where there are none."""
_UNIT_KEYS = ("VariableUnits", "varUnits")


def has_objects(path: Path) -> bool:
    """Whether a file of version 5 to 7 holds objects."""
    with path.open("rb") as file:
        head = file.read(128)
    return len(head) == 128 and head[_OFFSET] not in _NOWHERE


def columns_with_objects(path: Path) -> tuple[list[tuple[str, Values, str]], str]:
    """Return name, values and stated unit of every series in a file that holds objects, and what cannot be read.

    A table has columns `table.name`, a timetable its times beside them, an object of another class its properties.
    Without mat-io, and where it fails, there are no series: the variables that are no objects can be read all the same.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that time zones and display formats are left out
            purpose = "reading tables and other objects in it"
            matio: Any = optional_library("matio", "mat-io", "matlab", str(path), purpose)
            content: Mapping[str, Any] = matio.load_from_mat(str(path), add_table_attrs=True)
            variables = [(name, value) for name, value in content.items() if not name.startswith("__")]
            return [series for name, value in variables for series in _columns(name, value, 0)], ""
    except MemoryError:
        raise
    except FrictionOcpError as error:
        return [], "; " + "; ".join(f"{finding.what}: {finding.remedy}" for finding in error.findings)
    except Exception as error:  # what its reader makes of objects that it does not know is not to be foreseen
        return [], f"; tables and other objects in it cannot be read ({reason_of(error)})"


def _columns(name: str, value: Any, depth: int) -> Iterator[tuple[str, Values, str]]:
    """Yield the series in a value: a table, an object, a struct, a cell array or an array of numbers."""
    if depth > MAX_DEPTH:
        return
    if hasattr(value, "columns"):
        yield from _table(name, value)
    elif hasattr(value, "properties"):
        yield from _columns(name, value.properties, depth + 1)
    elif isinstance(value, Mapping):
        for key, inner in value.items():  # pyright: ignore[reportUnknownVariableType]
            yield from _columns(f"{name}.{key}", inner, depth + 1)
    elif isinstance(value, np.ndarray):
        array = cast(Values, value)
        if array.dtype.names is None and array.dtype.kind != "O":
            texts = array.astype(str) if array.dtype.kind == "T" else array
            yield from ((column, values, "") for column, values in matrix_columns(name, texts))
            return
        elements = np.ravel(array, order="F")
        for index, inner in enumerate(elements):
            is_struct = array.dtype.names is not None
            fields = {key: inner[key] for key in array.dtype.names or ()} if is_struct else inner
            alone = is_struct and elements.size == 1
            yield from _columns(name if alone else f"{name}{{{index}}}", fields, depth + 1)
    elif isinstance(value, int | float | str):
        yield name, np.atleast_1d(np.asarray(value)), ""


def _table(name: str, table: Any) -> Iterator[tuple[str, Values, str]]:
    """Yield the columns of a data frame, and the times of its rows where it has some."""
    if table.index.dtype.kind in "mMf":
        yield f"{name}.{table.index.name or 'Time'}", np.asarray(table.index), ""
    units = next((table.attrs[key] for key in _UNIT_KEYS if table.attrs.get(key)), [""] * len(table.columns))
    for column, unit in zip(table.columns, units, strict=False):
        values = np.asarray(table[column])
        if values.dtype.kind == "O" and all(isinstance(cell, str) for cell in values):
            values = values.astype(str)
        if values.dtype.kind != "O":
            yield f"{name}.{column}", values, str(unit)
