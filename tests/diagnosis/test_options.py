"""What the file says about the catalogue: which effects compete, and where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.additions import with_additions
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.options import considered, effort_of, level_of, places
from friction_ocp.effects.registry import effects
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.problem_file.load import load_problem


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """Return a problem whose file says nothing about the catalogue."""
    return replace(load_problem(write_case(tmp_path_factory.mktemp("options"), axis())), diagnosis={})


def _said(problem: Problem, stated: Mapping[str, Any]) -> Problem:
    return replace(problem, diagnosis=stated)


def test_entries_are_effects_or_effects_at_a_place(problem: Problem) -> None:
    """What the file names competes where it says, and what it excludes does not there."""
    current = fit_base(prepare(problem))
    everywhere = places(current, considered(problem))
    assert considered(problem).names == list(effects())
    assert {key for key in everywhere if key[0] == "cogging"} == {("cogging", "motor")}

    meant = considered(_said(problem, {"effects": ["stribeck", "cogging at motor"]}))
    assert places(current, meant) == [("stribeck", "motor"), ("cogging", "motor")]
    assert meant.entries == ["stribeck", "cogging at motor"]

    without = places(current, considered(_said(problem, {"exclude": ["stribeck", "cogging at motor"]})))
    assert without == [key for key in everywhere if key not in (("stribeck", "motor"), ("cogging", "motor"))]


@pytest.mark.parametrize(
    ("stated", "where", "complaint"),
    [
        ({"effects": "cogging"}, "diagnosis.effects", "a list of effects"),
        ({"effects": ["coging"]}, "diagnosis.effects", "unknown effect 'coging'"),
        ({"exclude": ["cogging at moon"]}, "diagnosis.exclude", "cogging makes no sense at 'moon' of this drive"),
    ],
)
def test_nonsense_is_told_with_its_place(
    problem: Problem, stated: Mapping[str, Any], where: str, complaint: str
) -> None:
    """The error says which entry, what is wrong with it, and what would do."""
    with pytest.raises(FrictionOcpError, match=complaint) as caught:
        considered(_said(problem, stated))
    assert where in str(caught.value)


@pytest.mark.parametrize("level", [0.0, 0.7, "high"])
def test_a_level_is_a_probability(problem: Problem, level: object) -> None:
    """Nothing else is taken."""
    with pytest.raises(FrictionOcpError, match=r"between 0 and 0\.5"):
        level_of(_said(problem, {"significance": level}))


@pytest.mark.parametrize("effort", [0, -1.0, "long", True, float("inf")])
def test_an_effort_is_a_number_above_zero(problem: Problem, effort: object) -> None:
    """Nothing else is taken; without one it is the usual one."""
    with pytest.raises(FrictionOcpError, match="above 0"):
        effort_of(_said(problem, {"effort": effort}))
    assert effort_of(problem) == 1.0 and effort_of(_said(problem, {"effort": 3})) == 3.0


def test_parts_that_an_effect_added_are_no_place_for_another(problem: Problem) -> None:
    """A structural mode brings a shaft of its own; what is named is a part of the drive that the file states."""
    mode = effects()["structural_mode"]
    drive = with_additions(fit_base(prepare(problem)), [("structural_mode", "motor")])
    assert len(drive.shafts) == len(problem.drive.shafts) + 1
    stated = {part.name for part in (*problem.drive.shafts, *problem.drive.motors)}
    assert {place for effect, place in considered(problem).candidates(drive) if effect == mode.name} <= stated
    everywhere = {place for _, place in considered(problem).candidates(drive)}
    assert everywhere <= {*stated, *(item.name for item in problem.drive.channels), "drive"}


def test_an_addition_is_made_once_and_only_where_there_is_a_place(problem: Problem) -> None:
    """Named again it has no more general shape to take; at a shaft that is not there it is left out."""
    base = fit_base(prepare(problem))
    once = with_additions(base, [("inertia_error", "motor"), ("structural_mode", "motor")])
    again = with_additions(base, [("structural_mode", "motor"), ("periodic_disturbance", "nowhere")] * 4)
    assert len(again.shafts) == len(once.shafts)
