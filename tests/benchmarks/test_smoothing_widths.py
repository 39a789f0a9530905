"""The exact answer does not depend on a smoothing width, and slow motion shows no false structure."""

from __future__ import annotations

import numpy as np
import pytest
import smoothing

from friction_ocp.estimation.estimate import identify


@pytest.mark.parametrize("seed", [6])
def test_exact_friction_is_the_limit_of_smoothed_friction(seed: int) -> None:
    """A tenth of the smallest width moves no estimate by a tenth of a standard error; wide smoothing does."""
    problem = smoothing.slow_problem(seed)
    answer = identify(problem)
    table = smoothing.smoothed(problem, answer)
    errors = np.array([item.std_error for item in answer.parameters])
    shifts = [float(np.max(np.abs(item.theta - table[-1].theta) / errors)) for item in table]
    assert shifts[-2] < 0.1
    assert shifts[0] > 100.0
    assert all(test.white for tests in answer.residuals.values() for test in tests.values())
