"""A motor that follows its controller late, and a log that shows what it does or what it was told to."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnosis_cases import STEP, diagnosed
from looped_axis import written

LAG = 3.0 * STEP


@pytest.mark.parametrize(("shown", "hidden"), [("command", 1.0), ("current", 0.0)])
def test_the_lag_is_found_whichever_is_logged(tmp_path: Path, shown: str, hidden: float) -> None:
    """The motor is named, not its sensors, and its time constant is that of the plant."""
    path = written(tmp_path, feedback="quiet", lag=LAG, shown=shown, effects=("drive_lag", "sensor_delay", "stribeck"))
    result = diagnosed(path)
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("drive_lag", "motor")
    assert accepted["parameters"]["motor.lag"]["value"] == pytest.approx(LAG, rel=0.05)
    assert accepted["parameters"]["motor.lag_hidden"]["value"] == pytest.approx(hidden, abs=0.05)
