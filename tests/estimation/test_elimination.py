"""Block elimination against the dense system."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from friction_ocp.estimation.elimination import _solve, reduce_system
from friction_ocp.estimation.program import Blocks, Linearisation

ROUNDING = 1e-7
"""Of two factorisations of a matrix with condition number below 1e8, and 1e-14 added to the diagonal."""


def random_system(
    rng: np.random.Generator, segments: list[int], states: int, count: int
) -> tuple[Linearisation, np.ndarray, np.ndarray]:
    """Return random Gauss-Newton blocks of several recordings and the same system dense, parameters first."""
    sizes = [states * number for number in segments]
    total = count + sum(sizes)
    hessian, gradient = np.zeros((total, total)), np.zeros(total)
    blocks: list[Blocks] = []
    start = count
    for number in segments:
        for j in range(number):
            columns = [*range(count), *range(start + j * states, start + min(j + 2, number) * states)]
            jacobian = rng.standard_normal((2 * states + 1, len(columns)))
            hessian[np.ix_(columns, columns)] += jacobian.T @ jacobian
            gradient[columns] += jacobian.T @ rng.standard_normal(len(jacobian))
        rows = [slice(start + j * states, start + (j + 1) * states) for j in range(number)]
        blocks.append(
            Blocks(
                node_node=np.array([hessian[row, row] for row in rows]),
                node_next=np.array([hessian[a, b] for a, b in pairwise(rows)]).reshape(-1, states, states),
                node_theta=np.array([hessian[row, :count] for row in rows]),
                node_gradient=np.array([gradient[row] for row in rows]),
            )
        )
        start += number * states
    system = Linearisation(1.0, hessian[:count, :count].copy(), gradient[:count].copy(), tuple(blocks))
    return system, hessian, gradient


@settings(deadline=None, max_examples=50)
@given(
    st.integers(0, 10**6),
    st.lists(st.integers(1, 13), min_size=1, max_size=3),
    st.integers(1, 3),
    st.integers(1, 4),
    st.sampled_from([0.0, 1e-3, 1.0]),
)
def test_elimination_solves_the_dense_system(
    seed: int, segments: list[int], states: int, count: int, damping: float
) -> None:
    """Parameter and node steps are those of the whole damped system."""
    system, hessian, gradient = random_system(np.random.default_rng(seed), segments, states, count)
    damped = hessian + damping * np.diag(np.diag(hessian))
    if np.linalg.cond(damped) > 1e8:
        return
    expected = -np.linalg.solve(damped, gradient)
    reduced = reduce_system(system, damping)
    step = -np.linalg.solve(reduced.hessian, reduced.gradient)
    found = np.concatenate([step, *(nodes.ravel() for nodes in reduced.node_steps(step))])
    assert found == pytest.approx(expected, rel=0, abs=ROUNDING * np.max(np.abs(expected)))


def test_reduced_hessian_is_the_schur_complement() -> None:
    """Without damping the reduced Hessian is the inverse of the parameters' block of the inverse."""
    system, hessian, _ = random_system(np.random.default_rng(7), [4, 3], 2, 3)
    expected = np.linalg.inv(np.linalg.inv(hessian)[:3, :3])
    np.testing.assert_allclose(reduce_system(system, 0.0).hessian, expected, rtol=1e-8)


@pytest.mark.parametrize("largest", [2.0**40, np.inf])
def test_what_rounding_leaves_singular_moves_what_can_be_told(largest: float) -> None:
    """Derivatives beyond all sense in one segment: its nodes move together or not at all, all others as they do."""
    sound, right = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([[3.0], [3.0]])
    absurd = np.array([[largest**2, largest], [largest, 1.0]])
    solved = _solve(np.stack([sound, np.ones((2, 2)), absurd]), np.stack([right, np.ones((2, 1)), [[largest], [1.0]]]))
    np.testing.assert_allclose(solved[0], [[1.0], [1.0]], rtol=1e-9)
    np.testing.assert_allclose(solved[1], [[0.5], [0.5]], rtol=1e-9)
    assert np.all(np.isfinite(solved[2]))
    if np.isfinite(largest):
        np.testing.assert_allclose(absurd @ solved[2], [[largest], [1.0]], rtol=1e-9)
