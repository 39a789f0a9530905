"""The arithmetic of the score, on answers and diagnoses written by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from blind import correlation, every_model
from blind.arithmetic import calibration, excess, expected_error, log_score, mcnemar, share_interval, shrinkage
from blind.cases import Case, Planted
from blind.document import handbook, truth
from blind.folder import write_problem
from blind.judging import Judged, judge, named
from blind.picture import draw_confusion
from blind.recording import run
from blind.running import Failed, confirmed, diagnosed, reached
from blind.score import NOTHING, purpose, timed_alone
from blind.summary import Checked, Line, confusion, summary

from friction_ocp import load_problem


def item(effect: str, component: str = "motor") -> dict[str, str]:
    """Return an effect at a place, as results have it."""
    return {"effect": effect, "component": component}


def result(verdict: str, *accepted: str, aliases: tuple[tuple[str, ...], ...] = (), **chances: float) -> dict[str, Any]:
    """Return a diagnosis; names are `effect` on the motor or `effect@component`, chances those of the first round."""

    def read(name: str) -> dict[str, str]:
        effect, _, component = name.partition("@")
        return item(effect, component or "motor")

    special = {key: chances.pop(key, 0.0) for key in ("no_effect", "outside_catalogue")}
    causes = [{**read(name.replace("_at_", "@")), "probability": value} for name, value in chances.items()]
    return {
        "verdict": verdict,
        "accepted": [read(name) for name in accepted],
        "alias_sets": [[read(name) for name in members] for members in aliases],
        "rounds": [{"probabilities": special, "causes": causes}],
        "gap": {"shrink": {"overall": 0.9}},
        "remainder": {"component": None},
    }


def answer(kind: str, *planted: str, equivalents: tuple[tuple[str, str], ...] = ()) -> dict[str, Any]:
    """Return an answer with effects on the motor; `equivalents` belong to the first."""
    effects = [{"effect": name, "component": "motor"} for name in planted]
    same = [[(name, "motor")] for name in planted]
    if same:
        same[0] += list(equivalents)
    return {"seed": 1, "index": 2, "kind": kind, "machine": "servo", "planted": effects, "equivalents": same}


def judged(truth: dict[str, Any], said: dict[str, Any], seconds: float = 10.0) -> Judged:
    """Judge one diagnosis."""
    return judge(truth, named(said, seconds))


def test_the_first_effect_named_decides() -> None:
    """Cause and place are right for the first one accepted; what comes with it is spurious."""
    truth = answer("one", "stribeck")
    good = judged(truth, result("explained", "stribeck"))
    assert good.cause and good.place and good.right and good.spurious == 0
    elsewhere = judged(truth, result("explained", "stribeck@load"))
    assert elsewhere.cause and not elsewhere.place and elsewhere.spurious == 1
    late = judged(truth, result("explained", "cogging", "stribeck"))
    assert not late.cause and late.place and late.spurious == 1
    assert not judged(truth, result("no_gap")).cause


def test_an_alias_set_of_two_is_an_answer_and_one_of_three_is_none() -> None:
    """The truth may be the other one of a set of two; a larger set names nothing, though nothing in it is spurious."""
    truth = answer("one", "asymmetry")
    pair_ = judged(truth, result("undecided", "constant_torque", aliases=(("constant_torque", "asymmetry"),)))
    assert pair_.cause and pair_.spurious == 0 and pair_.alias_sizes == (2,)
    wide = judged(truth, result("undecided", "asymmetry", aliases=(("asymmetry", "cogging", "unbalance"),)))
    assert not wide.cause and not wide.place and wide.spurious == 0
    open_ = judged(truth, result("undecided", aliases=(("asymmetry", "constant_torque"),)))
    assert open_.cause and open_.said == "undecided" and open_.promised is None


def test_what_cannot_be_told_apart_counts_as_right() -> None:
    """An answer that is the same equation as the truth has the right cause and place."""
    truth = answer("one", "constant_torque", equivalents=(("sensor_offset", "current"),))
    got = judged(truth, result("explained", "sensor_offset@current", sensor_offset_at_current=0.7, constant_torque=0.2))
    assert got.cause and got.place and got.spurious == 0
    assert got.probability == pytest.approx(0.9) and sum(p for p, _ in got.stated) == pytest.approx(0.9)


def test_controls_outsiders_and_pairs() -> None:
    """Silence is right without an effect, "unknown" outside the catalogue, both of two in any order."""
    assert judged(answer("none"), result("no_gap", no_effect=0.8, cogging=0.2)).probability == pytest.approx(0.8)
    alarm = judged(answer("none"), result("undecided", "cogging"))
    assert alarm.silent is False and alarm.spurious == 1 and not alarm.right
    unknown = judged(answer("outside", "wind"), result("unknown_effect", "cogging", outside_catalogue=1.0))
    assert unknown.unknown and unknown.spurious == 1 and unknown.probability == 1.0
    assert unknown.said == "unknown_effect"
    both = judged(answer("two", "stribeck", "cogging"), result("explained", "cogging", "stribeck"))
    assert both.both and both.cause is None
    half = judged(answer("two", "stribeck", "cogging"), result("unknown_effect", "cogging"))
    assert not half.both and half.spurious == 0


def test_no_result_is_wrong() -> None:
    """A diagnosis that fails is wrong about every kind of case."""
    for kind, planted in (
        ("none", ()),
        ("one", ("cogging",)),
        ("two", ("cogging", "stribeck")),
        ("outside", ("wind",)),
    ):
        assert not judge(answer(kind, *planted), NOTHING).right


def test_share_interval_is_clopper_pearson() -> None:
    """0 of 10 leaves 30.8 %, 10 of 10 leaves 69.2 %: the tails of (1 - x)^10 and x^10 at 2.5 %."""
    assert share_interval(0, 10) == pytest.approx((0.0, 1 - 0.025**0.1))
    assert share_interval(10, 10) == pytest.approx((0.025**0.1, 1.0))


def test_log_score_of_certainty_is_zero() -> None:
    """Certainty about the truth scores 0, a half log(1/2), and a truth never considered is bounded."""
    assert log_score([1.0]) == 0.0
    assert log_score([0.5, 0.5]) == pytest.approx(np.log(0.5))
    assert np.isfinite(log_score([0.0]))


def cases(probability: float, hits: float, count: int, rng: np.random.Generator) -> list[list[tuple[float, bool]]]:
    """Return cases of two possibilities that state `probability` and are true at the rate `hits`."""
    drawn = rng.uniform(size=count) < hits
    return [[(probability, bool(hit)), (1 - probability, not hit)] for hit in drawn]


def test_calibrated_probabilities_lie_in_their_band() -> None:
    """Probabilities that come true at their rate stay inside the band, boasting ones do not."""
    rng = np.random.default_rng(3)
    good = calibration(cases(0.8, 0.8, 300, rng) + cases(0.95, 0.95, 300, rng), np.random.default_rng(0))
    assert all(item.inside for item in good) and expected_error(good) < 0.05
    boasting = calibration(cases(0.95, 0.7, 300, rng), np.random.default_rng(0))
    assert not any(item.inside for item in boasting) and expected_error(boasting) > 0.2


def test_calibration_bands_are_binomial() -> None:
    """With one case per draw the band of n cases is that of a binomial share."""
    band = calibration(cases(0.8, 0.8, 400, np.random.default_rng(1)), np.random.default_rng(0))[-1].band
    assert band == pytest.approx((0.8 - 1.96 * 0.02, 0.8 + 1.96 * 0.02), abs=0.006)


def test_mcnemar_counts_only_the_differing_cases() -> None:
    """8 of 8 differing cases for one side: p = 2 / 2^8, however many agree; no difference is p = 1."""
    ours, theirs = [True] * 8 + [True, False] * 20, [False] * 8 + [True, False] * 20
    assert mcnemar(ours, theirs) == mcnemar(theirs, ours) == pytest.approx(2 / 2**8)
    assert mcnemar(theirs, theirs) == 1.0


def test_shrinkage_is_of_the_excess() -> None:
    """From ratios 3 and 1 to 2 and 0.9 the excess falls from 4 to 1.5, below the floor nothing counts."""
    assert excess([3.0, 1.0]) == 4.0 and excess([2.0, 0.9]) == 1.5
    assert shrinkage([3.0, 1.0], [2.0, 0.9]) == pytest.approx(1 - 1.5 / 4.0)
    assert shrinkage([1.0, 0.9], [2.0, 1.0]) is None


def suite() -> list[Judged]:
    """Return twenty judged cases: ten silent controls, eight effects found, one missed, one unknown recognised."""
    rows = [judged(answer("none"), result("no_gap", no_effect=1.0)) for _ in range(10)]
    rows += [judged(answer("one", "cogging"), result("explained", "cogging", cogging=1.0)) for _ in range(8)]
    rows.append(judged(answer("one", "stribeck"), result("explained", "cogging", cogging=1.0)))
    rows.append(judged(answer("outside", "wind"), result("unknown_effect", outside_catalogue=1.0)))
    return [replace(row, case=f"case-1-{k:03d}") for k, row in enumerate(rows)]


def line(lines: list[Line], start: str) -> Line:
    """Return the line that starts so."""
    return next(entry for entry in lines if entry.what.startswith(start))


def test_the_table_says_what_was_right() -> None:
    """Every requirement gets its count and its mark; what was not asked has none."""
    rows = suite()
    checked = {row.case: Checked(reached=0.85 if row.truth == ("cogging",) else 0.2) for row in rows}
    lines = summary(rows, checked, failed=1)
    assert line(lines, "cause right").measured.startswith("8 of 9") and line(lines, "cause right").passed is False
    assert line(lines, "place right").passed is True
    assert line(lines, "false alarms").measured.startswith("0 of 10") and line(lines, "false alarms").passed is True
    assert line(lines, "outside").passed is True and line(lines, "both").passed is None
    assert line(lines, "spurious").passed is True and line(lines, "spurious").measured.startswith("0.050")
    assert line(lines, "promised").measured.startswith("8 of 9") and line(lines, "promised").passed is False
    assert line(lines, "diagnoses without").passed is False


def test_baselines_are_compared_on_cases_they_can_answer() -> None:
    """The comparison leaves out two effects and outsiders, and needs ten points and p < 0.01."""
    rows = suite()
    marks = {row.case: Checked(baselines={"guessing": row.kind == "none"}) for row in rows}
    compared = line(summary(rows, marks, 0), "10 points better than guessing")
    assert "94.7% against 52.6% on 19 cases" in compared.measured and compared.passed is True
    marks = {row.case: Checked(baselines={"guessing": row.right}) for row in rows}
    assert line(summary(rows, marks, 0), "10 points better").passed is False


def test_the_confusion_matrix_counts_what_was_said_first(tmp_path: Path) -> None:
    """Rows are what was hidden, columns what was said, and the picture is drawn."""
    rows, columns, counts = confusion(suite())
    assert rows == ["cogging", "no effect", "stribeck", "wind"]
    assert counts[rows.index("stribeck"), columns.index("cogging")] == 1
    assert counts[rows.index("no effect"), columns.index("no_gap")] == 10 and counts.sum() == 20
    draw_confusion(rows, columns, counts, {"wind"}, tmp_path / "confusion.png")
    assert (tmp_path / "confusion.png").stat().st_size > 5000


def test_a_command_that_fails_says_why(tmp_path: Path) -> None:
    """A diagnosis that ends without a result carries the words of the command."""
    with pytest.raises(Failed, match=r"exit status 1.*missing\.yaml"):
        diagnosed(tmp_path / "missing.yaml", tmp_path / "out")


def test_what_took_too_long_beside_another_is_timed_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In as many processes as worked on both, in a folder of its own; what fails there keeps its time."""
    asked = list[tuple[Path, Path, int]]()

    def diagnosed_again(problem: Path, folder: Path, workers: int) -> tuple[dict[str, Any], float]:
        asked.append((problem.relative_to(tmp_path), folder.relative_to(tmp_path), workers))
        if len(asked) > 1:
            raise Failed("no answer within 900 s")
        return {}, 150.0

    monkeypatch.setattr("blind.score.diagnosed", diagnosed_again)
    row = judged(answer("one", "cogging"), result("explained", "cogging"), 230.0)
    assert timed_alone(row, tmp_path, 2) == replace(row, seconds=150.0)
    assert timed_alone(row, tmp_path, 2) == row
    assert asked[0] == (Path("cases", row.case, "problem.yaml"), Path("alone", row.case), 2)


@pytest.mark.parametrize(
    ("left", "found", "stands_in"),
    [(0.98, True, True), (0.7, False, True), (1.2, True, False), (1.2, False, False)],
)
def test_a_rival_stands_in_where_nothing_shows_above_the_noise(
    left: float, found: bool, stands_in: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether it had to be added for that or not; the floors of the problem stay as stated."""
    case = Case(5, 1, "one", "servo", (Planted("unbalance", "motor", 0.3, 7, 20.0),))
    problem = write_problem(tmp_path, case.make_machine(), truth(case.make_machine().document), {}, {})
    asked = list[dict[str, Any]]()

    def diagnosed_again(path: Path, folder: Path) -> tuple[dict[str, Any], float]:
        asked.append(yaml.safe_load(path.read_text(encoding="utf-8")))
        said = result("explained", *(["asymmetry"] if found else []))
        said["gap"]["after"] = {"motor_position": {"noise_ratio": left}, "current": {"noise_ratio": 0.5}}
        return said, 1.0

    monkeypatch.setattr("blind.running.diagnosed", diagnosed_again)
    accepted = [("unbalance", "motor"), ("cogging", "drive")]
    rival, leader = ("asymmetry", "motor"), ("unbalance", "motor")
    assert confirmed(case, problem, accepted, rival, leader, tmp_path / "quiet") is stands_in
    assert asked[0]["diagnosis"] == {"effects": ["asymmetry at motor", "cogging"]}
    assert asked[0]["channels"] == yaml.safe_load(problem.read_text(encoding="utf-8"))["channels"]


def test_shrinkage_is_measured_on_fresh_recordings(tmp_path: Path) -> None:
    """The true model closes the gap of one that lacks unbalance; the model that lacks it closes nothing."""
    case = Case(5, 1, "one", "servo", (Planted("unbalance", "motor", 0.3, 7, 20.0),))
    machine = case.make_machine()
    document = truth(machine.document)
    torque, phase = case.hidden().plant.shafts[0].gravity
    problems = {}
    for name in ("base", "augmented"):
        problems[name] = write_problem(tmp_path / name, machine, document, {}, {})
        problems[name] = problems[name].rename(problems[name].with_name(f"{name}.yaml"))
        document["drive"]["shafts"][0]["gravity"] = {"torque": torque, "phase": phase}
    result = {"gap": {"horizon_s": None}}
    gained = reached(case, result, problems["base"], problems["augmented"], tmp_path / "fresh")
    floor_of_a_free_run = 0.02
    assert gained == pytest.approx(1.0, abs=floor_of_a_free_run)
    assert reached(case, result, problems["base"], problems["base"], tmp_path / "fresh") == 0.0


@pytest.mark.parametrize("effect", [None, "polyline_break"])
def test_correlation_finds_what_is_plain(effect: str | None, tmp_path: Path) -> None:
    """The first baseline names a strong break of slope in a closed loop, and nothing where nothing is hidden."""
    planted = () if effect is None else (Planted(effect, "motor", 0.5, 7, 20.0),)
    case = Case(5, 4, "one", "robot", planted)
    machine = replace(case.make_machine(), samples=3000)
    recorded = {kind: run(machine, case.hidden(), kind, (5, k))[0] for k, kind in enumerate(("steps", "moves"))}
    path = write_problem(tmp_path, machine, truth(machine.document), recorded, {})
    found = correlation.answer(load_problem(path), np.random.default_rng(0))
    assert (found and found[0]) == effect


@pytest.mark.slow
def test_the_lowest_left_out_error_finds_what_is_plain(tmp_path: Path) -> None:
    """The second baseline names unbalance of a servo's motor among three effects."""
    case = Case(5, 1, "one", "servo", (Planted("unbalance", "motor", 0.3, 7, 20.0),))
    machine = replace(case.make_machine(), samples=800)
    recorded = {kind: run(machine, case.hidden(), kind, (5, k))[0] for k, kind in enumerate(("steps", "moves"))}
    document = handbook(machine.document, np.random.default_rng(0))
    document["diagnosis"] = {"effects": ["unbalance", "quadratic_drag", "constant_torque"]}
    path = write_problem(tmp_path, machine, document, recorded, {})
    assert every_model.answer(load_problem(path)) == ("unbalance", "motor")


def test_seeds_have_a_purpose() -> None:
    """Small seeds develop, dates report, and nothing else is taken."""
    assert purpose(7) == "development" and purpose(20270115) == "report"
    for seed in (0, 1000, 123456, 20271399):
        with pytest.raises(ValueError, match="YYYYMMDD"):
            purpose(seed)
