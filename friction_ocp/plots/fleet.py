"""Parameters of a fleet over time: a figure a parameter, a panel a machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from friction_ocp.plots.numbers import unit_text
from friction_ocp.plots.palette import MEASURED, MUTED, NEGATIVE, POSITIVE, SIMULATED
from friction_ocp.plots.reading import Json, rows
from friction_ocp.plots.style import Axes, Figure, axes_grid, headline, new_figure

_COLUMNS, _PANEL_HEIGHT, _WIDTH = 2, 1.9, 10.0
_PER_FIGURE = 20
"""Machines in one figure; more go to further ones, those that are flagged first."""


def fleet_figures(result: Json) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of every parameter."""
    everything: Sequence[Json] = rows(result, "series")
    dated = result.get("time") == "days"
    for parameter in dict.fromkeys(str(item["parameter"]) for item in everything):
        own = [item for item in everything if item["parameter"] == parameter]
        own.sort(key=lambda item: not (item["drifts"] or any(item["outlier"])))
        for start in range(0, len(own), _PER_FIGURE):
            name = parameter if start == 0 else f"{parameter}-{start // _PER_FIGURE + 1}"
            yield name, parameter_figure(parameter, own[start : start + _PER_FIGURE], dated)


def parameter_figure(parameter: str, series: Sequence[Json], dated: bool) -> Figure:
    """Draw the estimates of each machine with their 95 % intervals, and the level or drift that was found."""
    lines = -(-len(series) // _COLUMNS)
    figure = new_figure(0.9 + _PANEL_HEIGHT * lines, _WIDTH)
    unit = unit_text(str(series[0]["unit"]))
    headline(figure, f"{parameter}{f' in {unit}' if unit else ''}")
    axes = [one for row in axes_grid(figure, lines, _COLUMNS, sharex=True) for one in row]
    for one in axes[len(series) :]:
        one.set_visible(False)
    for one, item in zip(axes, series, strict=False):
        _draw(one, item, dated)
    for one in axes[max(0, len(series) - _COLUMNS) : len(series)]:
        one.set_xlabel("" if dated else "number of the recording")
        one.tick_params(labelbottom=True)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
    return figure


def _draw(axes: Axes, item: Json, dated: bool) -> None:
    time = _times(item["time"]) if dated else item["time"]
    value, half = np.asarray(item["value"]), 1.96 * np.asarray(item["std_error"])
    out = np.asarray(item["outlier"], dtype=bool)
    axes.errorbar(
        time, value, yerr=half, linestyle="none", marker="o", markersize=3.5, color=MEASURED, linewidth=1.0,
        label="fit with 95 % interval",
    )  # fmt: skip
    axes.plot(time, item["expected"], color=POSITIVE if item["drifts"] else NEGATIVE, label="level, or drift")
    axes.plot(
        [at for at, flag in zip(time, out, strict=True) if flag], value[out], linestyle="none", marker="X",
        markersize=8, color=SIMULATED, label="stands out",
    )  # fmt: skip
    words = [*(["drifts"] if item["drifts"] else []), *(["outlier"] if out.any() else [])]
    axes.set_title(f"{item['machine']}{': ' + ', '.join(words) if words else ''}", color=POSITIVE if words else MUTED)
    axes.locator_params(axis="y", nbins=4)
    if dated:
        _short_dates(axes)
    else:
        axes.locator_params(axis="x", nbins=6)


def _short_dates(axes: Axes) -> None:
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    locator: Any = AutoDateLocator(maxticks=6)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))


def _times(days: Sequence[float]) -> list[datetime]:
    return [datetime.fromtimestamp(86400.0 * day, UTC) for day in days]
