"""Stated values are contradicted by what is left where that is noise as it is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_ocp.diagnosis import stated
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis.stated import contradictions
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft
from friction_ocp.simulation.grid import FloatArray

LEVEL = 0.01


@pytest.mark.parametrize(
    ("ratio", "source", "density", "found"),
    [
        (1.0, "high_frequency", 0.1, True),
        (0.92, "high_frequency", 0.1, True),
        (0.5, "high_frequency", 0.1, False),
        (0.5, "high_frequency", 0.0, True),
        (0.5, "noise_std", 0.1, True),
        (0.5, "resolution", 0.1, True),
        (1.2, "noise_std", 0.1, False),
    ],
)
def test_noise_of_inputs_that_nobody_states_may_be_none(
    ratio: float, source: str, density: float, found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where less is left than there would be of it, a rotor that looks too light is none; nor where more is."""
    fitted = _fitted({"axis.inertia": -4.0}, source, density, monkeypatch)
    assert bool(contradictions(fitted, Excess(ratio, 0.5), LEVEL)) == found
    assert not contradictions(fitted, Excess(1.0, 0.5 * LEVEL), LEVEL)


@pytest.mark.parametrize(
    ("deviations", "keys"),
    [
        ({"axis.inertia": 4.0}, [("inertia_error", "axis")]),
        (
            {"axis.inertia": 4.0, "axis.gravity.torque": 5.0},
            [("parameter_error", "axis"), ("inertia_error", "axis")],
        ),
        ({"axis.inertia": 4.0, "axis.gravity.torque": -2.9}, [("inertia_error", "axis")]),
        ({"axis.inertia": 4.0, "axis.gravity.torque": -3.1}, []),
        ({"axis.inertia": 2.9}, []),
        ({"servo.torque_constant": 4.0}, []),
    ],
)
def test_attenuation_makes_nothing_heavier(
    deviations: dict[str, float], keys: list[tuple[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is more than stated is so, however little is left; what current makes of torque is not told by that."""
    fitted = _fitted(deviations, "high_frequency", 0.1, monkeypatch)
    found = contradictions(fitted, Excess(0.3, 0.5), LEVEL)
    assert [(item.effect, item.component) for item in found] == keys


def _fitted(deviations: dict[str, float], source: str, density: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    def floor(model: Any, channel: Channel) -> Any:
        assert channel.name == "current"
        return SimpleNamespace(source=source)

    def prior_deviations(theta: FloatArray) -> FloatArray:
        return theta

    monkeypatch.setattr(stated, "input_floor", floor)
    channels = (Channel("current", "servo.current", "input"), Channel("angle", "axis.theta"))
    drive = Drive((Shaft("axis", 1.0),), motors=(Motor("servo", "axis"),), channels=channels)
    theta = np.array(list(deviations.values()))
    ones = np.ones(theta.size)
    space = SimpleNamespace(
        names=tuple(deviations), prior_std=ones, prior_mean=0.0 * ones, prior_deviations=prior_deviations
    )
    model = SimpleNamespace(problem=SimpleNamespace(drive=drive), space=space)
    values = dict(zip(deviations, map(float, theta), strict=True))
    return SimpleNamespace(model=model, footing=SimpleNamespace(density={"axis": density}), theta=theta, values=values)
