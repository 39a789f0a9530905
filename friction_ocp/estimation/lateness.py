"""Samples of late channels, read at the nodes where what they show was true: delays of whole samples are exact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.estimation.experiment import COLUMNS, Experiment
from friction_ocp.simulation.grid import FloatArray

UNEVEN = 0.05
"""Share of the interval between nodes by which they may stray from evenly spaced ones."""
NEAR = 0.55
"""Intervals of delay that are left to the model: half of one, and so much that an estimate does not go to and fro."""


def lateness(item: Experiment, delays: Mapping[str, float], undone: Mapping[str, float]) -> dict[str, float]:
    """Return by channel the part of its delay, s, that reading samples earlier undoes: whole intervals between nodes.

    What is undone already stays where little is left. Nodes that are not evenly spaced leave all to the model.
    """
    interval = _interval(item.grid.time)
    found: dict[str, float] = {}
    for name, delay in delays.items():
        known = undone.get(name, 0.0)
        if abs(delay - known) > NEAR * interval:
            known = round(delay / interval) * interval
        if known and _fits(item.grid.time, known, interval):
            found[name] = known
    return found


def read_earlier(item: Experiment, names: Sequence[str], late: Mapping[str, float]) -> Experiment:
    """Return a recording with the samples of channels that were read `late`, s, at earlier nodes.

    `names` are those of the outputs. Samples that come to lie outside are lost.
    """
    time = item.grid.time
    interval = _interval(time)
    steps = [round((late.get(name, 0.0) - item.late.get(name, 0.0)) / interval) for name in names]
    if not any(steps):
        return item
    columns = {key: getattr(item, key).copy() for key in COLUMNS}
    for k, step in enumerate(steps):
        beyond = -1 if step > 0 else 0
        for key in ("smooth", "rate", "curvature"):
            columns[key][:, k] = _shifted(columns[key][:, k], step, columns[key][beyond, k])
        columns["measured"][:, k] = _shifted(columns["measured"][:, k], step, np.nan)
        columns["repeated"][:, k] = _shifted(columns["repeated"][:, k], step, False)
    had = np.isfinite(item.measured) | item.lost
    columns["lost"] = np.where(np.array(steps) != 0, had & ~np.isfinite(columns["measured"]), item.lost)
    columns["repeated"] = np.where(columns["lost"], item.repeated, columns["repeated"])
    return replace(item, **columns, late={name: value for name, value in late.items() if name in names})


def _interval(time: FloatArray) -> float:
    return float(np.median(np.diff(time))) if time.size > 1 else np.inf


def _fits(time: FloatArray, seconds: float, interval: float) -> bool:
    """Whether nodes that far apart are the same number of nodes apart everywhere."""
    step = abs(round(seconds / interval))
    if step >= time.size:
        return False
    return bool(np.all(np.abs(time[step:] - time[: time.size - step] - step * interval) <= UNEVEN * interval))


def _shifted(column: FloatArray, step: int, beyond: float) -> FloatArray:
    """Return a column whose row i is row i + step of another; `beyond` where that has none."""
    found = np.full_like(column, beyond)
    kept = column.size - abs(step)
    found[max(-step, 0) :][:kept] = column[max(step, 0) :][:kept]
    return found
