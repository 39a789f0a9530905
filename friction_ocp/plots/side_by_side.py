"""Parameters of several results, each with its interval."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_ocp.plots.numbers import is_number, unit_text
from friction_ocp.plots.palette import MUTED, colour
from friction_ocp.plots.panels import panels
from friction_ocp.plots.reading import Json, objects, rows
from friction_ocp.plots.style import Axes, Figure

MOST = 30
"""Panels; the parameters that differ most come first where there are more."""


def side_by_side_figure(document: Json) -> Figure:
    """Draw a panel for each parameter, a point with its 95 % interval for each result."""
    items = objects(document, "parameters")
    shown = sorted(items, key=lambda name: -_farthest(items[name]))[:MOST] if len(items) > MOST else list(items)
    names = [str(item["name"]) for item in rows(document, "results")]
    figure, axes = panels(len(shown), legend_room=0.3 * len(names))
    for one, name in zip(axes, shown, strict=True):
        _draw(one, name, items[name])
    handles = [axes[0].plot([], [], "o", color=colour(k))[0] for k in range(len(names))]
    figure.legend(handles, names, loc="outside upper left", ncols=1)
    return figure


def _farthest(item: Json) -> float:
    sizes = [found["deviations"] or found["relative"] or 0.0 for found in rows(item, "differences") if found]
    return max((abs(float(size)) for size in sizes), default=0.0)


def _draw(axes: Axes, name: str, item: Json) -> None:
    values: Sequence[Json | None] = rows(item, "values")
    for k, found in enumerate(values):
        if found is None or not is_number(found["value"]):
            continue
        ends = [float(end) for end in rows(found, "interval95") if is_number(end)]
        if len(ends) == 2:
            axes.plot([k, k], ends, color=colour(k), linewidth=2.0)
        axes.plot([k], [found["value"]], "o", color=colour(k), markersize=6)
    unit = unit_text(str(item["unit"]))
    axes.set_title(f"{name}{f' in {unit}' if unit else ''}", fontsize=9, color=MUTED)
    axes.set_xticks(np.arange(len(values)), [""] * len(values))
    axes.set_xlim(-0.6, len(values) - 0.4)
    axes.grid(visible=False, axis="x")
