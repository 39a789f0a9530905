"""Logarithmic axes have plain numbers, whatever they span."""

from __future__ import annotations

import pytest

from friction_ocp.plots.style import axes_grid, figure_style, new_figure, plain_log_ticks, svg_text


@pytest.mark.parametrize(("low", "high", "expected"), [(0.9, 7.0, ["1", "2", "5"]), (1.5, 4.0e4, ["10", "10000"])])
def test_a_logarithmic_axis_is_labelled_with_plain_numbers(low: float, high: float, expected: list[str]) -> None:
    """Within a decade, too, where no power of ten but the first is in sight; text is never mathematics."""
    with figure_style():
        figure = new_figure(2.0)
        axes = axes_grid(figure, 1)[0][0]
        axes.set_xscale("log")
        axes.set_xlim(low, high)
        plain_log_ticks(axes.xaxis)
        text = svg_text(figure)
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert set(expected) <= set(labels)
    assert not any(label.get_text() for label in axes.get_xticklabels(minor=True))
    assert "mathdefault" not in text
