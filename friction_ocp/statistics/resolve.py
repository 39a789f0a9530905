"""Solve a program again from nearby."""

from __future__ import annotations

from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.rounds import final_solver, limits


def resolve(model: Model, program: Program, start: Point) -> Solution:
    """Solve with the solver and the iteration limit of a problem."""
    return final_solver(model)(program, start, limits(model), _unwatched)


def _unwatched(iteration: int, objective: float, point: Point) -> None:
    """Hear nothing of the steps."""
