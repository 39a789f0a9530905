"""Ways of a fit compete: the best end counts, whichever way led there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import COULOMB, INERTIA, VISCOUS, axis, measured_axis, problem

from friction_ocp.estimation import rounds
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, Watch, solve_gauss_newton
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases, silent
from friction_ocp.estimation.rounds import Plan, joined, staged
from friction_ocp.estimation.stages import WIDTHS
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free


@pytest.fixture(scope="module")
def model() -> Model:
    """A run whose noise is stated a hundred times too small: no end looks like noise."""
    law = CoulombViscous(Free(0.5 * COULOMB, 0.0, 1.0), Free(2.0 * VISCOUS, 0.0, 0.1))
    drive = axis(law, inertia=Free(2.0 * INERTIA))
    outputs = [replace(sensor, noise_std=1e-4) if sensor.role == "output" else sensor for sensor in drive.channels]
    return prepare(problem(replace(drive, channels=tuple(outputs)), measured_axis(5), process_noise={"motor": 1e-4}))


def test_the_direct_way_counts_where_it_ends_best(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """An end above the noise is kept beside those of smoothed friction, and is first where they end above it."""

    def direct_is_best(program: Program, start: Point, limits: Tolerances, watch: Watch) -> Solution:
        end = solve_gauss_newton(program, start, limits, watch)
        return end if not seen else replace(end, objective=2.0 * end.objective)

    def noted(program: Program, *rest: object) -> list[Solution]:
        ends = race(program, *rest)  # type: ignore[arg-type]
        seen.append(ends[0].objective)
        return ends

    def chosen(_: Model) -> rounds.Solve:
        return direct_is_best

    seen: list[float] = []
    race = rounds.race
    monkeypatch.setattr(rounds, "race", noted)
    monkeypatch.setattr(rounds, "final_solver", chosen)
    ends = staged(model, Plan(joined, WIDTHS[1:], True), Phases(silent, 1))
    objectives = [fitted.solution.objective for fitted in ends]
    assert len(seen) == 1 + len(WIDTHS[1:])
    assert objectives[0] == seen[0]
    assert objectives == sorted(objectives) and len(objectives) > 1


def test_starts_that_lead_to_one_end_are_followed_once(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sharper rounds begin once from where several starts ended alike."""
    counts: list[int] = []
    race = rounds.race

    def counted(program: Program, points: list[Point], *rest: object) -> list[Solution]:
        counts.append(len(points))
        return race(program, points, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(rounds, "race", counted)
    staged(model, Plan(joined, WIDTHS[1:], True), Phases(silent, 1))
    assert counts == [1, 2, 1]


def test_ends_that_differ_are_all_followed() -> None:
    """Equal objectives at other parameters, and like parameters at another objective, are other ends."""
    nodes = (np.zeros((1, 2)),)
    places = [(1.0, (1.0, 2.0)), (1.00001, (1.001, 2.001)), (1.00001, (1.5, 2.0)), (1.1, (1.0, 2.0))]
    ends = [Solution(Point(np.array(theta), nodes), cost, 1, True, "test") for cost, theta in places]
    kept = rounds._distinct(ends)  # pyright: ignore[reportPrivateUsage]
    assert [end.objective for end in kept] == [1.0, 1.00001, 1.1]
    assert kept[1].point.theta[0] == 1.5
