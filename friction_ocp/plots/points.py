"""Static points beside what the drive with the answer needs at constant speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from friction_ocp.plots.numbers import significant, unit_text
from friction_ocp.plots.palette import MUTED, colour
from friction_ocp.plots.style import Figure, axes_grid, new_figure

ERROR_BARS = 1.96


def points_figure(name: str, points: Mapping[str, Any]) -> Figure:
    """Draw measured points with their 95 % bars, the prediction through them, and the errors below."""
    speed, measured, predicted, error = (
        np.array(points[key], dtype=np.float64) for key in ("speed", "measured", "predicted", "std_error")
    )
    order = np.argsort(speed)
    figure = new_figure(6.0)
    grid = axes_grid(figure, 2, sharex=True, height_ratios=(2, 1))
    upper, lower = grid[0][0], grid[1][0]
    unit = unit_text(str(points["unit"]))
    upper.errorbar(
        speed, measured, ERROR_BARS * error, fmt="o", markersize=4, color=colour(0), label="measured, 95 % bars"
    )
    for side in (speed[order] < 0, speed[order] >= 0):
        label = "simulated" if side.any() and not upper.lines[1:] else None
        upper.plot(speed[order][side], predicted[order][side], color=colour(1), linewidth=1.6, label=label)
    upper.set_ylabel(f"{points['measures']} in {unit}")
    upper.set_title(f"Static points {name}: errors {significant(points['noise_ratio'], 3)} times their standard error")
    upper.legend()
    lower.errorbar(speed, measured - predicted, ERROR_BARS * error, fmt="o", markersize=4, color=colour(0))
    lower.axhline(0.0, color=MUTED, linewidth=0.8)
    lower.set_ylabel(f"error in {unit}")
    lower.set_xlabel("speed of the motor's shaft")
    return figure
