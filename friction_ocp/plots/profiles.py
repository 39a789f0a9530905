"""Profile likelihoods, one panel a parameter."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from friction_ocp.plots.numbers import is_number, unit_text
from friction_ocp.plots.palette import GRID, INK, MUTED, RESIDUAL, SIMULATED, VERDICTS
from friction_ocp.plots.panels import panels
from friction_ocp.plots.reading import Json, objects, rows
from friction_ocp.plots.style import Axes, Figure

PROFILE_WORDS: Mapping[str, tuple[str, str]] = {
    "finite": ("finite", VERDICTS["ok"]),
    "one_sided": ("one-sided", VERDICTS["at_bound"]),
    "flat": ("flat", VERDICTS["not_identifiable"]),
}
"""What a verdict is called and its colour."""

_HEADROOM = 1.7  # top of a panel over the threshold


def profiles_figure(profile: Json) -> Figure:
    """Draw scaled likelihood ratios with their threshold, and the parabola of the standard error behind."""
    threshold = float(profile.get("threshold") or 1.0)
    found = objects(profile, "parameters")
    figure, axes = panels(len(found), 0.3)
    for one, (name, item) in zip(axes, found.items(), strict=False):
        _draw(one, name, item, threshold)
    if axes:
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
    figure.supylabel("scaled likelihood ratio", fontsize=10)
    return figure


def _draw(axes: Axes, name: str, item: Json, threshold: float) -> None:
    points = rows(item, "points")
    values = np.array([point["value"] for point in points])
    ratios = np.array([point["ratio"] for point in points])
    low, high = float(values.min()), float(values.max())
    value, std_error = float(item["value"]), item.get("std_error")
    ends = rows(item, "interval95")
    shaded = [end if is_number(end) else edge for end, edge in zip(ends, (low, high), strict=True)]
    axes.axvspan(*shaded, color=GRID, linewidth=0, label="not excluded at 95 %")
    if is_number(std_error) and float(std_error or 0) > 0:
        across = np.linspace(low, high, 200)
        axes.plot(
            across,
            ((across - value) / float(std_error or 1)) ** 2,
            color=MUTED,
            linewidth=1.0,
            linestyle=":",
            label="standard error",
        )
    axes.axhline(threshold, color=INK, linewidth=1.0, linestyle="--", label="threshold")
    axes.plot(values, ratios, color=RESIDUAL, linewidth=1.4, label="profile")
    sound = np.array([bool(point["converged"]) for point in points])
    axes.plot(values[sound], ratios[sound], "o", color=RESIDUAL, markersize=4)
    axes.plot(values[~sound], ratios[~sound], "x", color=SIMULATED, markersize=6)
    axes.plot([value], [0.0], "D", color=INK, markersize=5, zorder=4)
    axes.set_ylim(min(-0.15 * threshold, 1.1 * float(ratios.min())), _HEADROOM * threshold)
    word, stroke = PROFILE_WORDS.get(str(item.get("verdict")), (str(item.get("verdict")), INK))
    axes.set_title(name, fontsize=9.5, pad=14)
    axes.text(0.0, 1.01, word, transform=axes.transAxes, color=stroke, fontsize=9, va="bottom")
    axes.set_xlabel(unit_text(str(item.get("unit", ""))), fontsize=9)
