"""Drives put together again from what was accepted: each addition as it was when it was."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from diagnosis_cases import axis, write_case
from test_phases import tracks

from friction_ocp.diagnosis import additions
from friction_ocp.diagnosis.additions import forms_of, with_additions
from friction_ocp.diagnosis.select import Choice, Round
from friction_ocp.effects.effect import Clues, Key
from friction_ocp.effects.periodic import has_own
from friction_ocp.problem_file.load import load_problem

FIRST, WAVE, OTHER = ("asymmetry", "motor"), ("cogging", "motor"), ("constant_torque", "motor")


def accepting(key: Key, before: Any) -> Round:
    """Return the round that has added something to a model."""
    return Round((), Choice((), (), 0.0, True, ()), before, cast(Any, None), cast(Any, SimpleNamespace(key=key)))


def test_a_wave_keeps_the_phases_that_it_was_accepted_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The base model, off by more than the wave, does not show that recordings differ."""
    problem = load_problem(write_case(tmp_path, axis()))
    base: Any = SimpleNamespace(model=SimpleNamespace(problem=problem))
    beside: Any = SimpleNamespace(model=SimpleNamespace(problem=problem))
    typical = {"motor": 1.0}
    alike, apart = (Clues(tracks(each), {}, typical) for each in ((0.4, 0.4, 0.4), (0.4, 2.0, 4.0)))
    seen = {id(base): alike, id(beside): apart}

    def clues_of(fitted: Any) -> Clues:
        return seen[id(fitted)]

    monkeypatch.setattr(additions, "clues_of", clues_of)
    rounds = [accepting(FIRST, base), accepting(WAVE, beside)]

    def phases(keys: list[Key], forms: additions.Forms | None) -> bool:
        cogging = with_additions(base, keys, forms).motors[0].cogging
        assert cogging is not None
        return has_own(cogging)

    assert phases([FIRST, WAVE], forms_of(rounds))
    assert phases([OTHER, WAVE], forms_of(rounds, {FIRST: OTHER}))
    assert not phases([WAVE], None)


def test_every_shape_has_the_form_of_its_round(monkeypatch: pytest.MonkeyPatch) -> None:
    """What takes the place of another takes its rounds."""

    def named(fitted: Any) -> Any:
        return fitted

    monkeypatch.setattr(additions, "clues_of", named)
    rounds = [accepting(WAVE, "base"), accepting(FIRST, "second"), accepting(WAVE, "third")]
    assert forms_of(rounds) == {WAVE: ["base", "third"], FIRST: ["second"]}
    assert forms_of(rounds, {WAVE: OTHER}) == {OTHER: ["base", "third"], FIRST: ["second"]}
