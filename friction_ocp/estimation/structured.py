"""The structured solver that suits a program."""

from __future__ import annotations

from friction_ocp.estimation.composite import is_composite, solve_composite
from friction_ocp.estimation.gauss_newton import USUAL, Solution, Tolerances, Watch, solve_gauss_newton
from friction_ocp.estimation.program import Point, Program


def solve_structured(
    program: Program, start: Point, tolerances: Tolerances = USUAL, watch: Watch | None = None
) -> Solution:
    """Minimise a program by Gauss-Newton, its loss kept as it is where it has a kink and no node is a variable."""
    solve = solve_composite if is_composite(program) else solve_gauss_newton
    return solve(program, start, tolerances, watch)
