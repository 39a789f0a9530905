"""One look for all figures, and the only place that imports matplotlib while the program runs."""

from __future__ import annotations

import io
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias, cast

from friction_ocp.plots.palette import GRID, INK, MUTED
from friction_ocp.whole_file import whole_file

# matplotlib types few of its keywords, so its objects stay untyped here.
Axes: TypeAlias = Any
Figure: TypeAlias = Any

WIDTH = 8.0
"""Inches."""
FEW_DECADES = 300.0
"""Ratio of the ends of a logarithmic axis below which decades alone are too few labels."""

_RC: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 10,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.xmargin": 0.01,
    "figure.constrained_layout.h_pad": 0.06,
    "figure.dpi": 150,
    "figure.facecolor": "white",
    "font.family": ["DejaVu Sans"],
    "font.size": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "path.simplify": False,
    "svg.hashsalt": "friction-ocp",
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 9.5,
    "ytick.color": MUTED,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 9.5,
}


@contextmanager
def figure_style() -> Generator[None]:
    """Apply the look within; text is taken literally, and glyphs that the font lacks pass in silence."""
    import matplotlib

    rc_context = cast("Any", matplotlib).rc_context
    with rc_context(_RC), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure of this size in inches, without pyplot and its global state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def axes_grid(figure: Figure, rows: int, columns: int = 1, **options: Any) -> list[list[Axes]]:
    """Return axes by row and column; `options` go to `Figure.subplots`."""
    grid = figure.subplots(rows, columns, squeeze=False, **options)
    return [list(row) for row in grid]


def headline(figure: Figure, text: str) -> None:
    """Write what a figure shows above all of it, at its left edge."""
    figure.suptitle(text, x=0.01, ha="left", fontweight="bold", fontsize=12)


def plain_log_ticks(axis: Any) -> None:
    """Label a logarithmic axis, its limits set, with plain numbers: decades, and 2 and 5 where those are few."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    few = high < FEW_DECADES * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure as PNG and SVG, each whole or not at all, without a date: equal results give equal files."""
    _lay_out(figure)
    paths: list[Path] = []
    for ending, metadata in (("png", {"Software": None}), ("svg", {"Date": None})):
        path = stem.with_name(f"{stem.name}.{ending}")
        with whole_file(path) as staged:
            figure.savefig(staged, format=ending, metadata=metadata)
        paths.append(path)
    return paths


def svg_text(figure: Figure) -> str:
    """Return a figure as an SVG document, the same for equal figures."""
    _lay_out(figure)
    written = io.StringIO()
    figure.savefig(written, format="svg", metadata={"Date": None})
    return written.getvalue()


def _lay_out(figure: Figure) -> None:
    """Place the axes of a figure for good: matplotlib would do it again, and draw all of it for that, in every file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    engine = figure.get_layout_engine()
    if engine is not None and figure.axes:
        engine.execute(figure)
    figure.set_layout_engine(None)
