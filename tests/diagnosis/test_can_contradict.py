"""Stated values are contradicted by what is left where that is noise as it is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from friction_ocp.diagnosis import stated
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft

LEVEL = 0.01


@pytest.mark.parametrize(
    ("ratio", "source", "density", "can"),
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
    ratio: float, source: str, density: float, can: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where less is left than there would be of it, no value is wrong for that; nor where more is."""

    def floor(model: Any, channel: Channel) -> Any:
        assert channel.name == "current"
        return SimpleNamespace(source=source)

    monkeypatch.setattr(stated, "input_floor", floor)
    channels = (Channel("current", "servo.current", "input"), Channel("angle", "axis.theta"))
    drive = Drive((Shaft("axis", 1.0),), motors=(Motor("servo", "axis"),), channels=channels)
    fitted: Any = SimpleNamespace(
        model=SimpleNamespace(problem=SimpleNamespace(drive=drive)), footing=SimpleNamespace(density={"axis": density})
    )
    assert stated.can_contradict(fitted, Excess(ratio, 0.5), LEVEL) == can
    assert not stated.can_contradict(fitted, Excess(1.0, 0.5 * LEVEL), LEVEL)
