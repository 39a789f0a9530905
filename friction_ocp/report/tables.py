"""Rows of the tables, with numbers already written out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from friction_ocp.plots.numbers import NOTHING, is_number, percent, plain, significant, to_resolution, unit_text
from friction_ocp.plots.palette import NEGATIVE, POSITIVE, VERDICT_WORDS
from friction_ocp.plots.reading import Json, objects, part, rows

SPLITS = {"train": "training", "validation": "validation"}
"""What the keys of the result are called on the page."""

_SIGNS = {"ok": "✓", "at_bound": "▲", "traded": "⇄", "not_identifiable": "✕"}
_ORDER = ("not_identifiable", "at_bound", "traded", "ok")  # worst first


@dataclass(frozen=True)
class Cell:
    """What stands in a cell, and what it is sorted by; nothing sorts last."""

    text: str
    key: float | str | None = None


@dataclass(frozen=True)
class ParameterRow:
    """One estimate."""

    name: str
    unit: str
    unit_text: str
    value: Cell
    interval: Cell
    relative: Cell
    """Half of the interval over the value."""
    std_error: Cell
    guess: Cell
    verdict: str
    word: str
    sign: str
    rank: int
    traded_with: tuple[str, ...]


@dataclass(frozen=True)
class FitRow:
    """The error of one channel on the training or the validation recordings."""

    recordings: str
    """Which recordings: a name, or what they served for."""
    unit_text: str
    rms: str
    mae: str
    relative: str
    relative_norm: str
    noise_ratio: str
    noise_source: str


@dataclass(frozen=True)
class CorrelationCell:
    """One entry of the matrix and the colour behind it."""

    text: str
    background: str
    strong: bool


def parameter_rows(parameters: Mapping[str, Json]) -> list[ParameterRow]:
    """Return the rows of the parameter table in the order of the result."""
    return [_parameter_row(name, parameter) for name, parameter in parameters.items()]


def _parameter_row(name: str, parameter: Json) -> ParameterRow:
    value, std_error = parameter.get("value"), parameter.get("std_error")
    verdict = _judged_word(parameter)
    unit = str(parameter.get("unit", ""))
    return ParameterRow(
        name=name,
        unit=unit,
        unit_text=unit_text(unit),
        value=Cell(to_resolution(value, std_error), _key(value)),
        interval=_interval(rows(parameter, "interval95"), std_error),
        relative=_relative(value, rows(parameter, "interval95")),
        std_error=Cell(significant(std_error, 2), _key(std_error)),
        guess=Cell(plain(parameter.get("guess")), _key(parameter.get("guess"))),
        verdict=verdict if verdict in _SIGNS else "other",
        word=VERDICT_WORDS.get(verdict, verdict or NOTHING),
        sign=_SIGNS.get(verdict, ""),
        rank=_ORDER.index(verdict) if verdict in _ORDER else len(_ORDER),
        traded_with=tuple(str(other) for other in rows(parameter, "traded_with")),
    )


def _judged_word(parameter: Json) -> str:
    """Return the verdict of a parameter; nothing where it would be ok, and yet has no interval: of no optimum."""
    verdict = str(parameter.get("verdict", ""))
    return "" if verdict == "ok" and "interval95" in parameter and parameter["interval95"] is None else verdict


def _interval(bounds: Sequence[Any], std_error: Any) -> Cell:
    """Return both bounds, sorted by the width between them; an open side is infinite."""
    if len(bounds) != 2 or not any(is_number(bound) for bound in bounds):
        return Cell(NOTHING)
    first, last = (
        to_resolution(bound, std_error) if is_number(bound) else sign + "∞"
        for bound, sign in zip(bounds, ("-", ""), strict=True)
    )
    width = bounds[1] - bounds[0] if all(is_number(bound) for bound in bounds) else None
    return Cell(f"[{first}, {last}]", width)


def _relative(value: Any, bounds: Sequence[Any]) -> Cell:
    """Return half of an interval as a share of the value; nothing where a side is open or the value is zero."""
    if len(bounds) != 2 or not value or not all(is_number(item) for item in (value, *bounds)):
        return Cell(NOTHING)
    share = 0.5 * (bounds[1] - bounds[0]) / abs(value)
    return Cell(f"± {percent(share, 2)}", share)


def _key(value: Any) -> float | None:
    return float(value) if is_number(value) else None


def fit_rows(fit: Json) -> dict[str, list[FitRow]]:
    """Return the training and the validation row of each channel."""
    table: dict[str, list[FitRow]] = {}
    for key, split in SPLITS.items():
        for channel, errors in objects(fit, key).items():
            table.setdefault(channel, []).append(_fit_row(split, errors))
    return table


def fit_rows_by_recording(fit: Json) -> dict[str, list[FitRow]]:
    """Return the rows of each channel's recordings; where there is only a number, it is the rms."""
    table: dict[str, list[FitRow]] = {}
    for key, split in SPLITS.items():
        for channel, errors in objects(fit, key).items():
            shared = {"unit": errors.get("unit"), "noise_source": errors.get("noise_source")}
            by_recording = part(errors, "by_recording")
            for recording, found in by_recording.items():
                own = part(by_recording, recording) or {"rms": found}
                table.setdefault(channel, []).append(_fit_row(f"{recording} ({split})", {**shared, **own}))
    return table


def static_rows(fit: Json) -> list[FitRow]:
    """Return the row of each set of static points."""
    return [
        _fit_row(f"{name}: {points.get('measures')} ({SPLITS.get(str(points.get('split')), '')})", points)
        for name, points in objects(fit, "static").items()
    ]


def _fit_row(recordings: str, errors: Json) -> FitRow:
    return FitRow(
        recordings=recordings,
        unit_text=unit_text(str(errors.get("unit") or "")),
        rms=significant(errors.get("rms"), 3),
        mae=significant(errors.get("mae"), 3),
        relative=percent(errors.get("relative")),
        relative_norm=percent(errors.get("relative_norm")),
        noise_ratio=significant(errors.get("noise_ratio"), 3),
        noise_source=str(errors.get("noise_source") or NOTHING),
    )


def correlation_rows(correlation: Json) -> list[tuple[str, list[CorrelationCell]]]:
    """Return name and cells of each row of the matrix."""
    names = [str(name) for name in rows(correlation, "names")]
    return [
        (name, [_correlation_cell(value) for value in row])
        for name, row in zip(names, rows(correlation, "matrix"), strict=True)
    ]


def _correlation_cell(value: Any) -> CorrelationCell:
    if not is_number(value):
        return CorrelationCell(NOTHING, "transparent", strong=False)
    strength = min(1.0, abs(value))
    base = POSITIVE if value > 0 else NEGATIVE
    return CorrelationCell(f"{value:.2f}".replace("-", "−"), f"{base}{round(255 * strength):02x}", strength > 0.85)
