"""Every figure of an identification as PNG and SVG."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from friction_ocp.plots.bootstrap import bootstrap_figure
from friction_ocp.plots.coherence import coherence_figure
from friction_ocp.plots.comparison import comparison_figure
from friction_ocp.plots.correlation import correlation_figure
from friction_ocp.plots.curves import friction_figures
from friction_ocp.plots.overview import overview_figure
from friction_ocp.plots.points import points_figure
from friction_ocp.plots.profiles import profiles_figure
from friction_ocp.plots.reading import objects, part, rows
from friction_ocp.plots.series import Series
from friction_ocp.plots.style import Figure, figure_style, save
from friction_ocp.plots.traces import traces_figure
from friction_ocp.plots.waterfall import waterfall_figure
from friction_ocp.plots.whiteness import whiteness_figure


def write_figures(result: Mapping[str, Any], series: Series, folder: Path) -> list[Path]:
    """Draw all figures of a result into `folder`, which is made if need be, and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths: list[Path] = []
    taken: set[str] = set()
    with figure_style():
        for name, figure in _figures(result, series):
            paths += save(figure, folder / file_stem(name, taken))
    return paths


def _figures(result: Mapping[str, Any], series: Series) -> Iterator[tuple[str, Figure]]:
    """Yield the name and figure of whatever the result has, one at a time to hold few in memory."""
    yield from statistic_figures(result)
    if part(result, "parameters"):
        yield "parameters", overview_figure(objects(result, "parameters"))
    yield from (
        (f"traces-{recording}", traces_figure(recording, channels, part(result, "channel_units")))
        for recording, channels in series.items()
        if channels
    )
    static = objects(part(result, "fit"), "static")
    yield from ((f"points-{name}", points_figure(name, points)) for name, points in static.items())
    yield from ((f"friction-{shaft}", figure) for shaft, figure in friction_figures(rows(result, "friction_curves")))
    if any(objects(result, "residuals").values()):
        yield "residual-autocorrelation", whiteness_figure(objects(result, "residuals"))
    coherences = {name: objects(part(result, "coherence"), name) for name in part(result, "coherence")}
    if any(coherences.values()):
        yield "coherence", coherence_figure({name: found for name, found in coherences.items() if found})
    if rows(part(result, "correlation"), "names"):
        yield "correlation", correlation_figure(part(result, "correlation"))


def statistic_figures(result: Mapping[str, Any]) -> Iterator[tuple[str, Figure]]:
    """Yield the figure of the statistic that a result holds, if any."""
    if part(result, "multistart"):
        yield "waterfall", waterfall_figure(part(result, "multistart"), objects(result, "parameters"))
    if part(result, "profile"):
        yield "profiles", profiles_figure(part(result, "profile"))
    if part(result, "bootstrap"):
        yield "bootstrap", bootstrap_figure(part(result, "bootstrap"))
    if part(result, "compare"):
        yield "comparison", comparison_figure(part(result, "compare"))


def file_stem(name: str, taken: set[str]) -> str:
    """Return a file name that no recording name can lead out of the folder or onto another figure."""
    stem = re.sub(r"[^\w.-]+|\.{2,}", "_", name.removesuffix(".h5"), flags=re.ASCII)[:100]
    unique = stem
    count = 1
    while unique.lower() in taken:
        count += 1
        unique = f"{stem}-{count}"
    taken.add(unique.lower())
    return unique
