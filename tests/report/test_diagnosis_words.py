"""What the first sentence of a diagnosis says of what it found and of what it left."""

from __future__ import annotations

from typing import Any

from friction_ocp.report.diagnosis_words import blind_spot_sentences, diagnosis_sentence

LOAD = {"effect": "load_dependence", "component": "servo"}
COGGING = {"effect": "cogging", "component": "servo"}
LAG = {"effect": "drive_lag", "component": "servo"}


def result(verdict: str, **changes: Any) -> dict[str, Any]:
    gap = {"shrink": {"overall": 0.5, "interval95": [0.4, 0.6]}}
    return {"verdict": verdict, "accepted": [LOAD], "alias_sets": [], "gap": gap, **changes}


def test_an_effect_beside_an_unknown_rest_is_told_with_its_rivals() -> None:
    """The part that is explained, what else may explain it, and that a rest is left are in one sentence."""
    said = diagnosis_sentence(result("unknown_effect", accepted=[LOAD, LAG], alias_sets=[[LOAD, COGGING]]))
    assert said.startswith("Explained in part: the model lacked load dependence at servo (or cogging at servo:")
    assert "and drive lag at servo, with which 50 % of the excess error is gone" in said
    assert said.endswith("what is left is more than noise, and nothing in the catalogue explains it.")


def test_an_unknown_effect_alone_is_no_part() -> None:
    """Where nothing was found the sentence does not speak of a part."""
    assert "in part" not in diagnosis_sentence(result("unknown_effect", accepted=[]))
    assert "cannot tell" not in diagnosis_sentence(result("explained"))


def test_what_recordings_are_too_fast_for_is_told_with_the_speed_to_record() -> None:
    """The effect, the size that would hide, and below which speed to record."""
    spot = {
        "effect": "stribeck",
        "component": "motor",
        "record_below": {"value": 2.61, "unit": "rad/s"},
        "unseen": {"value": 0.11, "unit": "N m"},
    }
    (said,) = blind_spot_sentences(result("no_gap", cannot_tell=[spot]))
    assert said.startswith("stribeck at motor: these recordings cannot tell")
    assert said.endswith("0.11 N m of it would stay in the noise. Record below 2.6 rad/s.")
