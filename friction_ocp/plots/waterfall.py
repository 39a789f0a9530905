"""Many starts: how far each end lies above the best, and which parameters differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from friction_ocp.plots.numbers import is_number
from friction_ocp.plots.palette import INK, MUTED, colour
from friction_ocp.plots.reading import Json, part, rows
from friction_ocp.plots.style import Axes, Figure, axes_grid, new_figure

_LOWEST = 1e-8  # relative excess that is drawn as none
_NO_OPTIMUM = MUTED
_TICKS = (-30.0, -10.0, -3.0, -1.0, -0.3, 0.0, 0.1, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0)


def waterfall_figure(multistart: Json, parameters: Mapping[str, Json]) -> Figure:
    """Draw the ends in order of their objectives above, and start and end of every parameter below."""
    starts: Sequence[Json] = rows(multistart, "starts")
    ended = sorted(
        (start for start in starts if is_number(start.get("objective"))), key=lambda start: float(start["objective"])
    )
    figure = new_figure(5.4 + 0.36 * len(parameters), 9.0)
    above, below = (row[0] for row in axes_grid(figure, 2, height_ratios=[3.2, 1.0 + 0.36 * len(parameters)]))
    _draw_waterfall(above, ended, len(starts), multistart)
    _draw_parameters(below, ended, list(parameters))
    return figure


def _draw_waterfall(axes: Axes, ended: Sequence[Json], count: int, multistart: Json) -> None:
    lowest = float(ended[0]["objective"]) if ended else 0.0
    scale = abs(lowest) or 1.0
    excess = [max((float(start["objective"]) - lowest) / scale, _LOWEST) for start in ended]
    axes.plot(range(1, len(ended) + 1), excess, color=MUTED, linewidth=0.8, zorder=1)
    for rank, (start, height) in enumerate(zip(ended, excess, strict=True), 1):
        marker = "o" if start.get("converged") else "X"
        axes.plot([rank], [height], marker=marker, color=_stroke(start), markersize=7, linestyle="none", zorder=3)
    same = float(multistart.get("same_objective") or 1e-3)
    axes.axhline(same, color=INK, linewidth=1.0, linestyle="--")
    axes.text(1.0, same, f"{100 * same:g} %", transform=axes.get_yaxis_transform(), ha="right", va="bottom", fontsize=9)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.set_ylim(0.4 * _LOWEST, max(3.0, 3.0 * max(excess, default=1.0)))
    axes.set_xlim(0.4, count + 0.6)
    axes.xaxis.get_major_locator().set_params(integer=True)
    missing = count - len(ended)
    axes.set_title("Ends of all starts, best first" + (f"; {missing} failed" if missing else ""), pad=22)
    axes.set_xlabel("rank")
    axes.set_ylabel("objective above the best, relative")
    _legend(axes, ended, multistart)


def _legend(axes: Axes, ended: Sequence[Json], multistart: Json) -> None:
    for k, optimum in enumerate(rows(multistart, "optima")[:5]):
        label = f"optimum {k + 1}: {optimum['starts']} start{'s' * (optimum['starts'] != 1)}"
        axes.plot([], [], linestyle="none", marker="o", color=colour(k), markersize=7, label=label)
    if any(not start.get("converged") for start in ended):
        axes.plot([], [], linestyle="none", marker="X", color=MUTED, markersize=7, label="not converged")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.1, handletextpad=0.1)


def _draw_parameters(axes: Axes, ended: Sequence[Json], names: Sequence[str]) -> None:
    best: Json = part(ended[0], "end") if ended else {}
    for start in reversed(ended):
        for row, name in enumerate(names):
            scale = float(best[name]) or 1.0
            axes.plot([part(start, "start")[name] / scale], [row], "|", color=MUTED, markersize=11, zorder=4)
            axes.plot([part(start, "end")[name] / scale], [row], "o", color=_stroke(start), markersize=6, alpha=0.85)
    axes.set_xscale("symlog", linthresh=0.1, linscale=0.5)
    low, high = axes.get_xlim()
    axes.set_xticks([tick for tick in _TICKS if low <= tick <= high], minor=False)
    axes.set_xticks([], minor=True)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.axvline(1.0, color=MUTED, linewidth=1.0, zorder=0)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.set_title("Starts (bars) and ends (dots) of every parameter")
    axes.set_xlabel("value over that of the best end")


def _stroke(start: Json) -> Any:
    optimum = start.get("optimum")
    return colour(int(optimum)) if isinstance(optimum, int) else _NO_OPTIMUM
