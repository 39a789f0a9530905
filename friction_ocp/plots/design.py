"""Figures of a design: what each motion is worth, and the best one as it would be recorded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from friction_ocp.plots.numbers import unit_text
from friction_ocp.plots.palette import MEASURED, SIMULATED
from friction_ocp.plots.reading import Json, part, rows
from friction_ocp.plots.series import Series
from friction_ocp.plots.style import Figure, axes_grid, headline, new_figure

MEANING = {
    "D": "gain in the logarithm of the determinant of the information",
    "A": "minus the mean of squared relative standard errors",
    "separation": "squared distance of the rivals, in noise floors",
}


def design_figures(result: Json, expected: Series) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of whatever the design has."""
    options = rows(result, "options")
    if options:
        yield "worth", worth_figure(str(result["criterion"]), options)
        best = str(options[0]["motion"])
        yield "excitation", excitation_figure(best, expected[best], part(result, "channel_units"))


def worth_figure(criterion: str, options: Sequence[Json]) -> Figure:
    """Draw what every motion is worth."""
    figure = new_figure(1.2 + 0.4 * len(options))
    axes = axes_grid(figure, 1)[0][0]
    worths = [float(option["worth"]) if option["worth"] is not None else np.nan for option in options]
    axes.barh(np.arange(len(options)), worths, color=MEASURED)
    axes.set_yticks(np.arange(len(options)), [str(option["motion"]).replace("_", " ") for option in options])
    axes.set_xlabel(MEANING[criterion])
    axes.set_title("What each motion is worth")
    if criterion == "separation":
        axes.set_xscale("symlog", linthresh=1.0)
        axes.xaxis.set_major_formatter("{x:g}")
    axes.invert_yaxis()
    return figure


def excitation_figure(motion: str, channels: Mapping[str, Any], units: Mapping[str, Any]) -> Figure:
    """Draw the channels of a motion as the model expects them."""
    figure = new_figure(0.6 + 1.8 * len(channels))
    title = f"{motion.replace('_', ' ')}: what the model expects"
    headline(figure, title)
    grid = axes_grid(figure, len(channels), sharex=True)
    for axes, (name, channel) in zip((row[0] for row in grid), channels.items(), strict=True):
        axes.plot(channel["time"], channel["simulated"], color=SIMULATED, linewidth=0.9)
        unit = unit_text(str(units.get(name, "")))
        axes.set_ylabel(f"{name}\nin {unit}" if unit else name)
    grid[-1][0].set_xlabel("time in s")
    return figure
