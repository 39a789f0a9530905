"""What a statistic adds to the page of an identification: sentence, picture, tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from friction_ocp.plots.numbers import NOTHING, is_number, to_resolution


@dataclass(frozen=True)
class Column:
    """Head of a column."""

    head: str
    number: bool = True


@dataclass(frozen=True)
class StatisticTable:
    """A table whose cells are written out."""

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def filled(self) -> StatisticTable:
        """The same without the columns that are empty in every row."""
        kept = [k for k in range(len(self.columns)) if any(row[k] for row in self.rows)]
        own = tuple(tuple(row[k] for k in kept) for row in self.rows)
        return StatisticTable(self.caption, tuple(self.columns[k] for k in kept), own)


@dataclass(frozen=True)
class StatisticSection:
    """A section of the page."""

    kind: str
    """What the page is about, in place of "Identification"."""
    title: str
    sentence: str
    notes: tuple[str, ...]
    picture: str
    """What the picture shows, for who cannot see it."""
    tables: tuple[StatisticTable, ...]
    figure: str = ""
    """SVG in base64."""


def columns(texts: str = "", numbers: str = "") -> tuple[Column, ...]:
    """Return columns of text, then columns of numbers, from heads that are parted by '|'."""
    parts = ((texts, False), (numbers, True))
    return tuple(Column(head.strip(), number) for heads, number in parts if heads for head in heads.split("|"))


def interval_text(ends: Sequence[object], std_error: object) -> str:
    """Return an interval to the digits of its standard error; an open end is an ellipsis."""
    if not any(is_number(end) for end in ends):
        return NOTHING
    low, high = (to_resolution(end, std_error) if is_number(end) else "…" for end in ends)
    return f"{low} to {high}"


def listed(words: Iterable[str]) -> str:
    """Return words joined by commas."""
    return ", ".join(words)


def table_lines(table: StatisticTable) -> list[str]:
    """Return a table as aligned plain text, without the columns that are empty."""
    filled = table.filled
    cells = [tuple(column.head for column in filled.columns), *filled.rows]
    widths = [max(map(len, texts)) for texts in zip(*cells, strict=True)]
    return [
        "  ".join(
            text.rjust(width) if column.number else text.ljust(width)
            for text, width, column in zip(row, widths, filled.columns, strict=True)
        ).rstrip()
        for row in cells
    ]
