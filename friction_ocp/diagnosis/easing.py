"""Fits that begin far from the recordings: through gaps wider than noise makes them, narrowed step by step.

Where a model lacks much, gaps as narrow as torque noise bind whole recordings together, and an iteration from afar
comes to rest at the first kink. Wide gaps let every segment follow its own stretch of the recording, and parameters
move before the gaps pull them together. Segments in which small differences grow, as at breakaway, are cut first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.footing import Footing
from friction_ocp.estimation.division import cut_where_they_grow
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.simulation.grid import FloatArray

EASY = Tolerances(decrease=1e-3, progress=1e-2, max_iterations=25)
FAR = 10.0
"""Power of residuals over that of noise from which a fit has missed something large."""
NARROWING = np.sqrt(10.0)
"""Width of gaps over that of the step after."""
MOST_DIVISIONS = 3


def missed(program: Program, point: Point) -> float:
    """Return the power of the residuals over that of noise."""
    return 2.0 * program.objective(point) / max(program.samples, 1)


def widened(program: Program, factor: float) -> Program:
    """Return a program with wider gaps."""
    cuts = [
        cut if cut.gap_weight is None else replace(cut, gap_weight=cut.gap_weight / factor) for cut in program.segments
    ]
    return replace(program, segments=tuple(cuts))


def eased(program: Program, point: Point, factor: float) -> Point:
    """Return where gaps wider by a factor lead to from a start, narrowed down to those of the program.

    The nodes settle before the parameters move: those of a start bear what the model before it lacked.
    """
    point = solve_nodes(widened(program, factor), point)
    while factor > NARROWING:
        point = solve_gauss_newton(widened(program, factor), point, EASY).point
        factor /= NARROWING
    return point


def finer(model: Model, foot: Footing, starts: Sequence[FloatArray], factor: float) -> tuple[Footing, Point]:
    """Return the footing with segments cut where differences grow along the recordings, and where wide gaps lead there.

    From the start, one of some parameters along the measured motion, that gaps wider by a factor lead to the best end.
    """
    program = widened(foot.training(model), factor)
    points = [suggested_point(program, theta) for theta in starts]
    point = min((solve_gauss_newton(program, start, EASY) for start in points), key=lambda end: end.objective).point
    for _ in range(MOST_DIVISIONS):
        cut = _cut_again(foot, program, point)
        after = widened(cut.training(model), factor)
        if all(new.count == old.count for new, old in zip(after.segments, program.segments, strict=True)):
            break
        point = solve_gauss_newton(after, along(after, program, point), EASY).point
        foot, program = cut, after
    return foot, point


def along(program: Program, other: Program, point: Point) -> Point:
    """Return a point of another program with further nodes on its simulation; its own nodes stay."""
    passed = program.point_along(other, point)
    for nodes, old, cut, before in zip(passed.nodes, point.nodes, program.segments, other.segments, strict=True):
        at = np.searchsorted(cut.first, before.first[:-1])
        same = cut.first[at] == before.first[:-1]
        nodes[at[same], : old.shape[1]] = old[same]
    return passed


def _cut_again(foot: Footing, program: Program, point: Point) -> Footing:
    """Return the footing with further cuts at the times at which differences have grown."""
    found = {name: list(times) for name, times in foot.divided.items()}
    for index, (item, cut) in enumerate(zip(program.experiments, program.segments, strict=True)):
        passed = program.simulate(index, point, derivatives=True)
        assert passed.dend is not None
        first = cut_where_they_grow(cut.first, passed.dend[:, :, : point.nodes[index].shape[1]])
        further = np.setdiff1d(first, cut.first)
        found.setdefault(item.name, []).extend(map(float, item.grid.time[further]))
    return replace(foot, divided={name: tuple(sorted(times)) for name, times in found.items()})
