"""Recordings let into a fit one after another, those that are nearly explained first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_ocp.estimation.division import cut_at, divided, is_divided
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.first_nodes import suggested_nodes, suggested_point
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.horizon import is_relaxed
from friction_ocp.estimation.model import Model, laid_for
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases
from friction_ocp.estimation.stages import is_noise, relaxed
from friction_ocp.simulation.grid import FloatArray, IntArray
from friction_ocp.simulation.losses import Squares

ENTRANCE = Tolerances(max_iterations=25)
"""Of a fit that one more recording has just come into."""
BOLD = replace(ENTRANCE, first_damping=1e-6)
"""Of a fit that begins anew at the end of another."""
RENEWALS, WORTHWHILE = 10, 1e-4
"""How often the fit of all begins anew, and what share of the objective that has to gain."""


def may_enter_in_turn(model: Model) -> bool:
    """Whether recordings can come in one by one: there are several, and every parameter is shared by them."""
    return len(model.train) > 1 and not any("@" in name for name in model.space.names)


def enter_in_turn(model: Model) -> bool:
    """Whether recordings come in one by one: where they may, and static points are there to begin with."""
    return bool(model.static) and may_enter_in_turn(model)


def may_be_cut(model: Model, program: Program) -> bool:
    """Whether segments are relaxed, and cut where differences grow: where they have been, or would have been."""
    return is_relaxed(model) and (is_divided(model, program) or enter_in_turn(model))


def introduced(model: Model, phases: Phases) -> tuple[Solution, Program]:
    """Fit relaxed segments of all recordings, let in one after another; static points take part from the first.

    The next one is that whose short segments along the measured motion the parameters so far explain best: small
    motion near rest comes before large motion that only right parameters follow. It starts along its measured motion,
    the others where they were. It has to wait until those before it are explained as well as they can be: parameters
    that are wrong for them would be led astray by it.
    """
    theta, left = model.space.guess, list(model.train)
    taken, nodes, firsts = tuple[Experiment, ...](), tuple[FloatArray, ...](), tuple[IntArray, ...]()
    while True:
        model = laid_for(model, dict(zip(model.space.names, theta, strict=True)))
        left.sort(key=lambda item: _mismatch(model, item, theta), reverse=True)
        taken = (*taken, left.pop())
        program = relaxed(model, taken, 0.0, Squares())
        program = cut_at(model, program, [*firsts, program.segments[-1].first])
        watch = phases.begin(f"{len(taken)} of {len(model.train)} recordings")
        start = Point(theta, (*nodes, *suggested_nodes(program, theta)[len(nodes) :]))
        end = solve_gauss_newton(program, start, ENTRANCE, watch)
        if not left or not is_noise(program, end):
            end, program = _renewed(model, program, end, phases)
        if not left:
            return _in_order(end, program, model)
        theta, nodes = end.point.theta, end.point.nodes
        firsts = tuple(cut.first for cut in program.segments)


def _renewed(model: Model, program: Program, end: Solution, phases: Phases) -> tuple[Solution, Program]:
    """Begin anew where a few segments made the damping grow, which holds back all others.

    Segments in which differences grow are cut, and first steps are bold: kinks of the friction stop small ones.
    """
    for k in range(RENEWALS):
        if end.converged and end.smooth:
            break
        program, start = divided(model, program, end.point)
        after = solve_gauss_newton(program, start, BOLD, phases.begin(f"renewal {k + 1}"))
        after = replace(after, iterations=end.iterations + after.iterations)
        gained, end = program.objective(start) - after.objective, after
        if end.converged and gained <= WORTHWHILE * end.objective:
            break
    return end, program


def _mismatch(model: Model, item: Experiment, theta: FloatArray) -> float:
    """Return the cost of a recording over its samples where every segment starts along the measured motion."""
    program = replace(relaxed(model, (item,), 0.0, Squares()), static=())
    cost = program.objective(suggested_point(program, theta))
    return cost / max(int(np.isfinite(item.measured).sum()), 1)


def _in_order(end: Solution, program: Program, model: Model) -> tuple[Solution, Program]:
    """Return the fit with its recordings in the order of the problem."""
    order = [next(k for k, other in enumerate(program.experiments) if other is item) for item in model.train]
    nodes = tuple(end.point.nodes[k] for k in order)
    placed = replace(
        program,
        experiments=tuple(program.experiments[k] for k in order),
        segments=tuple(program.segments[k] for k in order),
    )
    return replace(end, point=Point(end.point.theta, nodes)), placed
