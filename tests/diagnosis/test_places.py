"""Places that the sensors cannot tell from one another."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from diagnosis_cases import axis, diagnosed, write_case


@pytest.mark.slow
def test_what_is_the_same_at_two_places_lies_at_both(tmp_path: Path) -> None:
    """Friction that falls with speed on one of two shafts that turn as one: accepted at one, possible at the other."""
    path = write_case(tmp_path, axis(law="stribeck", tau_s=0.16, omega_s=3.0), effects=["stribeck"])
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"].append({"name": "load", "inertia": 1e-3, "friction": {"law": "coulomb", "tau_c": 0.0}})
    document["drive"]["transmissions"] = [{"ratio": 2.0, "stiffness": "rigid"}]
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    found = diagnosed(path)
    (accepted,) = found["accepted"]
    assert accepted["effect"] == "stribeck"
    assert found["where"]["components"][0] == accepted["component"]
    assert set(found["where"]["components"]) == {"motor", "load"}
    assert [{item["component"] for item in same} for same in found["same_as"]] == [{"motor", "load"}]
