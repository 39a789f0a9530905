"""The recorded servo's problems: each model is fitted, and those that see the load explain unseen motion."""

from __future__ import annotations

import pytest
from servo_problem import SERVO_PROBLEMS

from friction_ocp import identify, load_problem

KNOWN_BEST = {
    "coulomb_viscous": (0.0546, 0.0628),
    "stribeck": (0.0546, 0.0628),
    "load_dependent": (0.0475, 0.0527),
    "stribeck_load": (0.0475, 0.0527),
}
"""Mean absolute errors, rad, on training and validation, that a global search without the supply voltage reached."""


@pytest.mark.slow
@pytest.mark.parametrize("model", KNOWN_BEST)
def test_each_model_is_fitted_as_well_as_the_best_known(model: str) -> None:
    """Free runs explain position as well as known, on the gains that were trained on and on the one that was not."""
    estimate = identify(load_problem(SERVO_PROBLEMS / f"{model}.yaml"))
    assert estimate.converged, estimate.message
    found = estimate.simulation
    training, validation = KNOWN_BEST[model]
    assert found.train_errors["position"][0].mae <= training
    assert found.validation_errors["position"][0].mae <= validation
