"""Figures of a diagnosis: where the gap is, what competes, traces before and after."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from friction_ocp.plots.numbers import unit_text
from friction_ocp.plots.palette import GRID, MEASURED, MUTED, RESIDUAL, SIMULATED
from friction_ocp.plots.reading import Json, part, rows
from friction_ocp.plots.series import Series
from friction_ocp.plots.style import Figure, axes_grid, headline, new_figure, plain_log_ticks

SHOWN = 8
"""Candidates in the ranking."""
AROUND_NOISE = 2.0
"""Factor about the noise floor that is in sight at least: chance makes regimes differ by a few percent."""
GAINS = (
    ("predicted_gain", "predicted", GRID),
    ("refit_gain", "refitted", SIMULATED),
    ("heldout_gain", "held out", MEASURED),
)


def diagnosis_figures(result: Json, before: Series, after: Series) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of whatever the diagnosis has."""
    cells, changed = rows(part(result, "where"), "map"), bool(rows(result, "accepted"))
    if cells:
        yield "gap-map", gap_map_figure(cells, changed)
    found = part(result, "where").get("shape")
    if found:
        yield "shape", shape_figure(found, part(result, "where"))
    joint = part(result, "where").get("joint")
    if joint:
        yield "joint", joint_figure(joint)
    for k, item in enumerate(rows(result, "rounds")):
        causes = [cause for cause in rows(item, "causes") if cause.get("refit_gain") is not None][:SHOWN]
        if causes:
            yield f"ranking-{k + 1}", ranking_figure(k + 1, causes)
    units = part(result, "channel_units")
    for recording, channels in before.items():
        if channels:
            shown = after[recording] if changed else None
            yield f"before-after-{recording}", before_after_figure(recording, channels, shown, units)


def gap_map_figure(cells: Sequence[Json], changed: bool) -> Figure:
    """Draw rms errors over the noise floor by channel and regime, before and, where anything was added, after."""
    labels = list(dict.fromkeys((str(cell["channel"]), str(cell["regime"])) for cell in cells))
    figure = new_figure(1.2 + 0.32 * len(labels))
    axes = axes_grid(figure, 1)[0][0]
    bars = (("before", RESIDUAL, -0.19), ("after", MEASURED, 0.19)) if changed else (("before", RESIDUAL, 0.0),)
    for key, colour, shift in bars:
        sizes = [_rms([float(cell[key]) for cell in cells if (cell["channel"], cell["regime"]) == at]) for at in labels]
        axes.barh(np.arange(len(labels)) + shift, np.maximum(sizes, 1e-3), height=0.36, color=colour, label=key)
    names = [f"{channel}: {regime.replace('_', ' ')}" for channel, regime in labels]
    axes.set_yticks(np.arange(len(labels)), names)
    axes.axvline(1.0, color=MUTED, linewidth=1.0)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 1.0 / AROUND_NOISE), max(high, AROUND_NOISE))
    plain_log_ticks(axes.xaxis)
    axes.set_xlabel("rms error of the free run over the noise floor (line: the floor)")
    headline(figure, "Where the gap is" if changed else "Where the free run is off")
    if changed:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    axes.invert_yaxis()
    return figure


def shape_figure(found: Json, where: Json) -> Figure:
    """Draw the missing torque over the variable that explains most of it, its band and what additions take of it."""
    figure = new_figure(3.6)
    axes = axes_grid(figure, 1)[0][0]
    at = np.asarray(found["at"], dtype=float)
    axes.fill_between(at, found["lower"], found["upper"], color=GRID, label="95 % band of the mean")
    axes.plot(at, found["torque"], color=MEASURED, marker="o", markersize=3.5, label="missing torque")
    if found.get("taken"):
        axes.plot(at, found["taken"], color=SIMULATED, linewidth=1.6, label="taken by what was added")
    axes.axhline(0.0, color=MUTED, linewidth=1.0)
    over, unit = part(where, "depends_on"), unit_text(str(found.get("variable_unit", "")))
    name = str(found["variable"])
    if over.get("period") is not None:
        name += f" within {float(over['period']):.4g} {unit}".rstrip()
    axes.set_title(
        f"What the model lacks at {found['component']}: {name} explains {100 * float(over['share']):.0f} % of it"
    )
    axes.set_xlabel(f"{found['variable']} in {unit}" if unit else str(found["variable"]))
    axes.set_ylabel(f"missing torque in {unit_text(str(found.get('unit', 'SI units')))}")
    axes.legend(loc="best")
    return figure


def joint_figure(found: Json) -> Figure:
    """Draw the torque that a joint carries over its twist: as the motion needs it, and as the model has it."""
    figure = new_figure(3.6)
    axes = axes_grid(figure, 1)[0][0]
    at = np.asarray(found["at"], dtype=float)
    axes.fill_between(at, found["lower"], found["upper"], color=GRID, label="95 % band of the mean")
    axes.plot(
        at, found["needed"], color=MEASURED, marker="o", markersize=3.5, linewidth=0.0, label="as the motion needs it"
    )
    if found.get("before"):
        axes.plot(at, found["before"], color=RESIDUAL, linewidth=1.6, label="model before")
    axes.plot(at, found["after"], color=SIMULATED, linewidth=1.6, label="with what was added")
    axes.axhline(0.0, color=MUTED, linewidth=1.0)
    axes.set_title(f"What {found['component']} carries over its twist")
    axes.set_xlabel(f"twist on the output side in {unit_text(str(found['twist_unit']))}")
    axes.set_ylabel(f"torque in {unit_text(str(found['unit']))}")
    axes.legend(loc="best")
    return figure


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else 0.0


def ranking_figure(number: int, causes: Sequence[Json]) -> Figure:
    """Draw the three gains of the best candidates of a round."""
    figure = new_figure(1.3 + 0.5 * len(causes))
    axes = axes_grid(figure, 1)[0][0]
    places = np.arange(len(causes))
    for k, (key, label, colour) in enumerate(GAINS):
        gains = [100.0 * float(cause.get(key) or 0.0) for cause in causes]
        axes.barh(places + 0.26 * (k - 1), gains, height=0.24, color=colour, label=label)
    names = [f"{str(cause['effect']).replace('_', ' ')} at {cause['component']}" for cause in causes]
    axes.set_yticks(places, names)
    axes.set_xlabel("share of the excess error that the candidate takes away, in %")
    headline(figure, f"What competes, round {number}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    axes.axvline(0.0, color=MUTED, linewidth=1.0)
    axes.invert_yaxis()
    return figure


def before_after_figure(
    recording: str, before: Mapping[str, Any], after: Mapping[str, Any] | None, units: Mapping[str, str]
) -> Figure:
    """Draw the residuals of every channel before and, where there are any, after the additions."""
    figure = new_figure(0.6 + 2.2 * len(before))
    headline(figure, f"{recording}: residuals of the free run")
    grid = axes_grid(figure, len(before), sharex=True)
    for axes, (name, channel) in zip((row[0] for row in grid), before.items(), strict=True):
        curves = [("before", channel, RESIDUAL)] + ([("after", after[name], MEASURED)] if after is not None else [])
        for label, content, colour in curves:
            residual = np.asarray(content["measured"]) - np.asarray(content["simulated"])
            axes.plot(content["time"], residual, color=colour, linewidth=0.9, label=label)
        axes.set_title(name)
        axes.set_ylabel(f"residual in {unit_text(units.get(name, ''))}")
        if after is not None:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    grid[-1][0].set_xlabel("time in s")
    return figure
