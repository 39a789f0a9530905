"""Autocorrelation of the residuals, by recording and channel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_ocp.plots.palette import MUTED, RESIDUAL, VERDICTS
from friction_ocp.plots.style import WIDTH, Axes, Figure, axes_grid, new_figure

Residual = Mapping[str, Any]


def whiteness_figure(residuals: Mapping[str, Mapping[str, Residual]]) -> Figure:
    """Draw a row a recording and a column a channel, on common axes."""
    channels = list(dict.fromkeys(name for by_channel in residuals.values() for name in by_channel))
    width = max(WIDTH, 3.2 * len(channels))
    figure = new_figure(0.9 + 1.7 * len(residuals), width)
    grid = axes_grid(figure, len(residuals), len(channels), sharey=True, sharex="col")
    for row, (recording, by_channel) in zip(grid, residuals.items(), strict=True):
        for axes, channel in zip(row, channels, strict=True):
            axes.set_title(f"{channel}: {recording}", fontsize=9.5)
            if channel in by_channel:
                _draw(axes, by_channel[channel])
        row[0].set_ylabel("autocorrelation")
    for axes in grid[-1]:
        axes.set_xlabel("lag in s")
    return figure


def _draw(axes: Axes, residual: Residual) -> None:
    band = residual.get("band")
    if band is not None:
        axes.axhspan(-band, band, color=MUTED, alpha=0.18, linewidth=0)
    axes.axhline(0.0, color=MUTED, linewidth=0.8)
    axes.plot(residual["lag_s"], residual["autocorrelation"], color=RESIDUAL)
    axes.set_ylim(-1.05, 1.05)
    white = bool(residual.get("white"))
    axes.text(
        0.99,
        0.97,
        "white" if white else "not white",
        color=VERDICTS["ok" if white else "at_bound"],
        transform=axes.transAxes,
        ha="right",
        va="top",
        fontsize=9,
    )
