"""Work on a candidate that fails: what it costs is this candidate, and the reader is told."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, cast

import pytest
from diagnosis_cases import axis, diagnosed, write_case

from friction_ocp.diagnosis.crew import Crew
from friction_ocp.drive.parts import Drive
from friction_ocp.effects import registry
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Clues
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.execution.executor import InProcess
from friction_ocp.execution.ledger import Ledger
from friction_ocp.execution.task import Json, Task

FAILED = "1-refit-backlash-joint failed, and its candidate was left out: ZeroDivisionError: float division by zero"


def divided(bench: Any, number: float) -> Json:
    """Work that fails at zero."""
    return 1.0 / number


def refused(bench: Any) -> Json:
    """Work that finds a fault of the input."""
    raise FrictionOcpError(Finding("problem.yaml", "a fault of the input"))


def crew() -> Crew:
    """Return one without a model, which none of this work needs."""
    run = SimpleNamespace(executor=InProcess(), ledger=Ledger())
    bench = SimpleNamespace(fingerprint="")
    return Crew(cast(Any, bench), cast(Any, run), 1, lambda what, share: None)


def done(hands: Crew, tasks: list[Task], vital: int = 0) -> list[Json]:
    """Return what work has found."""
    return hands._run("refits", tasks, 0.0, vital)


def test_work_that_fails_costs_its_candidate_alone() -> None:
    """Be there one or several."""
    good, bad = Task("1-refit-stribeck-motor", divided, (2.0,)), Task("1-refit-backlash-joint", divided, (0.0,))
    hands = crew()
    assert done(hands, [good, bad]) == [0.5, None]
    assert hands.unexamined == [FAILED]
    assert done(crew(), [bad]) == [None]


def test_where_all_work_fails_none_is_left_out() -> None:
    """That is no property of a candidate."""
    bad = [Task(f"1-refit-stribeck-{place}", divided, (0.0,)) for place in ("motor", "load")]
    with pytest.raises(FrictionOcpError, match="division by zero"):
        done(crew(), bad)


def test_work_for_all_candidates_must_not_fail() -> None:
    """Such as what the model costs without any."""
    tasks = [Task("1-held-out", divided, (0.0,)), Task("1-refit-stribeck-motor", divided, (2.0,))]
    with pytest.raises(FrictionOcpError, match=r"1-held-out.*division by zero"):
        done(crew(), tasks, 1)


def test_faults_of_the_input_are_said_at_once() -> None:
    """Leaving out a candidate does not mend them."""
    tasks = [Task("1-screen-stribeck-motor", refused), Task("1-screen-asymmetry-motor", divided, (2.0,))]
    with pytest.raises(FrictionOcpError, match="a fault of the input"):
        done(crew(), tasks)


class BreakingEffect(AbstractEffect):
    """Somebody's own effect, with a fault."""

    name: ClassVar[str] = "breaking"
    sentence: ClassVar[str] = "it divides by zero"

    def places(self, drive: Drive) -> Iterable[str]:
        return ["motor"]

    def augment(self, drive: Drive, place: str, clues: Clues) -> Augmentation:
        raise ZeroDivisionError("division by zero")


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Make it known for the time of a test."""
    monkeypatch.setattr(registry, "_registered", dict(registry._registered))
    registry.register_effect(BreakingEffect)
    yield


@pytest.mark.slow
@pytest.mark.usefixtures("registered")
def test_the_others_are_found_and_the_reader_is_told(tmp_path: Path) -> None:
    """Beside an effect that cannot be added."""
    plant = axis(law="quadratic", quadratic=1e-5)
    found = diagnosed(write_case(tmp_path, plant, effects=["quadratic_drag", "asymmetry", "breaking"]))
    assert [item["effect"] for item in found["accepted"]] == ["quadratic_drag"]
    told = [line for line in found["assumptions"] if "its candidate was left out" in line]
    assert told and all("breaking-motor" in line and "division by zero" in line for line in told)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert told[0] in page
