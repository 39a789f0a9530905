"""The integrator's steps are as short as the noise of the recordings demands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from axes import COULOMB, INERTIA, VISCOUS
from stiff_axis import SIGMA0, stiff_problem

from friction_ocp.estimation.fit import fit, settled
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.model import Model, prepare

STILL = 0.1
"""Standard errors that half the step may move an estimate."""
FAR = 4.5
"""Standard errors; one estimate in 150,000 is farther off by chance."""


def _model(noise: float, **options: Any) -> Model:
    return prepare(stiff_problem(noise, **options))


def _off(model: Model, theta: np.ndarray, std_error: np.ndarray) -> np.ndarray:
    truth = {
        "motor.inertia": INERTIA,
        "motor.friction.tau_c": COULOMB,
        "motor.friction.sigma0": SIGMA0,
        "motor.friction.sigma2": VISCOUS,
    }
    return (theta - np.array([truth[name] for name in model.space.names])) / std_error


@pytest.fixture(scope="module")
def fine() -> Model:
    """A fine encoder."""
    return _model(1e-4)


def test_a_fine_encoder_shortens_the_step_until_the_answer_stands(fine: Model) -> None:
    """Half the step that is left moves nothing; the parameters are the plant's; the first step's were not."""
    rough = fit(fine)
    model, fitted = settled(fine)
    assert model.max_step < fine.max_step
    information = influence(fitted.program, fitted.solution.point).information
    std_error = np.sqrt(np.diag(np.linalg.inv(information)))
    assert np.max(np.abs(_off(model, fitted.solution.point.theta, std_error))) < FAR
    moved = (rough.solution.point.theta - fitted.solution.point.theta) / std_error
    assert np.max(np.abs(moved)) > STILL
    again = fit(_model(1e-4, max_step=0.5 * model.max_step))
    move = (again.solution.point.theta - fitted.solution.point.theta) / std_error
    assert np.max(np.abs(move)) < STILL


def test_a_coarse_encoder_and_a_stated_step_are_left_alone() -> None:
    """Where the noise hides the error of the step, or the user has chosen, nothing is refined."""
    coarse = _model(1e-2)
    assert settled(coarse)[0].max_step == coarse.max_step
    stated = _model(1e-2, max_step=1e-3)
    assert settled(stated)[0].max_step == 1e-3
