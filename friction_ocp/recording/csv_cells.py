"""Cells of delimited text: which are numbers, which are missing, which are neither."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from friction_ocp.errors import Finding
from friction_ocp.recording.recording import FloatArray

_MISSING = ("", "nan", "na", "n/a", "#n/a", "#na", "#nv", "null", "none", "-")
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


def numbers(columns: Sequence[Sequence[str]], decimal: str | None) -> tuple[FloatArray, list[tuple[int, int]]]:
    """Return (columns, rows) numbers, NaN for empty cells, and the places of cells that are neither.

    Only beside a decimal sign that was stated does the other sign group thousands.
    """
    bad: list[tuple[int, int]] = []
    values = np.full((len(columns), len(columns[0]) if columns else 0), np.nan)
    for index, cells in enumerate(columns):
        try:
            values[index] = _plain(cells, decimal)
        except ValueError:
            for row, cell in enumerate(cells):
                number = _number(cell.strip(), decimal)
                if number is None:
                    bad.append((index, row))
                else:
                    values[index, row] = number
    return values, bad


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


def _number(cell: str, decimal: str | None) -> float | None:
    """Return the value of one cell, NaN where it is missing, None where it is neither."""
    if is_missing(cell):
        return np.nan
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
