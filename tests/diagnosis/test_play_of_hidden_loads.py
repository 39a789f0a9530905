"""Free play that no encoder sees both sides of: the motor's alone tells it by how the load comes and goes."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnosis_cases import diagnosed
from joint_with_play import TRUTH, write_joint


@pytest.mark.slow
def test_play_behind_the_only_encoder_is_found(tmp_path: Path) -> None:
    """Play alone, to one part in a hundred; nothing stands in for it, and nothing is left."""
    result = diagnosed(write_joint(tmp_path, with_play=False))
    assert result["verdict"] == "explained"
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("backlash", "motor-load")
    play = TRUTH["motor-load.backlash"]
    assert accepted["parameters"]["motor-load.backlash"]["value"] == pytest.approx(play, rel=0.01)
