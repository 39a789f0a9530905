"""Earlier additions are examined again, free runs of all models are judged over the same time, bristles are damped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import COULOMB, INERTIA, TORQUE_CONSTANT, VISCOUS, axis, write_case
from plant import PlantFriction, PlantRipple

from friction_ocp.diagnosis import reexamine, refit
from friction_ocp.diagnosis.bench import Bench, open_bench
from friction_ocp.diagnosis.benchmark import Benchmark
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis.excess import excess
from friction_ocp.diagnosis.held_out import folds
from friction_ocp.diagnosis.reexamine import exchanged
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.rival import Rival
from friction_ocp.diagnosis.screen import screen
from friction_ocp.diagnosis.select import Round, choose
from friction_ocp.drive.parts import Gravity
from friction_ocp.effects.effect import Key
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.horizon import fits_free_run, horizon, judged_alike
from friction_ocp.estimation.model import prepare, with_drive
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.problem_file.write import write_problem
from friction_ocp.statistics.execution import Execution

HERE = Execution(InProcess())
LEVEL = 0.01


def rival(bench: Bench, key: Key) -> Rival:
    """Return a candidate refitted, with what it gains on recordings left out."""
    found = screen(bench.current, effects()[key[0]], key[1], bench.clues)
    assert found is not None
    fitted = completed(quick_refit(bench.current, found))
    return Rival.of(found, fitted, -Benchmark(bench.current).dearer(fitted))


def round_of(bench: Bench, keys: list[Key]) -> Round:
    """Return the round in which the first of some candidates was accepted."""
    rivals = [rival(bench, key) for key in keys]
    choice = choose(rivals, bench.current.blocks, len(folds(bench.current)), LEVEL, np.random.default_rng(0))
    before = bench.current
    return Round((), choice, before, excess(before.linear.rows, bench.current.blocks), rivals[0])


@pytest.mark.slow
def test_a_rival_takes_the_place_of_what_stood_in_for_it(tmp_path: Path) -> None:
    """A break accepted for quadratic drag goes when cogging is in beside it; what is right already stays."""
    plant = axis(law="quadratic", quadratic=1e-5)
    cogging = PlantRipple(3.1, (0.05 * TORQUE_CONSTANT,), (0.0,))
    plant = replace(plant, motors=(replace(plant.motors[0], cogging=cogging),))
    names = ("polyline_break", "quadratic_drag", "cogging")
    bench = open_bench(load_problem(write_case(tmp_path, plant, effects=names)), HERE)
    wrong, right, other = ((name, "motor") for name in names)
    rounds = list[Round]()
    for keys in ([wrong, right], [other]):
        rounds.append(round_of(bench, keys))
        accepted = rounds[-1].accepted
        assert accepted is not None
        bench = bench.at(accepted.fitted)
    rng = np.random.default_rng(0)
    current, told, kept = exchanged(bench, rounds, [wrong, other], LEVEL, rng, HERE)
    assert kept == [right, other] and current.cost < bench.current.cost
    first = told[0]
    assert first.accepted is not None and first.accepted.key == right
    assert [item.key for item in first.choice.aliases] == [right] and first.choice.rivals[0].key == right
    assert sum(first.choice.probabilities) == pytest.approx(sum(rounds[0].choice.probabilities))
    after = bench.at(current)
    again = exchanged(after, told, kept, LEVEL, rng, HERE)
    assert again[2] == kept and again[0] is after.current


@pytest.mark.slow
def test_a_more_general_shape_goes_with_the_effect_to_another_place(tmp_path: Path) -> None:
    """The same effect elsewhere has all of its shape; another effect does not take it on."""
    bench = open_bench(load_problem(write_case(tmp_path, axis(), effects=("cogging", "asymmetry"))), HERE)
    wave, other = ("cogging", "motor"), ("asymmetry", "motor")
    added = round_of(bench, [wave])
    rounds = [added, round_of(bench, [other]), added, round_of(bench, [other])]
    assert reexamine._is_open(rounds, 0, [wave, other, wave])  # pyright: ignore[reportPrivateUsage]
    assert not reexamine._is_open(rounds, 2, [wave, other, wave])  # pyright: ignore[reportPrivateUsage]
    assert not reexamine._is_open(rounds, 0, [other])  # pyright: ignore[reportPrivateUsage]
    swapped = reexamine._swapped  # pyright: ignore[reportPrivateUsage]
    assert swapped([wave, other, wave], wave, ("cogging", "arm")) == [("cogging", "arm"), other, ("cogging", "arm")]
    assert swapped([wave, other, wave], wave, ("torque_ripple", "motor")) == [("torque_ripple", "motor"), other]
    assert swapped([wave, other], other, ("stribeck", "motor")) == [wave, ("stribeck", "motor")]
    assert swapped([other, wave, wave], other, wave) == [wave, wave]


def test_gravity_that_is_added_does_not_change_over_what_time_runs_are_judged(tmp_path: Path) -> None:
    """It would hold a drive that drifts; the file of the augmented model states the time, for whoever repeats it."""
    path = write_case(tmp_path, axis())
    model = prepare(load_problem(path))
    drive = model.problem.drive
    heavy = replace(drive, shafts=(replace(drive.shafts[0], gravity=Gravity(0.01, 0.3)),))
    span = horizon(model)
    assert span is not None and horizon(with_drive(model, heavy)) is None
    alike = with_drive(judged_alike(model), heavy)
    assert horizon(alike) == span and fits_free_run(alike) == fits_free_run(model)
    (tmp_path / "augmented.yaml").write_text(write_problem(path, heavy, {}, tmp_path, horizon_s=span))
    assert load_problem(tmp_path / "augmented.yaml").estimation.horizon_s == pytest.approx(span)


@pytest.mark.slow
def test_bristles_are_found_with_their_damping(tmp_path: Path) -> None:
    """A contact that gives way by a tenth of a radian, a third damped: stiffness and damping are those of the plant."""
    stiffness = 10.0 * COULOMB
    damping = 0.6 * float(np.sqrt(stiffness * INERTIA))
    law = PlantFriction("lugre", tau_c=COULOMB, viscous=VISCOUS, sigma0=stiffness, sigma1=damping)
    plant = axis()
    plant = replace(plant, shafts=(replace(plant.shafts[0], friction=law),))
    path = write_case(tmp_path, plant, effects=("presliding", "stribeck", "drive_lag", "unbalance"))
    found = diagnose(load_problem(path))
    assert found.accepted == (("presliding", "motor"),) and found.verdict == "explained"
    assert found.final.values["motor.friction.bristle.sigma0"] == pytest.approx(stiffness, rel=0.05)
    assert found.final.values["motor.friction.bristle.sigma1"] == pytest.approx(damping, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("first", ["constant_torque", "unbalance"])
def test_rivals_are_weighed_again_beside_what_came_later(first: str, tmp_path: Path) -> None:
    """Dry friction that differs by direction remains what a constant torque may be; gravity goes, accepted or not."""
    plant = axis(tau_c=(1.1 * COULOMB, 0.9 * COULOMB))
    cogging = PlantRipple(3.1, (0.2 * TORQUE_CONSTANT,), (0.0,))
    plant = replace(plant, motors=(replace(plant.motors[0], cogging=cogging),))
    names = ("constant_torque", "asymmetry", "unbalance", "cogging")
    bench = open_bench(load_problem(write_case(tmp_path, plant, effects=names)), HERE)
    constant, differing, gravity, other = ((name, "motor") for name in names)
    rounds, accepted = list[Round](), list[Key]()
    alike = sorted([constant, differing, gravity], key=lambda key: key[0] != first)
    for keys in (alike, [other]):
        rounds.append(round_of(bench, keys))
        done = rounds[-1].accepted
        assert done is not None
        bench, accepted = bench.at(done.fitted), [*accepted, done.key]
    assert gravity in [item.key for item in rounds[0].choice.aliases]
    current, told, kept = exchanged(bench, rounds, accepted, LEVEL, np.random.default_rng(0), HERE)
    choice = told[0].choice
    assert {item.key for item in choice.aliases} == {item.key for item in choice.same} == {constant, differing}
    assert kept == [choice.rivals[0].key, other] == [choice.aliases[0].key, other]
    chances = dict(zip((item.key for item in choice.rivals), choice.probabilities, strict=True))
    assert chances[gravity] < LEVEL < chances[differing] < chances[constant]
    assert sum(chances.values()) == pytest.approx(sum(rounds[0].choice.probabilities))
    assert current.cost < rounds[0].before.cost
    held = rounds[0].accepted
    assert held is not None
    worthless = replace(held, gains=-held.gains)
    rivals = tuple(worthless if item is held else item for item in rounds[0].choice.rivals)
    rounds[0] = replace(rounds[0], accepted=worthless, choice=replace(rounds[0].choice, rivals=rivals))
    _, told, _ = exchanged(bench, rounds, accepted, LEVEL, np.random.default_rng(0), HERE)
    assert sum(told[0].choice.probabilities) == pytest.approx(sum(rounds[0].choice.probabilities))


@pytest.mark.slow
def test_what_may_grow_is_no_rival_of_itself(tmp_path: Path) -> None:
    """Cogging, which may have overtones, keeps its probability when it is weighed again beside Stribeck friction."""
    plant = axis(law="stribeck", tau_s=1.5 * COULOMB, omega_s=6.0)
    cogging = PlantRipple(3.1, (0.2 * TORQUE_CONSTANT,), (0.0,))
    plant = replace(plant, motors=(replace(plant.motors[0], cogging=cogging),))
    names = ("cogging", "quadratic_drag", "stribeck")
    bench = open_bench(load_problem(write_case(tmp_path, plant, effects=names)), HERE)
    waves, drag, falling = ((name, "motor") for name in names)
    rounds, accepted = list[Round](), list[Key]()
    for keys in ([waves, drag], [falling]):
        rounds.append(round_of(bench, keys))
        done = rounds[-1].accepted
        assert done is not None
        bench, accepted = bench.at(done.fitted), [*accepted, done.key]
    _, told, kept = exchanged(bench, rounds, accepted, LEVEL, np.random.default_rng(0), HERE)
    choice = told[0].choice
    assert kept == [waves, falling]
    assert sum(choice.probabilities) == pytest.approx(sum(rounds[0].choice.probabilities))
    assert choice.rivals[0].key == waves and choice.probabilities[0] > 1.0 - LEVEL


@pytest.mark.slow
def test_what_has_its_more_general_shape_may_still_do_the_work_of_two(tmp_path: Path) -> None:
    """Cogging once a turn, with overtones, of which unbalance had taken the first order and a wave the others."""
    plant = axis()
    cogging = PlantRipple(2.0 * np.pi, (0.03, 0.02, 0.01), (0.01, 0.0, 0.01))
    plant = replace(plant, motors=(replace(plant.motors[0], cogging=cogging),))
    names = ("unbalance", "cogging")
    bench = open_bench(load_problem(write_case(tmp_path, plant, effects=names)), HERE)
    weight, wave = ((name, "motor") for name in names)
    rounds, accepted = list[Round](), list[Key]()
    for keys in ([weight, wave], [wave], [wave]):
        rounds.append(round_of(bench, keys))
        done = rounds[-1].accepted
        assert done is not None
        bench, accepted = bench.at(done.fitted), [*accepted, done.key]
    current, _, kept = exchanged(bench, rounds, accepted, LEVEL, np.random.default_rng(0), HERE)
    assert kept == [wave, wave] and "motor.gravity.torque" not in current.values
    assert not excess(current.linear.rows, current.blocks).significant(LEVEL)


@pytest.mark.parametrize(
    ("costs", "ends", "wanted"),
    [
        ((100.0, 104.0), {"b": 99.5}, [("b", "a"), ("a", "b")]),
        ((100.0, 104.0), {"b": 100.0}, [("b", "a")]),
        ((104.0, 100.0), {"a": 101.0}, [("a", "b")]),
        ((100.0, 130.0), {}, []),
    ],
)
def test_what_explains_nearly_as_much_begins_where_the_better_has_its_nodes(
    costs: tuple[float, float], ends: dict[str, float], wanted: list[tuple[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the other way round once that is better; of 1000 that a model costs without either."""
    asked = list[tuple[str, str]]()

    def model(name: str, cost: float) -> Any:
        return SimpleNamespace(name=name, cost=cost, linear=SimpleNamespace(point=SimpleNamespace(nodes=name)))

    def begun(fitted: Any, nodes: str) -> Any:
        asked.append((fitted.name, nodes))
        end = ends.get(fitted.name, fitted.cost)
        return model(fitted.name, end) if end < fitted.cost else fitted

    monkeypatch.setattr(refit, "begun_beside", begun)
    one, other = refit.levelled(model("a", costs[0]), model("b", costs[1]), 1000.0)
    assert asked == wanted
    assert (one.name, other.name) == ("a", "b")
    assert (one.cost, other.cost) == (ends.get("a", costs[0]), ends.get("b", costs[1]))
