"""Gaps that follow the parameters, where noise of measured inputs joins segments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import COULOMB, INERTIA, VISCOUS, axis, measured_axis, problem

from friction_ocp.estimation.division import reweighed
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gap import following
from friction_ocp.estimation.model import Model, laid_for, prepare_fit
from friction_ocp.estimation.preparation import joined_by_input_noise
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.rounds import joined
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares


@pytest.fixture(scope="module")
def model() -> Model:
    """An axis whose segments noise of its torque joins, laid for a heavier rotor than guessed."""
    law = CoulombViscous(Free(COULOMB, 0.0, 1.0), Free(VISCOUS, 0.0, 0.1))
    inertia = Free(INERTIA, 0.05 * INERTIA, 20.0 * INERTIA)
    plain = prepare_fit(problem(axis(law, inertia=inertia), measured_axis(5), fit="relaxed"))
    found = dict(zip(plain.space.names, map(float, 1.3 * plain.space.guess), strict=True))
    return laid_for(joined_by_input_noise(plain), found)


@pytest.fixture(scope="module")
def program(model: Model) -> Program:
    """Its segments, with a hardly smoothed sign: all is differentiable."""
    return following(model, joined(model, 0.05, Squares()))


def test_gaps_are_those_of_other_parameters(model: Model, program: Program) -> None:
    """To first order: a per cent away the weights are those that are laid there, to a share of what that changed."""
    for k, name in enumerate(model.space.names):
        theta = model.nominal.copy()
        theta[k] *= 1.01
        there = laid_for(model, dict(zip(model.space.names, map(float, theta), strict=True)))
        wanted = reweighed(replace(there, state_scale=model.state_scale), program).segments[0].gap_weight
        before, found = program.segments[0].gap_weight, program.segments[0].weights(theta)
        assert wanted is not None and before is not None
        moved = float(np.max(np.abs(wanted - before)))
        assert np.max(np.abs(found - wanted)) <= 0.05 * moved + 1e-9 * float(np.max(np.abs(before))), name
    assert _moved(program, model, 0) > 0.005


def _moved(program: Program, model: Model, k: int) -> float:
    """Return by what share the weights change where a parameter grows by a per cent."""
    theta = model.nominal.copy()
    theta[k] *= 1.01
    before = program.segments[0].weights(model.nominal)
    return float(np.max(np.abs(program.segments[0].weights(theta) - before)) / np.max(np.abs(before)))


def test_the_gradient_is_that_of_the_objective(model: Model, program: Program) -> None:
    """By the parameters and by the nodes, away from where the gaps are laid."""
    rng = np.random.default_rng(2)
    theta = 1.05 * model.nominal
    start = suggested_point(program, theta)
    nodes = tuple(own + 1e-3 * model.state_scale * rng.standard_normal(own.shape) for own in start.nodes)
    point = Point(theta, nodes)
    system = program.linearise(point)
    assert system.objective == pytest.approx(program.objective(point))
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-5 * theta[k]
        assert system.theta_gradient[k] == pytest.approx(_slope(program, point, step, 0.0), rel=1e-3)
    way = rng.standard_normal(nodes[0].shape) * model.state_scale
    along = float(np.sum(way * system.blocks[0].node_gradient))
    assert along == pytest.approx(_slope(program, point, np.zeros(theta.size), 1e-6 * way) / 1e-6, rel=1e-3)


def _slope(program: Program, point: Point, step: FloatArray, moved: FloatArray | float) -> float:
    """Return the central difference of the objective: over the parameter that moves, or whole where nodes move."""
    nodes = [point.nodes[0] + side * moved for side in (-1.0, 1.0)]
    less, more = (
        program.objective(Point(point.theta + side * step, (own, *point.nodes[1:])))
        for side, own in zip((-1.0, 1.0), nodes, strict=True)
    )
    return (more - less) / (2.0 * (float(np.sum(step)) or 1.0))


def test_other_gaps_stay(model: Model, program: Program) -> None:
    """Those that are joined by no noise of inputs, and those of which every sample tells the noise."""
    for other in (replace(model, joins_noise=False), replace(model, tells_noise=True)):
        assert following(other, program) is program
