"""The better stretches of two sets of nodes, and nodes that stick where they should slide."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.fitting import FittedModel, fit_base
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.splicing import spliced
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
