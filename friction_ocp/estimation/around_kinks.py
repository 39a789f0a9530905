"""The way around the ends that the kinks of exact friction make: through a smoothed sign, and back."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point, Program

WIDTHS = (0.02, 0.004, 0.0008, 0.00016)
"""Smoothing of the sign over the typical speed on the way, and back step by step: in one step, nodes that wide
smoothing has moved are caught at kinks that are not theirs."""
ON_THE_WAY = Tolerances(decrease=1e-3, progress=1e-2, max_iterations=12)


def around_kinks(model: Model, program: Program, point: Point, limits: Tolerances) -> Solution:
    """Solve again from where friction with a smoothed sign leads to, less and less of it."""
    for width in WIDTHS:
        point = solve_gauss_newton(smoothed(model, program, width), point, ON_THE_WAY).point
    return solve_gauss_newton(program, point, limits)


def smoothed(model: Model, program: Program, width: float = WIDTHS[0]) -> Program:
    """Return a program whose friction has a smoothed sign, `width` over the typical speed."""
    return replace(program, width=width * model.speed_scale)
