"""Correlation matrix of the estimated parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from friction_ocp.plots.palette import INK, NEGATIVE, POSITIVE
from friction_ocp.plots.style import WIDTH, Figure, axes_grid, new_figure

_WRITTEN_UP_TO = 16  # parameters: beyond, the numbers would not be readable


def correlation_figure(correlation: Mapping[str, Any]) -> Figure:
    """Draw the matrix in colour, numbered along the top as along the side."""
    from matplotlib.colors import LinearSegmentedColormap

    names: list[str] = [str(name) for name in correlation["names"]]
    matrix = np.array(
        [[np.nan if value is None else value for value in row] for row in correlation["matrix"]], dtype=np.float64
    )
    count = len(names)
    side = max(2.5, min(0.46 * count, 14.0))
    figure = new_figure(side + 1.0, max(WIDTH, side + 4.5))
    axes = axes_grid(figure, 1)[0][0]
    scale = LinearSegmentedColormap.from_list("correlation", [NEGATIVE, "#ffffff", POSITIVE])
    image = axes.imshow(matrix, cmap=scale, vmin=-1.0, vmax=1.0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False)
    axes.set_xticks(range(count), [str(number + 1) for number in range(count)])
    axes.set_yticks(range(count), [f"{name}  {number + 1}" for number, name in enumerate(names)])
    axes.set_title("Correlation of the estimates", pad=12)
    figure.colorbar(image, ax=axes, shrink=0.8, ticks=[-1, -0.5, 0, 0.5, 1]).outline.set_visible(False)
    if count <= _WRITTEN_UP_TO:
        for (row, column), value in np.ndenumerate(matrix):
            if np.isfinite(value):
                dark = "white" if abs(value) > 0.85 else INK
                axes.text(
                    column, row, f"{value:.2f}".replace("-", "−"), ha="center", va="center", fontsize=8, color=dark
                )
    return figure
