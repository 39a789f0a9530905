"""Bode picture of a linear drive, and what friction contributes to it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from friction_ocp.plots.palette import colour
from friction_ocp.plots.series import FloatArray
from friction_ocp.plots.style import Figure, axes_grid, new_figure, plain_log_ticks

Responses = Mapping[str, "np.ndarray[tuple[int], np.dtype[np.complex128]]"]


def bode_figure(frequency: FloatArray, responses: Responses, title: str, unit: str) -> Figure:
    """Draw magnitude and phase over frequency in Hz, one line for each response by its label."""
    figure = new_figure(6.0)
    grid = axes_grid(figure, 2, sharex=True)
    size, phase = grid[0][0], grid[1][0]
    for k, (label, response) in enumerate(responses.items()):
        size.loglog(frequency, np.abs(response), color=colour(k), linewidth=1.6, label=label)
        degrees = np.degrees(np.unwrap(np.angle(response)))
        phase.semilogx(frequency, degrees, color=colour(k), linewidth=1.6)
    for axis in (size.xaxis, size.yaxis, phase.xaxis):
        plain_log_ticks(axis)
    size.set_title(title)
    size.set_ylabel(f"magnitude in {unit}")
    size.legend()
    phase.set_ylabel("phase in deg")
    phase.set_xlabel("frequency in Hz")
    return figure
