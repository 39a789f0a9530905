"""Figures of results with matplotlib, which is imported only when one is drawn."""

from friction_ocp.plots.figures import write_figures

__all__ = ["write_figures"]
