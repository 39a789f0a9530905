"""What a recording says between two models, whatever units their parameters come in."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.excitation import worth
from friction_ocp.recording.recording import Recording

SIZES = np.array([300.0, -200.0])
"""Noise floors that each parameter would have to make up for, at one unit of both."""


@pytest.mark.parametrize("units", [(1.0, 1.0), (1e6, 1e-8), (1e-9, 1e5)])
def test_a_false_model_adapts_with_parameters_of_any_units(
    units: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What its parameters can make up for says nothing against it; what they cannot says all."""
    slope = np.column_stack([np.ones(100), np.linspace(-1.0, 1.0, 100)])
    beyond = np.cos(np.linspace(0.0, 40.0 * np.pi, 100, endpoint=False))
    beyond -= slope @ np.linalg.lstsq(slope, beyond, rcond=None)[0]
    jacobian = slope * np.array(units)
    rows = SimpleNamespace(jacobian=jacobian, residual=slope @ SIZES + beyond, recording=np.zeros(100, dtype=int))
    names = ("joint.stiffness", "motor.inertia")
    program = SimpleNamespace(space=SimpleNamespace(names=names))
    monkeypatch.setattr(worth, "_linear", lambda fitted, recording: SimpleNamespace(rows=rows, program=program))
    monkeypatch.setattr(worth, "_known", lambda fitted, names: 1e-12 * jacobian.T @ jacobian)
    found = worth.evidence(cast(FittedModel, None), cast(Recording, None))
    assert found.separation == pytest.approx(float(beyond @ beyond), rel=1e-3)
