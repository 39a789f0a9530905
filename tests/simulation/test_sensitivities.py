"""Sensitivities of a sweep against central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sweep_cases import DRIVES, Case

from friction_ocp.simulation.interpreted import InterpretedKernel
from friction_ocp.simulation.kernel import SweepRequest, SweepResult
from friction_ocp.simulation.sweep import Sweep

SHIFT = 1e-5
"""Of a parameter, relative to its value; of a state, in rad or rad/s."""
DIFFERENCING = 5e-6
"""Curvature over SHIFT, and cancellation, which accelerations magnify; relative to the largest slope."""


def quotient(sweep: Sweep, above: SweepRequest, below: SweepRequest, distance: float) -> SweepResult:
    """Return the difference quotients of outputs and ends."""
    up, down = sweep.run_many([replace(item, derivatives=False) for item in (above, below)])
    return SweepResult((up.y - down.y) / distance, (up.end - down.end) / distance)


def assert_slope(found: np.ndarray, expected: np.ndarray, name: str) -> None:
    """Compare one column of a sensitivity with its difference quotient."""
    scale = np.max(np.abs(expected)) + 1.0
    assert np.max(np.abs(found - expected)) < DIFFERENCING * scale, name


@pytest.mark.parametrize("name", DRIVES)
def test_sensitivities_are_difference_quotients(name: str) -> None:
    """Derivatives by start states and parameters are the limits of difference quotients."""
    case = Case(DRIVES[name]())
    request = case.request(np.random.default_rng(1))
    sweep = Sweep(case.model, case.active)
    result = sweep.run_many([request])[0]
    assert result.dy is not None and result.dend is not None
    states = len(case.model.state_names)
    for k in range(states):
        move = np.zeros(states)
        move[k] = SHIFT
        up, down = (replace(request, x0=request.x0 + sign * move) for sign in (1, -1))
        slope = quotient(sweep, up, down, 2 * SHIFT)
        assert_slope(result.dy[:, :, k], slope.y, case.model.state_names[k])
        assert_slope(result.dend[:, :, k], slope.end, case.model.state_names[k])
    for column, k in enumerate(case.active):
        move = np.zeros(case.numbers.size)
        move[k] = SHIFT * case.numbers[k]
        up, down = (replace(request, p=request.p + sign * move) for sign in (1, -1))
        slope = quotient(sweep, up, down, 2 * move[k])
        assert_slope(result.dy[:, :, states + column], slope.y, case.model.parameter_names[k])
        assert_slope(result.dend[:, :, states + column], slope.end, case.model.parameter_names[k])


def test_values_do_not_depend_on_derivatives() -> None:
    """A sweep with sensitivities returns the values of a sweep without."""
    case = Case(DRIVES["loaded joint"]())
    request = case.request(np.random.default_rng(2), width=0.0)
    sweep = Sweep(case.model, case.active)
    both, alone = sweep.run_many([request, replace(request, derivatives=False)])
    np.testing.assert_allclose(both.y, alone.y, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(both.end, alone.end, rtol=1e-10, atol=1e-12)
    assert alone.dy is None and alone.dend is None


def test_segments_that_meet_are_one_run() -> None:
    """Segments that start where the one before ended give the outputs of one long segment."""
    case = Case(DRIVES["sampled controller"]())
    request = case.request(np.random.default_rng(3), width=0.0, derivatives=False)
    sweep = Sweep(case.model, case.active)
    whole = sweep.run_many([replace(request, first=request.first[[0, -1]], x0=request.x0[:1])])[0]
    assert whole.states is not None
    x0, cut = request.x0.copy(), request
    for _ in range(2):
        cut = replace(cut, x0=x0)
        x0[1:] = sweep.run_many([cut])[0].end[:-1]
    parts = sweep.run_many([replace(cut, x0=x0)])[0]
    np.testing.assert_allclose(parts.y, whole.y, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(parts.end[-1], whole.end[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("compiled", [True, False])
def test_derivatives_by_start_states_alone_are_the_first_columns(name: str, compiled: bool) -> None:
    """Without the active parameters nothing changes but that their columns are not there."""
    case = Case(DRIVES[name]())
    request = case.request(np.random.default_rng(3))
    sweep = Sweep(case.model, case.active)
    if not compiled:
        sweep.kernel = InterpretedKernel(case.model, case.active)
    whole, part = sweep.run_many([request, replace(request, by_active=False)])
    states = len(case.model.state_names)
    for all_columns, some in ((whole.dy, part.dy), (whole.dend, part.dend)):
        assert all_columns is not None and some is not None
        assert np.array_equal(all_columns[:, :, :states], some)
    assert np.array_equal(whole.y, part.y)
