"""Coherence of measurement and simulation over frequency, by recording and channel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_ocp.plots.numbers import percent
from friction_ocp.plots.palette import SIMULATED
from friction_ocp.plots.style import WIDTH, Figure, axes_grid, new_figure, plain_log_ticks


def coherence_figure(found: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Figure:
    """Draw a row a recording and a column a channel, on common axes."""
    channels = list(dict.fromkeys(name for by_channel in found.values() for name in by_channel))
    figure = new_figure(0.9 + 1.7 * len(found), max(WIDTH, 3.2 * len(channels)))
    grid = axes_grid(figure, len(found), len(channels), sharey=True, sharex="col")
    for row, (recording, by_channel) in zip(grid, found.items(), strict=True):
        for axes, channel in zip(row, channels, strict=True):
            axes.set_title(f"{channel}: {recording}", fontsize=9.5)
            if channel in by_channel:
                share = by_channel[channel]
                axes.semilogx(share["frequency_hz"], share["share"], color=SIMULATED)
                plain_log_ticks(axes.xaxis)
                text = f"{percent(share.get('explained'))} of the power"
                axes.text(0.01, 0.03, text, transform=axes.transAxes, fontsize=9)
            axes.set_ylim(-0.02, 1.05)
        row[0].set_ylabel("coherence")
    for axes in grid[-1]:
        axes.set_xlabel("frequency in Hz")
    return figure
