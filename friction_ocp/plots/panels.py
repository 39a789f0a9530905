"""Grids of small panels, one a parameter."""

from __future__ import annotations

from friction_ocp.plots.style import Axes, Figure, axes_grid, new_figure

_COLUMNS = 3
_PANEL_HEIGHT = 2.5


def panels(count: int, legend_room: float = 0.0) -> tuple[Figure, list[Axes]]:
    """Return a figure with `count` axes, three in a row, few ticks each."""
    columns = min(_COLUMNS, max(count, 1))
    lines = -(-max(count, 1) // columns)
    figure = new_figure(0.4 + legend_room + _PANEL_HEIGHT * lines, 3.2 * columns + 0.4)
    axes = [one for row in axes_grid(figure, lines, columns) for one in row]
    for one in axes[count:]:
        one.set_visible(False)
    for one in axes[:count]:
        one.locator_params(axis="x", nbins=4)
        one.locator_params(axis="y", nbins=4)
        one.tick_params(labelsize=8.5)
    return figure, axes[:count]
