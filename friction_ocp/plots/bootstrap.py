"""Bootstrap draws, one panel a parameter."""

from __future__ import annotations

import numpy as np

from friction_ocp.plots.numbers import is_number, unit_text
from friction_ocp.plots.palette import GRID, INK, RESIDUAL, SIMULATED
from friction_ocp.plots.panels import panels
from friction_ocp.plots.reading import Json, objects, part, rows
from friction_ocp.plots.style import Axes, Figure


def bootstrap_figure(bootstrap: Json) -> Figure:
    """Draw the draws as histograms, their 95 % interval shaded, and the normal curve of the standard error."""
    draws = part(bootstrap, "draws")
    columns = dict(zip(rows(draws, "names"), np.array(rows(draws, "values"), dtype=float).T, strict=True))
    found = objects(bootstrap, "parameters")
    figure, axes = panels(len(found), 0.3)
    for one, (name, item) in zip(axes, found.items(), strict=True):
        _draw(one, name, item, columns[name])
    if axes:
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
    return figure


def _draw(axes: Axes, name: str, item: Json, values: np.ndarray) -> None:
    low, high = (float(end) for end in rows(item, "interval95"))
    axes.axvspan(low, high, color=GRID, linewidth=0, label="95 % of the draws")
    spread = float(np.ptp(values))
    if spread > 0:
        axes.hist(
            values, bins=max(10, round(1.5 * values.size**0.5)), density=True, color=RESIDUAL, alpha=0.55, label="draws"
        )
    value, std_error = float(item["value"]), item.get("covariance_std_error")
    if is_number(std_error) and float(std_error or 0) > 0:
        size = float(std_error or 1)
        reach = max(3.2 * size, value - float(values.min()), float(values.max()) - value)
        across = np.linspace(value - reach, value + reach, 300)
        density = np.exp(-0.5 * ((across - value) / size) ** 2) / (size * np.sqrt(2.0 * np.pi))
        axes.plot(across, density, color=SIMULATED, linewidth=1.4, label="standard error of the fit")
    axes.axvline(value, color=INK, linewidth=1.2, label="estimate")
    axes.set_title(name, fontsize=9.5)
    axes.set_yticks([])
    axes.set_xlabel(unit_text(str(item.get("unit", ""))), fontsize=9)
