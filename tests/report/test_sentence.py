"""The verdict in words."""

from __future__ import annotations

from report_example import identified

from friction_ocp.report import verdict_sentence


def test_the_verdict_states_status_errors_and_what_is_determined() -> None:
    """A reader who stops after the sentence knows the answer."""
    result, _ = identified(2000)
    result["fit"] = {
        "horizon_s": None,
        "train": {"position": {"mae": 0.0543, "unit": "rad"}},
        "validation": {"position": {"mae": 0.056, "unit": "rad"}},
    }
    assert verdict_sentence(result) == (
        "Converged. Free run explains position to 0.054 rad (mean abs) on training, 0.056 rad on validation. "
        "5 of 9 parameters are determined."
    )


def test_windows_and_missing_validation_are_said() -> None:
    """An error over windows is not passed off as one over the whole recording."""
    fit = {"horizon_s": 10.0, "train": {f"c{index}": {"mae": 0.5, "unit": "A"} for index in range(5)}, "validation": {}}
    sentence = verdict_sentence({"status": "converged", "fit": fit})
    assert "over windows of 10 s" in sentence
    assert "2 more channels" in sentence
    assert "nothing was held out" in sentence


def test_a_failed_solve_is_no_answer() -> None:
    """The reason comes first, and no parameter of the last iterate is called determined."""
    parameters = {name: {"verdict": "ok"} for name in ("a", "b")}
    result = {"status": "not_converged", "message": "iteration limit reached.", "parameters": parameters}
    sentence = verdict_sentence(result)
    assert sentence == "Not converged: iteration limit reached. What follows is the last iterate, not an answer."
