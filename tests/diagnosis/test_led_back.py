"""What does nothing that the parameters could not do as well is led back to what the problem states of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.led_back import led_back
from friction_ocp.diagnosis.polishing import polished
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.model import prepare, with_drive
from friction_ocp.problem_file.load import load_problem

SCALE = 1.4
"""Of the only encoder; inertia and viscous friction grow with it."""


def test_a_scale_of_the_only_encoder_goes_back_to_one(tmp_path: Path) -> None:
    """Inertia and friction come back with it to where the fit without it was."""
    path = write_case(tmp_path, axis())
    factors = {"motor.inertia": SCALE, "motor.friction.viscous": SCALE}
    base = fit_base(prepare(load_problem(path)))
    at = {name: base.values[name] * factor for name, factor in factors.items()}
    added = effects()["sensor_gain"].augment(base.model.problem.drive, "position", clues_of(base)).drive
    model = with_drive(base.model, added)
    held = replace(model.space, lower=model.space.lower.copy(), upper=model.space.upper.copy())
    held.lower[held.names.index("position.gain")] = SCALE
    scaled = polished(
        replace(model, space=held), base.footing, held.with_known({**base.values, **at, "position.gain": SCALE}), None
    )
    assert scaled.values["position.gain"] == pytest.approx(SCALE, rel=0.01)
    back = led_back(scaled, base.model)
    assert back is not None
    np.testing.assert_allclose(back, base.theta, rtol=0.02)


def test_drag_is_not_led_back(tmp_path: Path) -> None:
    """The simpler model has no number for it."""
    path = write_case(tmp_path, axis(law="quadratic", quadratic=1e-4))
    base = fit_base(prepare(load_problem(path)))
    added = effects()["quadratic_drag"].augment(base.model.problem.drive, "motor", clues_of(base)).drive
    model = with_drive(base.model, added)
    with_drag = polished(model, base.footing, model.space.with_known(base.values), None)
    assert led_back(with_drag, base.model) is None
