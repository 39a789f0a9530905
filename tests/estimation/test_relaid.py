"""Gaps between segments are those that the found parameters call for: an answer does not hang on the guesses."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from axes import COULOMB, INERTIA, VISCOUS, axis, measured_axis, problem
from test_division import model_with, start_of

from friction_ocp.estimation import fit as fitting
from friction_ocp.estimation.division import (
    are_alike,
    cut_at,
    divided,
    divided_afresh,
    is_divided,
    moved_share,
    reweighed,
)
from friction_ocp.estimation.fit import fit, settled
from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.model import Model, laid_for, prepare_fit
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases, silent
from friction_ocp.estimation.rounds import Fitted
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.statistics.optimum import Optimum

NOISE = {"motor": 3e-3}
"""N m/sqrt(Hz): large enough that what a gap may be counts."""


def axis_from(factor: float) -> Model:
    """Return a noisy axis whose inertia is guessed wrong by a factor, fitted in relaxed segments."""
    law = CoulombViscous(Free(COULOMB, 0.0, 1.0), Free(VISCOUS, 0.0, 0.1))
    inertia = Free(factor * INERTIA, 0.05 * INERTIA, 20.0 * INERTIA)
    return prepare_fit(problem(axis(law, inertia=inertia), measured_axis(5), fit="relaxed", process_noise=NOISE))


def joined_pendulum() -> Model:
    """Return an inverted pendulum that is fitted in relaxed segments."""
    model = model_with(np.pi)
    options = replace(model.problem.estimation, fit="relaxed")
    return replace(model, problem=replace(model.problem, estimation=options))


@pytest.fixture(scope="module")
def answers() -> list[tuple[Model, Fitted]]:
    """Fits from guesses of the inertia that are ten times apart."""
    return [settled(axis_from(factor)) for factor in (0.3, 3.0)]


def test_the_answer_does_not_hang_on_the_guess(answers: list[tuple[Model, Fitted]]) -> None:
    """Objective and parameters agree, though one fit with the gaps of the guesses would not."""
    (_, first), (_, second) = answers
    assert first.solution.objective == pytest.approx(second.solution.objective, rel=1e-3)
    assert first.solution.point.theta == pytest.approx(second.solution.point.theta, rel=1e-3)
    for_guesses = [fit(axis_from(factor)).solution.objective for factor in (0.3, 3.0)]
    assert for_guesses[0] != pytest.approx(for_guesses[1], rel=1e-2)


def test_gaps_are_those_of_the_answer(answers: list[tuple[Model, Fitted]]) -> None:
    """What torque noise does to the speed in a gap is its density over the inertia that was found."""
    for model, fitted in answers:
        found = dict(zip(model.space.names, fitted.solution.point.theta, strict=True))
        assert model.found["motor.inertia"] == pytest.approx(found["motor.inertia"], rel=0.01)
        assert are_alike(
            reweighed(laid_for(model, found), fitted.program), fitted.program, fitted.solution.point.theta, 0.03
        )
        assert not are_alike(
            reweighed(laid_for(model, {}), fitted.program), fitted.program, fitted.solution.point.theta, 0.5
        )


def test_gaps_go_with_the_optimum(answers: list[tuple[Model, Fitted]]) -> None:
    """The optimum remembers through a file what gaps were laid for, and weighs them so again."""
    model, fitted = answers[0]
    kept = Optimum.read(json.loads(json.dumps(Optimum.of(model, fitted).document(), allow_nan=False)))
    again = kept.settled(axis_from(0.3))
    assert kept.fitted(again).program.objective(kept.solution.point) == pytest.approx(fitted.solution.objective)


def test_cuts_go_with_the_optimum() -> None:
    """Segments that were cut where differences grow are cut there again."""
    model = joined_pendulum()
    program, point = divided(model, *start_of(model))
    end = Fitted(Solution(point, program.objective(point), 1, True, "test"), program)
    kept = Optimum.read(json.loads(json.dumps(Optimum.of(model, end).document(), allow_nan=False)))
    again = kept.fitted(kept.settled(joined_pendulum())).program
    assert is_divided(model, again)
    assert np.array_equal(again.segments[0].first, program.segments[0].first)
    assert again.objective(point) == pytest.approx(program.objective(point))


def test_cuts_are_made_afresh_along_the_motion_at_hand() -> None:
    """What was cut too finely on the way is cut as the motion asks for, its nodes where the motion passes."""
    model = model_with(np.pi)
    program, start = start_of(model)
    expected, _ = divided(model, program, start)
    finer = cut_at(model, program, [np.arange(int(program.segments[0].first[-1]) + 1)])
    point = finer.point_along(expected, expected.point_along(program, start))
    after, moved = divided_afresh(model, finer, point)
    assert np.array_equal(after.segments[0].first, expected.segments[0].first)
    assert all(begin < end for begin, end in pairwise(after.segments[0].first))
    assert moved.nodes[0] == pytest.approx(point.nodes[0][after.segments[0].first[:-1]])


def stand_still(monkeypatch: pytest.MonkeyPatch) -> list[Program]:
    """Let solvers stay where they begin, and gaps as they are; return the list of what is solved."""
    solved: list[Program] = []

    def stays(program: Program, point: Point, *rest: Any) -> Solution:
        del rest
        solved.append(program)
        return Solution(point, program.objective(point), 1, True, "test")

    def same(model: Model, *rest: Any) -> Model:
        del rest
        return model

    def solver(*rest: Any) -> Any:
        del rest
        return stays

    monkeypatch.setattr(fitting, "may_be_cut", solver)
    monkeypatch.setattr(fitting, "laid_for", same)
    monkeypatch.setattr(fitting, "final_solver", solver)
    return solved


def test_cuts_that_are_not_where_they_belong_are_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Behind the turns that always cut, too; those that are nearly there are kept."""
    model = joined_pendulum()
    whole, start = start_of(model)
    cut, _ = divided(model, whole, start)
    assert moved_share(cut, cut) == 0.0
    assert moved_share(whole, cut) == moved_share(cut, whole) > fitting.SETTLED

    stand_still(monkeypatch)
    end = Fitted(Solution(start, whole.objective(start), 1, True, "test"), whole)
    _, after = fitting.relaid(model, end, Phases(silent, 1), fitting.CUTS)
    assert moved_share(after.program, cut) == 0.0
    monkeypatch.setattr(fitting, "SETTLED", 1.0)
    _, kept = fitting.relaid(model, end, Phases(silent, 1), fitting.CUTS)
    assert moved_share(kept.program, whole) == 0.0


def test_cuts_that_come_and_go_come_to_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the motion with one set of cuts asks for another, and the other way round, none is taken twice."""
    model = joined_pendulum()
    whole, start = start_of(model)
    cut, there = divided(model, whole, start)
    solved = stand_still(monkeypatch)

    def turned(model: Model, program: Program, point: Point) -> tuple[Program, Point]:
        del model, point
        return (whole, start) if moved_share(program, cut) == 0.0 else (cut, there)

    monkeypatch.setattr(fitting, "divided_afresh", turned)
    phases = Phases(silent, 1)
    first = fitting.final_solver(model)(whole, start, fitting.limits(model), phases.begin("before"))
    fitting.relaid(model, Fitted(first, whole), phases, fitting.CUTS)
    assert len(solved) == 2


def test_starts_compete_with_the_same_gaps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start at a small inertia, which would allow wide gaps, has those of the guesses."""
    seen: list[Model] = []

    def noted(model: Model, phases: Phases) -> Fitted:
        seen.append(model)
        return once(model, phases)

    once = fitting._fit_once  # pyright: ignore[reportPrivateUsage]
    monkeypatch.setattr(fitting, "_fit_once", noted)
    model = axis_from(1.0)
    options = replace(model.problem.estimation, starts=3)
    fit(replace(model, problem=replace(model.problem, estimation=options)))
    inertias = {item.space.guess[item.space.names.index("motor.inertia")] for item in seen}
    assert len(inertias) == 3
    assert all(np.array_equal(item.nominal, model.space.guess) for item in seen)
