"""Jacobians by elimination against those of CasADi."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from sweep_cases import DRIVES, Case

from friction_ocp.simulation.jacobian import jacobian
from friction_ocp.simulation.maps import sweep_maps

ROUNDING = 1e-12
"""Of the largest entry."""


def step_of(case: Case) -> tuple[ca.SX, ca.SX]:
    """Return what the step of a drive computes, and all that this may move with."""
    item = sweep_maps(case.model, case.active)["step"]
    active = [item.arguments[2][k] for k in case.active]
    return ca.vertcat(item.value, item.found), ca.vertcat(item.arguments[0], *active, item.torques)


def evaluated(matrices: list[ca.SX], by: ca.SX, rest: list[ca.SX], at: list[np.ndarray]) -> list[np.ndarray]:
    """Return matrices at some numbers of `by` and of the rest."""
    found = ca.Function("at", [by, *rest], [ca.densify(matrix) for matrix in matrices]).call(at)
    return [np.asarray(value) for value in found]


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("seed", range(3))
def test_it_is_the_jacobian(name: str, seed: int) -> None:
    """The order in which vertices are eliminated changes nothing but rounding."""
    case = Case(DRIVES[name]())
    value, by = step_of(case)
    rest = [symbol for symbol in ca.symvar(value) if not ca.depends_on(by, symbol)]
    rng, states = np.random.default_rng(seed), len(case.model.state_names)
    numbers = case.numbers[list(case.active)]
    torques = rng.standard_normal(by.numel() - states - numbers.size)
    at = [np.concatenate([rng.standard_normal(states), numbers, torques])]
    at += [rng.uniform(1e-4, 1e-2, 1) for _ in rest]
    found, expected = evaluated([jacobian(value, by), ca.jacobian(value, by)], by, rest, at)
    assert np.all(np.isfinite(expected))
    assert np.max(np.abs(found - expected)) <= ROUNDING * np.max(np.abs(expected))


@pytest.mark.parametrize("name", ["two masses", "lugre", "loaded joint"])
def test_it_takes_fewer_operations(name: str) -> None:
    """A map with its derivatives takes at most three quarters of what forward mode takes."""
    value, by = step_of(Case(DRIVES[name]()))
    rest = ca.vertcat(*[symbol for symbol in ca.symvar(value) if not ca.depends_on(by, symbol)])
    forward = ca.horzcat(*[ca.jtimes(value, by, ca.SX.eye(by.numel())[:, k]) for k in range(by.numel())])
    counts = [
        ca.Function("count", [by, rest], [value, matrix], {"cse": True}).n_instructions()
        for matrix in (jacobian(value, by), forward)
    ]
    assert counts[0] <= 0.75 * counts[1], counts


def test_what_a_condition_leaves_out_counts_for_nothing() -> None:
    """An infinite slope, or one that is not a number, has no part in the sum where a condition leaves it out."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    root, quotient = ca.sqrt(x), y / x
    chosen = ca.if_else(x > 0, root * y + quotient, 0) + ca.if_else(x > 1, ca.log(x) * quotient, 0)
    value = ca.vertcat(ca.sin(chosen) * chosen + y, ca.if_else(x > 2, chosen, 3 * y) * ca.exp(chosen))
    by = ca.vertcat(x, y)
    for where in ([0.0, 0.5], [-1.0, 0.5], [0.5, 0.5], [1.5, -0.3], [2.5, 0.2]):
        found, expected = evaluated([jacobian(value, by), ca.jacobian(value, by)], by, [], [np.array(where)])
        assert np.all(np.isfinite(found))
        assert np.allclose(found, expected, rtol=1e-12, atol=0.0)


def test_its_sparsity_is_that_of_the_dependence() -> None:
    """What moves with nothing, or with one argument alone, has no entries elsewhere."""
    x = ca.SX.sym("x", 3)
    value = ca.vertcat(x[0] * x[0], ca.SX(2.0), x[2], ca.sign(x[1]), x[0] + ca.floor(x[2]))
    found = jacobian(value, x)
    assert list(zip(*found.sparsity().get_triplet(), strict=True)) == [(0, 0), (4, 0), (2, 2)]
    assert jacobian(value, ca.SX(0, 1)).shape == (5, 0)
