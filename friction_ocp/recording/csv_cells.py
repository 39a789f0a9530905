"""Cells of delimited text: which are numbers, which are missing, which are neither."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from friction_ocp.errors import Finding
from friction_ocp.recording.foreign import EXACT_INTEGERS, Values
from friction_ocp.recording.recording import FloatArray

_MISSING = ("", "nan", "na", "n/a", "#n/a", "#na", "#nv", "null", "none", "-")
_SWITCH = {"true": 1.0, "false": 0.0}
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)(e[-+]?\d+)?", re.IGNORECASE)
_GROUP = {".": ",", ",": "."}
"""What groups thousands beside each decimal sign."""
_GROUPED = {
    ".": re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?"),
    ",": re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?"),
}


def is_missing(cell: str) -> bool:
    """Whether a cell says that there is no value."""
    return cell.strip().lower() in _MISSING


def is_number(cell: str) -> bool:
    """Whether a cell is a number in some way of writing."""
    return any(pattern.fullmatch(cell) for pattern in (_NUMBER, *_GROUPED.values()))


def numbers(cells: Sequence[str], decimal: str | None) -> tuple[Values, list[int]]:
    """Return the numbers in a column, NaN for empty cells, and the rows of cells that are neither.

    Integers beyond what floats hold stay integers where no cell is empty. The other sign groups thousands only beside a
    decimal sign that was stated.
    """
    try:
        return _exact(cells, _plain(cells, decimal)), []
    except ValueError:
        found = [_number(cell.strip(), decimal) for cell in cells]
        bad = [row for row, number in enumerate(found) if number is None]
        return np.array([np.nan if number is None else number for number in found]), bad


def joined(pieces: Sequence[Values]) -> Values:
    """Return the pieces of a column as one, whole numbers as integers where one piece holds integers."""
    if any(piece.dtype.kind == "i" for piece in pieces) and all(map(_is_whole, pieces)):
        return np.concatenate([piece.astype(np.int64) for piece in pieces])
    return np.concatenate([*pieces, np.empty(0)])


def no_number(where: str, place: str, cell: str, decimal: str | None) -> Finding:
    """Return the finding about a cell that is no number, with what would make it one."""
    what, allowed, remedy = f"{place} is not a number", "", "correct or empty the cell"
    if decimal is None and "," in cell and is_number(cell):
        comma, groups = bool(_NUMBER.fullmatch(cell)), bool(_GROUPED["."].fullmatch(cell))
        remedy = "set decimal: ','" if comma else "set decimal: '.'"
        remedy += ", or decimal: '.' if it groups thousands" if comma and groups else ""
    elif decimal is not None and is_number(cell):
        example = "1.234,5" if decimal == "," else "1,234.5"
        allowed = f"beside decimal: '{decimal}', '{_GROUP[decimal]}' groups thousands, as in {example}"
        remedy = "correct the cell, or decimal"
    return Finding(where, what, allowed, remedy)


def _plain(cells: Sequence[str], decimal: str | None) -> FloatArray:
    """Return a column of nothing but plain numbers; raises ValueError where there is anything else."""
    if decimal == ",":
        if any("." in cell for cell in cells):
            raise ValueError
        cells = [cell.replace(",", ".") for cell in cells]
    return np.asarray(cells, dtype=np.float64)


def _exact(cells: Sequence[str], values: FloatArray) -> Values:
    if np.any(np.abs(values) > EXACT_INTEGERS):
        with suppress(ValueError, OverflowError):
            return np.asarray(cells, dtype=np.int64)
    return values


def _is_whole(values: Values) -> bool:
    if values.dtype.kind == "i":
        return True
    return bool(np.all((np.abs(values) <= EXACT_INTEGERS) & (values == np.rint(values))))


def _number(cell: str, decimal: str | None) -> float | None:
    """Return the value of one cell, a switch as 1 or 0, NaN where it is missing, None where it is neither."""
    if is_missing(cell):
        return np.nan
    if cell.lower() in _SWITCH:
        return _SWITCH[cell.lower()]
    if decimal is not None and _GROUPED[decimal].fullmatch(cell):
        cell = cell.replace(_GROUP[decimal], "")
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    try:
        return float(cell)
    except ValueError:
        return None
