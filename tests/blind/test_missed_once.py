"""Cases that a diagnosis once missed, each for a reason of its own: no longer used to measure how well it does."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from blind.draw import make

from friction_ocp.cli import main

Found = list[tuple[str, str]]
MISSED: dict[str, tuple[int, int, Found]] = {
    "free runs are lost, and see nothing of either of two effects": (
        *(11, 150),
        [("sensor_eccentricity", "motor_position"), ("torque_ripple", "motor")],
    ),
    "drag that grows with the load, of which the catalogue's first shape explains most, and not for certain": (
        *(20261207, 138),
        [("load_dependence", "motor")],
    ),
    "presliding of springs that slip one after another, of which a single bristle leaves five times the noise": (
        *(20261207, 119),
        [("presliding", "motor")],
    ),
    "a transmission whose loop is one of springs that slip": (20261207, 46, [("transmission_hysteresis", "gear-axis")]),
    "cogging once a turn, of which unbalance is all but the overtones": (20261209, 39, [("cogging", "motor")]),
    "unbalance, which cogging of a free period explains as well": (20261207, 136, [("unbalance", "motor")]),
    "the back-EMF of a motor that saturates falls with its torque": (20261207, 158, [("torque_saturation", "motor")]),
    "overtones of a disturbance in time, where the strongest period of what is missing is none of its orders": (
        *(20261209, 121),
        [("periodic_disturbance", "motor")],
    ),
    "a disturbance in time whose phase dry friction hides in recordings left out": (
        *(20261217, 137),
        [("periodic_disturbance", "motor")],
    ),
    "friction that its losses warm, and take away by as much as it had at the typical one": (
        *(20261217, 68),
        [("warm_up", "motor")],
    ),
    "a dead time before the lag of a motor, in a loop: a late sensor stood in for it": (
        *(20261209, 148),
        [("drive_lag", "motor")],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("why", MISSED)
def test_what_was_missed_once_is_found(why: str, tmp_path: Path) -> None:
    """All of it, nothing else, and no more than noise is left."""
    seed, index, expected = MISSED[why]
    case = make(seed, index, tmp_path)
    assert sorted((item.effect, item.component) for item in case.planted) == sorted(expected)
    assert main(["diagnose", str(tmp_path / "cases" / case.name / "problem.yaml"), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    sets = [[(item["effect"], item["component"]) for item in members] for members in found["alias_sets"]]
    assert sets == [] and found["verdict"] == "explained"
    assert [(item["effect"], item["component"]) for item in found["accepted"]] == expected
