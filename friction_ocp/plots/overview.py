"""All parameters at a glance: value and 95 % interval as multiples of the guess."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_ocp.plots.numbers import is_number, to_resolution, unit_text
from friction_ocp.plots.palette import MUTED, VERDICT_WORDS, VERDICTS
from friction_ocp.plots.reading import rows
from friction_ocp.plots.style import Axes, Figure, axes_grid, new_figure, plain_log_ticks

_MARKERS = {"ok": "o", "at_bound": "s", "traded": "D", "not_identifiable": "X"}
_LOG_BEYOND = 5.0  # largest over smallest ratio that a linear axis shows well


@dataclass(frozen=True)
class _Row:
    """One parameter over its guess, or over its value where the guess is zero."""

    name: str
    ratio: float
    interval: tuple[float, float] | None
    verdict: str
    text: str


def overview_figure(parameters: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw one line a parameter, first at the top; the marker's shape tells the verdict."""
    lines = [_row(name, parameter) for name, parameter in parameters.items()]
    figure = new_figure(1.5 + 0.36 * len(lines), 9.0)
    axes = axes_grid(figure, 1)[0][0]
    low, high = _limits(lines)
    if low > 0 and high / low > _LOG_BEYOND:
        axes.set_xscale("log")
        axes.set_xlim(low / 1.6, high * 1.6)
        plain_log_ticks(axes.xaxis)
    else:
        axes.set_xlim(low - 0.12 * (high - low), high + 0.12 * (high - low))
    low, high = axes.get_xlim()
    axes.axvline(1.0, color=MUTED, linewidth=1.2)
    for index, row in enumerate(lines):
        _draw(axes, index, row, (low, high))
    axes.set_yticks(range(len(lines)), [row.name for row in lines])
    axes.set_ylim(len(lines) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.set_title("Parameters over their guesses, with 95 % intervals", pad=26)
    axes.set_xlabel("value / guess, or over itself where the guess is 0; arrow: the interval goes on")
    _legend(axes, list(dict.fromkeys(row.verdict for row in lines)))
    return figure


def _row(name: str, parameter: Mapping[str, Any]) -> _Row:
    value: Any = parameter.get("value")
    guess: Any = parameter.get("guess")
    scale: float = guess if is_number(guess) and guess != 0 else (value or 1.0)
    bounds = rows(parameter, "interval95")
    interval = None
    if len(bounds) == 2 and all(is_number(bound) for bound in bounds):
        first, last = sorted(bound / scale for bound in bounds)
        interval = (first, last)
    text = f"{to_resolution(value, parameter.get('std_error'))} {unit_text(parameter.get('unit', ''))}".rstrip()
    if scale is not guess:
        text += " (guess 0)" if guess == 0 else " (no guess)"
    ratio = value / scale if is_number(value) else np.nan
    return _Row(name, ratio, interval, str(parameter.get("verdict", "ok")), text)


def _limits(lines: Sequence[_Row]) -> tuple[float, float]:
    """Return the range that shows the guess, every value and every trusted interval, at least from 0.8 to 1.2."""
    trusted = [bound for row in lines if row.verdict == "ok" and row.interval for bound in row.interval]
    finite = [ratio for ratio in [*trusted, *(row.ratio for row in lines)] if np.isfinite(ratio)]
    return min([0.8, *finite]), max([1.2, *finite])


def _draw(axes: Axes, index: int, row: _Row, limits: tuple[float, float]) -> None:
    colour = VERDICTS.get(row.verdict, MUTED)
    if row.interval is not None:
        first, last = max(row.interval[0], limits[0]), min(row.interval[1], limits[1])
        axes.plot([first, last], [index, index], color=colour, linewidth=2.2, solid_capstyle="butt")
        for end, beyond, marker in ((first, row.interval[0] < first, "<"), (last, row.interval[1] > last, ">")):
            if beyond:
                axes.plot([end], [index], marker=marker, color=colour, markersize=6, clip_on=False)
    axes.plot([row.ratio], [index], marker=_MARKERS.get(row.verdict, "o"), color=colour, markersize=7, zorder=3)
    axes.text(1.02, index, row.text, transform=axes.get_yaxis_transform(), va="center", fontsize=9.5)


def _legend(axes: Axes, verdicts: Sequence[str]) -> None:
    for verdict in verdicts:
        axes.plot(
            [],
            [],
            linestyle="none",
            marker=_MARKERS.get(verdict, "o"),
            markersize=7,
            color=VERDICTS.get(verdict, MUTED),
            label=VERDICT_WORDS.get(verdict, verdict),
        )
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2, handletextpad=0.1, columnspacing=1.2
    )
