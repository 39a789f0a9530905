"""What the first sentence of a diagnosis says of what it found and of what it left."""

from __future__ import annotations

from typing import Any

import pytest

from friction_ocp.report.diagnosis_words import (
    alias_sentences,
    blind_spot_sentences,
    diagnosis_sentence,
    superseded_sentences,
)

LOAD = {"effect": "load_dependence", "component": "servo"}
COGGING = {"effect": "cogging", "component": "servo"}
LAG = {"effect": "drive_lag", "component": "servo"}


def result(verdict: str, **changes: Any) -> dict[str, Any]:
    gap = {"shrink": {"overall": 0.5, "interval95": [0.4, 0.6]}}
    return {"verdict": verdict, "accepted": [LOAD], "alias_sets": [], "gap": gap, **changes}


def test_an_effect_beside_an_unknown_rest_is_told_with_its_rivals() -> None:
    """The part that is explained, what else may explain it, and that a rest is left are in one sentence."""
    unknown = result("unknown_effect", accepted=[LOAD, LAG], as_near=[[LOAD, COGGING]])
    said = diagnosis_sentence(unknown)
    assert said.startswith("Explained in part: the model lacked load dependence at servo (cogging at servo came as ")
    assert alias_sentences(unknown) == ["load dependence at servo or cogging at servo, none of which explains all"]
    assert "and drive lag at servo, with which 50 % of the excess error is gone" in said
    assert said.endswith("what is left is more than noise, and nothing in the catalogue explains it.")


def test_an_unknown_effect_alone_is_no_part() -> None:
    """Where nothing was found the sentence does not speak of a part."""
    assert "in part" not in diagnosis_sentence(result("unknown_effect", accepted=[]))
    assert "cannot tell" not in diagnosis_sentence(result("explained"))


def test_what_may_be_torque_noise_is_told_with_how_to_have_it_counted() -> None:
    """Where errors of one-step predictions show nothing, and a slow torque is left on a shaft."""
    rest: dict[str, object] = {"as_torque_noise": "slide", "torque_noise": {"value": 0.0349, "unit": "N/sqrt(Hz)"}}
    said = diagnosis_sentence(result("unknown_effect", accepted=[], remainder=rest))
    assert "nothing in the catalogue explains it. Errors of one-step predictions are no more than noise: torque" in said
    assert "noise of about 0.035 N/sqrt(Hz) at slide, of which the file states none, would leave as much" in said
    assert "Stated in the file as estimation: {process_noise: {slide: ...}} it counts as noise; identify with" in said
    rest |= {"parted_by_torque": True, "carries_over": False, "ratio_before": 7.5, "ratio": 1.1}
    said = diagnosis_sentence(result("unknown_effect", accepted=[LOAD], remainder=rest))
    assert said.startswith("Explained in part: the model lacked load dependence at servo")
    assert "Free runs come no closer: it may be that they lack torque noise of about 0.035 N/sqrt(Hz) at slide" in said
    assert "probably another" not in said and "identify with `estimate` there tells how much it is." in said
    rest = {"as_torque_noise": None}
    assert "process_noise" not in diagnosis_sentence(result("unknown_effect", accepted=[], remainder=rest))


def test_aliases_are_told_as_what_recordings_cannot_tell_apart() -> None:
    """Where noise is left, one of the members is the cause."""
    undecided = result("undecided", accepted=[LOAD], alias_sets=[[LOAD, COGGING]])
    assert "several causes fit it: most likely load dependence at servo" in diagnosis_sentence(undecided)
    assert alias_sentences(undecided) == ["load dependence at servo or cogging at servo"]


@pytest.mark.parametrize(("verdict", "likely"), [("explained", ""), ("undecided", "most likely ")])
def test_values_that_are_not_as_stated_close_no_gap(verdict: str, likely: str) -> None:
    """Where the recordings showed none, the sentence says what is wrong and no share of it; elsewhere the share."""
    wrong = {"effect": "inertia_error", "component": "gear", "meaning": "the stated inertia is wrong"}
    noise, gap = {"excess": {"ratio": 0.9, "p_value": 0.8}}, {"shrink": {"overall": 0.0, "interval95": [-0.1, 0.1]}}
    said = result(verdict, accepted=[wrong], rounds=[noise], gap=gap, significance=0.01)
    told = diagnosis_sentence(said)
    assert told.startswith("The model explains these recordings down to the noise, but not with the values that are")
    assert told.endswith(f"stated: {likely}inertia error at gear (the stated inertia is wrong).")
    assert "50 % of the excess" in diagnosis_sentence({**said, "gap": result(verdict)["gap"]})
    shown = {"excess": {"ratio": 3.0, "p_value": 1e-9}}
    assert "of the excess" in diagnosis_sentence({**said, "rounds": [shown]})


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


def decided(accepted: dict[str, str], outside: float, reshaped: bool = False) -> dict[str, Any]:
    return {
        "accepted": accepted,
        "reshaped": reshaped,
        "probabilities": {"no_effect": 0.0, "outside_catalogue": outside},
    }


def test_the_doubt_of_a_shape_is_not_that_of_the_effect() -> None:
    """What may stand in for something unknown is told with the doubt of the round that brought it."""
    rounds = [decided(COGGING, 0.2), decided(COGGING, 0.91, reshaped=True)]
    said = diagnosis_sentence(result("unknown_effect", accepted=[COGGING], rounds=rounds))
    assert said.endswith("The same unknown cause may lie behind what was taken for cogging at servo (20 %).")


def test_what_does_not_carry_over_is_no_part() -> None:
    """An addition that helps nowhere but where it was fitted is told as such, and no rest that there may not be."""
    gap = {"shrink": {"overall": -0.1, "interval95": [-0.2, -0.05]}}
    said = diagnosis_sentence(result("unknown_effect", gap=gap, remainder={"significant": True, "carries_over": False}))
    assert "explains part of it where the model was fitted, but not on recordings left out" in said
    assert said.endswith("The cause is probably another.")
    assert "what is left" not in said


def test_free_runs_that_are_lost_in_any_case_are_no_evidence() -> None:
    """Predictions from sample to sample tell what was gained, and nothing grows where all runs lead nowhere."""
    gap = {"shrink": {"overall": -19.9, "interval95": [-21.7, -18.6]}}
    remainder = {"significant": True, "carries_over": False, "lost": True, "ratio": 140.0, "ratio_before": 375.0}
    rounds = [decided(COGGING, 0.0)]
    said = diagnosis_sentence(result("unknown_effect", gap=gap, accepted=[COGGING], remainder=remainder, rounds=rounds))
    assert said.startswith("Explained in part: the model lacked cogging at servo. ")
    assert "140 times the power of their noise with it, 375 times without" in said
    assert said.endswith("on recordings left out they lead nowhere with or without it.")
    assert "do not rely" not in said


@pytest.mark.parametrize("verdict", ["explained", "undecided"])
def test_free_runs_that_part_by_themselves_are_told(verdict: str) -> None:
    """They come no closer, and noise alone sets them as far apart: what goes from sample to sample is told."""
    rounds = [{"excess": {"ratio": 152.0, "p_value": 0.0}}]
    for stray in (True, False):
        remainder = {"significant": False, "stray": stray, "ratio": 1.1, "ratio_before": 152.0}
        said = diagnosis_sentence(result(verdict, accepted=[COGGING], remainder=remainder, rounds=rounds))
        assert ("Free runs say little here" in said) is stray
        assert ("1.1 times the power of their noise with it, 152 times without" in said) is stray
        assert ("of the excess error is gone" in said) is not stray


def test_additions_that_were_taken_back_are_told_once_with_the_reason() -> None:
    """Not with their shapes, nor what is there again in the end."""
    rounds = [decided(COGGING, 0.1), decided(COGGING, 0.1, reshaped=True), decided(LAG, 0.1), decided(LOAD, 0.1)]
    assert superseded_sentences(result("explained", superseded=rounds)) == [
        "Added on the way and taken back, because what was found later explains the same: cogging at servo and drive "
        "lag at servo."
    ]
    alone = superseded_sentences(result("unknown_effect", accepted=[], superseded=[decided(LAG, 0.1)]))
    assert alone == [
        "Added on the way and taken back, because nothing came nearer to the recordings left out: drive lag at servo."
    ]


def test_a_search_that_ended_early_says_so() -> None:
    """And how to have the rest tried; one that tried everything says nothing."""
    for accepted in ([], [COGGING]):
        said = diagnosis_sentence(result("unknown_effect", accepted=accepted, cut_short=True))
        assert said.endswith("a larger `effort` under `diagnosis:` (1 if none is stated) lets it go on.")
        assert "effort" not in diagnosis_sentence(result("unknown_effect", accepted=accepted, cut_short=False))


def test_almost_all_is_not_told_as_all() -> None:
    """Close to all of the gap is told more closely."""
    closed = {"overall": 0.99932, "interval95": [0.99885, 0.99963]}
    said = diagnosis_sentence(result("explained", accepted=[COGGING], gap={"shrink": closed}))
    assert said.endswith("with it 99.9 % of the excess error is gone (99.9 % to 100.0 %).")
