"""Models compared by short predictions from the measured motion, where segments that noise joins lead nowhere."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import axis, diagnosed, write_case

from friction_ocp.diagnosis import predicted
from friction_ocp.diagnosis.base_fit import fit_base, predicting
from friction_ocp.diagnosis.bench import open_bench, open_predicting
from friction_ocp.diagnosis.crew import Crew
from friction_ocp.diagnosis.footing import Footing
from friction_ocp.diagnosis.options import considered
from friction_ocp.diagnosis.polishing import polished
from friction_ocp.diagnosis.search import Search
from friction_ocp.estimation.model import prepare, with_drive
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

sys.path.insert(0, str(Path(__file__).parents[2] / "problems" / "benchmarks"))
import gaps

HERE = Execution(InProcess())
EFFECTS = ("stribeck", "unbalance")
RISE = {"law": "stribeck", "tau_s": 0.3, "omega_s": 0.5}


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the problem of an axis whose friction rises to thrice its level near standstill, and whose model's does
    not."""
    return write_case(tmp_path_factory.mktemp("predicted"), axis(**RISE))


def test_predictions_have_no_nodes_and_begin_where_the_measured_motion_is(path: Path) -> None:
    """Whatever nodes a point has been given."""
    fitted = predicting(fit_base(prepare(load_problem(path))))
    program, point = fitted.linear.program, fitted.linear.point
    assert program.without_nodes
    assert not fitted.footing.joined
    starts = [start for start, _ in program.measured_starts(point.theta)]
    moved = replace(point, nodes=tuple(own + 1.0 for own in point.nodes))
    for own, again, start in zip(point.nodes, program.placed(moved).nodes, starts, strict=True):
        np.testing.assert_array_equal(own, start)
        np.testing.assert_array_equal(again, start)


def test_nodes_that_are_variables_stay_where_a_point_has_them(path: Path) -> None:
    """Only the others are placed."""
    fitted = fit_base(prepare(load_problem(path)))
    program, point = fitted.linear.program, fitted.linear.point
    for own, placed in zip(point.nodes, program.placed(point).nodes, strict=True):
        np.testing.assert_array_equal(own, placed)


@pytest.mark.slow
def test_predictions_tell_what_is_missing(path: Path) -> None:
    """A search on them ends at the effect of the plant, its size near the truth."""
    problem = load_problem(path)
    bench = open_predicting(open_bench(problem, HERE), HERE)
    found = Crew(bench, HERE, 1, lambda what, share: None).screened([("stribeck", "motor"), ("unbalance", "motor")])
    assert [item.effect for item in found] == ["stribeck", "unbalance"]
    search = Search(bench, HERE, considered(problem), 0.01, lambda what, share: None)
    search.go()
    assert set(search.accepted) == {("stribeck", "motor")}
    values = search.bench.current.values
    assert values["motor.friction.added.stribeck.torque"] == pytest.approx(RISE["tau_s"] - 0.1, rel=0.2)
    by_segments = Search(open_bench(problem, HERE), HERE, considered(problem), 0.01, lambda what, share: None)
    again = predicted._carried_back(by_segments, search, HERE)
    assert again is not None and again.bench.base.footing.joined and again.accepted[:1] == [("stribeck", "motor")]
    torque = again.bench.current.values["motor.friction.added.stribeck.torque"]
    assert torque == pytest.approx(RISE["tau_s"] - 0.1, rel=0.1)


def test_they_are_asked_where_a_search_found_nothing_and_its_base_is_astray(path: Path) -> None:
    """Not where something was found with which it is astray no more."""
    search = Search(open_bench(load_problem(path), HERE), HERE, considered(load_problem(path)), 0.01, lambda *_: None)
    base = search.bench.base
    assert search.lost_its_way == base.astray
    search.accepted.append(("stribeck", "motor"))
    assert search.lost_its_way == base.astray
    search.bench.__dict__["current"] = SimpleNamespace(astray=False)
    assert not search.lost_its_way


@pytest.mark.parametrize(
    ("named", "after", "counts"), [("stribeck", 1.2, True), ("stribeck", 1.8, False), ("unbalance", 1.2, False)]
)
def test_what_predictions_name_instead_counts_if_they_miss_little(
    named: str, after: float, counts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lost free runs have found an unbalance; predictions missed as much as noise has, and miss less or as much now."""
    monkeypatch.setattr(predicted, "innovations", lambda ratio: SimpleNamespace(ratio=ratio))
    known = SimpleNamespace(current=SimpleNamespace(lost=True))
    lost: Any = SimpleNamespace(accepted=[("unbalance", "motor")], bench=known)
    bench = SimpleNamespace(base=2.0, current=after)
    other: Any = SimpleNamespace(accepted=[(named, "motor")], bench=bench)
    assert predicted._tells_otherwise(lost, other) == counts


def test_of_segments_counts_what_predictions_name_if_it_predicts_better(path: Path) -> None:
    """Better than what segments had named does, fitted to predictions itself."""
    bench = open_bench(load_problem(path), HERE)
    predicting_bench = open_predicting(bench, HERE)
    base, crew = predicting_bench.base, Crew(bench, HERE, 1, lambda what, share: None)
    drives = {item.effect: item.augmentation.drive for item in crew.screened([(name, "motor") for name in EFFECTS])}
    models = {name: with_drive(base.model, drive) for name, drive in drives.items()}
    fits = {name: polished(model, base.footing, model.space.guess, None) for name, model in models.items()}
    assert fits["stribeck"].cost < fits["unbalance"].cost
    for own, others, counts in [("unbalance", "stribeck", True), ("stribeck", "unbalance", False)]:
        known = bench.base
        stood = polished(models[own], known.footing, models[own].space.guess, None)
        search: Any = SimpleNamespace(accepted=[(own, "motor")], bench=SimpleNamespace(current=stood))
        seat = SimpleNamespace(base=base, current=fits[others])
        other: Any = SimpleNamespace(accepted=[(others, "motor")], bench=seat)
        assert predicted._tells_otherwise(search, other) == counts


@pytest.mark.parametrize(("effect", "leads"), [("stribeck", True), ("unbalance", False)])
def test_segments_go_on_from_predictions_where_they_come_back_to_the_recordings(
    path: Path, effect: str, leads: bool
) -> None:
    """With the effect of the plant; with another one they stay astray."""
    bench = open_bench(load_problem(path), HERE)
    base, crew = open_predicting(bench, HERE).base, Crew(bench, HERE, 1, lambda what, share: None)
    (item,) = crew.screened([(effect, "motor")])
    model = with_drive(base.model, item.augmentation.drive)
    named: Any = SimpleNamespace(bench=SimpleNamespace(current=polished(model, base.footing, model.space.guess, None)))
    search: Any = SimpleNamespace(bench=bench)
    assert predicted._leads_back(search, named) == leads


@pytest.mark.parametrize(("accepted", "astray", "asked"), [(0, True, True), (1, False, False), (1, True, True)])
def test_they_are_asked_where_a_model_stays_far_off(accepted: int, astray: bool, asked: bool) -> None:
    """With what was added to one that had gone astray."""
    base = SimpleNamespace(astray=True, footing=SimpleNamespace(predicted=False))
    bench = SimpleNamespace(base=base, current=SimpleNamespace(astray=astray))
    search: Any = SimpleNamespace(bench=bench, accepted=[("stribeck", "motor")] * accepted)
    assert Search.lost_its_way.fget(search) == asked  # pyright: ignore[reportOptionalCall]


def test_free_runs_and_predictions_are_not_joined() -> None:
    """Segments are, unless each is a prediction of its own."""
    common = ({}, {}), (np.ones(1), (), ())
    of = {length: Footing(*common[0], length, *common[1]) for length in (None, 0.1)}
    assert [of[None].joined, of[0.1].joined, replace(of[0.1], predicted=True).joined] == [False, True, False]


@pytest.mark.slow
def test_stribeck_friction_of_a_telescope_is_found_from_far_away(tmp_path: Path) -> None:
    """Its friction rises to seven times its level, and the axis is unstable there: only predictions lead on."""
    found = diagnosed(gaps.aries_axis("stribeck", tmp_path))
    assert found["by_predictions"]
    assert [(item["effect"], item["component"]) for item in found["accepted"]] == [("stribeck", "axis")]
    values = {name: item["value"] for name, item in found["accepted"][0]["parameters"].items()}
    assert values["axis.friction.added.stribeck.torque"] == pytest.approx(1541.7 - 200.6, rel=0.25)
    assert values["axis.friction.added.stribeck.delta"] == pytest.approx(0.85, rel=0.1)
    (added,) = [item for item in found["rounds"] if item["accepted"]]
    assert added["causes"][0]["probability"] > 0.5  # its free runs get no closer, and are not asked
