"""The better stretches of two sets of nodes, and nodes that stick where they should slide."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.rough_bowl import unstuck
from friction_ocp.estimation.splicing import carried_on, spliced
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.grid import FloatArray

SHIFT = 0.05
"""rad by which nodes are moved."""


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> FittedModel:
    """Return the base model of a drive that lacks nothing, fitted."""
    return fit_base(prepare(load_problem(write_case(tmp_path_factory.mktemp("axis"), axis()))))


def moved(nodes: FloatArray, begin: int, stop: int) -> FloatArray:
    """Return nodes with a stretch of angles moved."""
    changed = nodes.copy()
    changed[begin:stop, 0] += SHIFT
    return changed


def test_each_stretch_comes_from_where_it_costs_less(fitted: FittedModel) -> None:
    """Of two points that are each wrong somewhere else, the one that is right everywhere is made."""
    program, point = fitted.linear.program, fitted.linear.point
    one = Point(point.theta, tuple(moved(nodes, 5, 8) for nodes in point.nodes))
    other = Point(point.theta, tuple(moved(nodes, 20, 26) for nodes in point.nodes))
    assert min(program.objective(one), program.objective(other)) > 1.1 * program.objective(point)
    for made in (spliced(program, one, other), spliced(program, other, one)):
        for nodes, right in zip(made.nodes, point.nodes, strict=True):
            np.testing.assert_array_equal(nodes, right)


def test_nothing_is_taken_that_costs_more(fitted: FittedModel) -> None:
    """The best point stays what it is."""
    program, point = fitted.linear.program, fitted.linear.point
    worse = Point(point.theta, tuple(moved(nodes, 5, 30) for nodes in point.nodes))
    for nodes, right in zip(spliced(program, point, worse).nodes, point.nodes, strict=True):
        np.testing.assert_array_equal(nodes, right)


def test_a_node_that_is_off_is_carried_on_from_the_segment_before(fitted: FittedModel) -> None:
    """Where one node is wrong, the segment before it ends where it should be."""
    program, point = fitted.linear.program, fitted.linear.point
    wrong = Point(point.theta, tuple(moved(nodes, 9, 10) for nodes in point.nodes))
    best, bad, mended = map(program.objective, (point, wrong, carried_on(program, wrong)))
    assert mended < best + 0.01 * (bad - best)
    assert program.objective(carried_on(program, point)) <= best


def test_nodes_come_back_from_a_shaft_that_slides_where_it_stuck(fitted: FittedModel) -> None:
    """From speeds that are wrong everywhere the nodes of the fit, or as good ones, are found again."""
    program, point = fitted.linear.program, fitted.linear.point
    astray = Point(point.theta, tuple(nodes + np.array([0.0, 0.3]) for nodes in point.nodes))
    found = unstuck(fitted.model, program, astray)
    assert program.objective(astray) > 2.0 * program.objective(point)
    assert program.objective(found) < program.objective(point) + UNIMPORTANT
