"""Measured and simulated channels of one recording, each above its residual."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from friction_ocp.plots.numbers import significant, unit_text
from friction_ocp.plots.palette import GRID, MEASURED, MUTED, RESIDUAL, SIMULATED
from friction_ocp.plots.series import ChannelColumns, Trace, traces_of
from friction_ocp.plots.style import Axes, Figure, axes_grid, headline, new_figure


def traces_figure(recording: str, channels: Mapping[str, ChannelColumns], units: Mapping[str, str]) -> Figure:
    """Draw two axes a channel, all on one time axis."""
    traces = dict(traces_of(channels))
    figure = new_figure(0.6 + 3.4 * max(1, len(traces)))
    headline(figure, recording)
    if not traces:
        return figure
    grid = axes_grid(figure, 2 * len(traces), sharex=True, height_ratios=[2.4, 1.0] * len(traces))
    for row, (name, trace) in enumerate(traces.items()):
        _draw(grid[2 * row][0], grid[2 * row + 1][0], name, trace, unit_text(units.get(name, "")))
    grid[-1][0].set_xlabel("time in s")
    figure.align_ylabels()
    return figure


def _draw(upper: Axes, lower: Axes, name: str, trace: Trace, unit: str) -> None:
    suffix = f" in {unit}" if unit else ""
    upper.plot(trace.time, trace.measured, color=MEASURED, linewidth=1.4, label="measured")
    upper.plot(trace.time, trace.simulated, color=SIMULATED, linewidth=1.1, label="simulated")
    upper.set_title(name)
    upper.set_ylabel(f"value{suffix}")
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
    lower.axhline(0.0, color=GRID, linewidth=1.2)
    lower.plot(trace.time, trace.residual, color=RESIDUAL, linewidth=0.9)
    lower.set_ylabel(f"residual{suffix}", fontsize=9)
    finite = trace.residual[np.isfinite(trace.residual)]
    if finite.size:
        largest = significant(float(np.abs(finite).max()), 2)
        text = f"measured − simulated, at most {largest} {unit}"
        lower.set_title(text, fontsize=9, fontweight="normal", color=MUTED)
