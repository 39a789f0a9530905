"""Models of the same recordings: criteria and errors, best model at the top."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_ocp.plots.numbers import is_number, significant
from friction_ocp.plots.palette import MEASURED, MUTED, RESIDUAL, SIMULATED
from friction_ocp.plots.reading import Json, objects, rows
from friction_ocp.plots.style import Axes, Figure, axes_grid, new_figure

_SPLITS = {"train": ("training", "o", RESIDUAL), "validation": ("validation", "D", SIMULATED)}


def comparison_figure(compare: Json) -> Figure:
    """Draw how far each model lies behind the best by every criterion, and its errors by channel."""
    models: Sequence[Json] = rows(compare, "models")
    channels = list(dict.fromkeys(name for model in models for name in objects(model, "train")))
    criteria = _behind(models)
    count = len(criteria) + len(channels)
    figure = new_figure(1.5 + 0.45 * len(models), 2.2 + 2.6 * count)
    axes = axes_grid(figure, 1, count, sharey=True)[0]
    for one, (title, behind) in zip(axes, criteria.items(), strict=False):
        _draw_criterion(one, title, behind)
    for one, channel in zip(axes[len(criteria) :], channels, strict=True):
        _draw_errors(one, channel, models)
    axes[0].set_yticks(range(len(models)), [str(model["name"]) for model in models])
    axes[0].set_ylim(len(models) - 0.4, -0.6)
    for one in axes:
        one.grid(visible=False, axis="y")
        one.tick_params(axis="y", length=0)
    figure.legend(*axes[-1].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def _behind(models: Sequence[Json]) -> dict[str, list[float]]:
    """Return by criterion how far each model lies behind the best, NaN where it has no value."""
    held = [_value(model, "held_out") for model in models]
    criteria = (
        {"held-out log-likelihood": [float(np.nanmax(held)) - value for value in held]}
        if any(np.isfinite(held))
        else {}
    )
    return criteria | {
        "AICc": [_value(model, "delta_aicc") for model in models],
        "BIC": [_value(model, "delta_bic") for model in models],
    }


def _value(model: Json, key: str) -> float:
    value = model.get(key)
    return float(value) if value is not None and is_number(value) else np.nan


def _draw_criterion(axes: Axes, title: str, behind: Sequence[float]) -> None:
    top = max([value for value in behind if np.isfinite(value)], default=0.0) or 1.0
    for row, value in enumerate(behind):
        if np.isfinite(value):
            axes.barh(row, value, height=0.55, color=MEASURED)
            axes.text(value + 0.02 * top, row, significant(value, 3), va="center", fontsize=9)
        else:
            axes.text(0.02 * top, row, "too few samples", va="center", fontsize=9, color=MUTED)
    axes.set_xlim(0.0, 1.3 * top)
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("behind the best", fontsize=9)


def _draw_errors(axes: Axes, channel: str, models: Sequence[Json]) -> None:
    largest = 0.0
    for split, (label, marker, stroke) in _SPLITS.items():
        errors = [_value(objects(model, split).get(channel, {}), "noise_ratio") for model in models]
        if np.any(np.isfinite(errors)):
            axes.plot(errors, range(len(models)), marker, color=stroke, markersize=7, label=label)
            largest = max(largest, float(np.nanmax(errors)))
    axes.set_xlim(0.0, 1.12 * largest or 1.0)
    axes.set_title(channel, fontsize=10)
    axes.set_xlabel("rms error / noise floor", fontsize=9)
