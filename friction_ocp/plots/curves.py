"""Friction torque over speed with its confidence band, one figure a shaft."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from friction_ocp.plots.numbers import plain, unit_text
from friction_ocp.plots.palette import MUTED, colour
from friction_ocp.plots.series import FloatArray
from friction_ocp.plots.style import Axes, Figure, axes_grid, new_figure

Curve = Mapping[str, Any]
_LABEL_SPACING = 0.055  # of the height of the axes


def friction_figures(curves: Sequence[Curve]) -> Iterator[tuple[str, Figure]]:
    """Yield each shaft's name and figure."""
    for shaft in dict.fromkeys(str(curve["shaft"]) for curve in curves):
        yield shaft, _figure(shaft, [curve for curve in curves if str(curve["shaft"]) == shaft])


def curve_label(curve: Curve, others: Sequence[Curve]) -> str:
    """Return what tells a curve from the others of its shaft: its law, its load or both."""
    law = str(curve.get("law", ""))
    parts = [law] if law and len({other.get("law") for other in others}) > 1 else []
    if curve.get("load") or len({other.get("load") for other in others}) > 1:
        parts.append(f"load {plain(curve.get('load'))} {unit_text(str(curve.get('load_unit', '')))}".rstrip())
    return ", ".join(parts) or "fitted"


def _figure(shaft: str, curves: Sequence[Curve]) -> Figure:
    figure = new_figure(4.4)
    axes = axes_grid(figure, 1)[0][0]
    ends: list[tuple[float, float, str, str]] = []
    for index, curve in enumerate(curves):
        speed, torque, lower, upper = (_array(curve.get(key)) for key in ("speed", "torque", "lower", "upper"))
        if len(lower) == len(speed) == len(upper):
            axes.fill_between(speed, lower, upper, color=colour(index), alpha=0.18, linewidth=0)
        axes.plot(speed, torque, color=colour(index), linewidth=1.8)
        if len(speed) and len(curves) > 1:
            ends.append((float(speed[-1]), float(torque[-1]), curve_label(curve, curves), colour(index)))
    axes.axhline(0.0, color=MUTED, linewidth=0.8)
    axes.axvline(0.0, color=MUTED, linewidth=0.8)
    laws = ", ".join(dict.fromkeys(str(curve.get("law", "")) for curve in curves))
    axes.set_title(f"Friction of {shaft} ({laws}), 95 % band")
    axes.set_xlabel(f"speed in {unit_text(str(curves[0].get('speed_unit', '')))}")
    axes.set_ylabel(f"friction torque in {unit_text(str(curves[0].get('torque_unit', '')))}")
    _label_ends(axes, ends)
    return figure


def _label_ends(axes: Axes, ends: Sequence[tuple[float, float, str, str]]) -> None:
    """Write each curve's name at its right end, pushed up where two would touch."""
    bottom, top = axes.get_ylim()
    previous = -np.inf
    for speed, torque, label, colour_ in sorted(ends, key=lambda end: end[1]):
        height = max(torque, previous + _LABEL_SPACING * (top - bottom))
        previous = height
        axes.annotate(
            label,
            (speed, height),
            xytext=(8, 0),
            textcoords="offset points",
            va="center",
            color=colour_,
            annotation_clip=False,
        )


def _array(values: Sequence[float | None] | None) -> FloatArray:
    return np.array([np.nan if value is None else value for value in values or ()], dtype=np.float64)
