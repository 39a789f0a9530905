"""Recordings enter a fit one after another; the answer is that of all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import COULOMB, INERTIA, VISCOUS, axis, measured_axis, problem

from friction_ocp.estimation import curriculum
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.progress import Phases, silent
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Recording

NAMES = ("late", "early")


@pytest.fixture(scope="module")
def model() -> Model:
    """One mass with two recordings: no model explains the noise of the first."""
    law = CoulombViscous(Free(0.5 * COULOMB, 0.0, 1.0), Free(2.0 * VISCOUS, 0.0, 0.1))
    runs = [renamed(measured_axis(seed), name) for seed, name in zip((5, 6), NAMES, strict=True)]
    position = runs[0].channels["position"]
    rough = position.values + 0.3 * np.random.default_rng(1).standard_normal(position.values.size)
    runs[0] = replace(runs[0], channels=dict(runs[0].channels) | {"position": replace(position, values=rough)})
    return prepare(problem(axis(law, inertia=Free(2.0 * INERTIA)), *runs, process_noise={"motor": 1e-3}))


def renamed(recording: Recording, name: str) -> Recording:
    """Return a recording under another name."""
    return replace(recording, name=name)


def test_what_is_nearly_explained_comes_first(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fit begins with the recording of smaller error, whatever the order in the problem."""
    seen: list[tuple[str, ...]] = []

    def watched(program: Program, start: Point, *more: object) -> object:
        seen.append(tuple(item.name for item in program.experiments))
        return solve_gauss_newton(program, start, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(curriculum, "solve_gauss_newton", watched)
    curriculum.introduced(model, Phases(silent, 1))
    assert seen[:2] == [("early",), ("early", "late")]


def test_the_answer_is_that_of_all_recordings_at_once(model: Model) -> None:
    """Objective and parameters agree with one fit of everything, and recordings keep the order of the problem."""
    solution, program = curriculum.introduced(model, Phases(silent, 1))
    assert tuple(item.name for item in program.experiments) == NAMES
    assert solution.objective == pytest.approx(program.objective(solution.point), rel=1e-9)
    start = suggested_point(program, model.space.guess)
    at_once = solve_gauss_newton(program, start)
    assert solution.objective == pytest.approx(at_once.objective, rel=1e-5)
    assert solution.point.theta == pytest.approx(at_once.point.theta, rel=2e-2)


def test_parameters_of_single_recordings_forbid_it(model: Model) -> None:
    """A number that each recording has for itself is not seen before its recording is in."""
    assert curriculum.may_enter_in_turn(model)
    law = CoulombViscous(Free(COULOMB, scope="recording"), VISCOUS)
    own = prepare(problem(axis(law), *(RecordingUse(renamed(measured_axis(5), name)) for name in NAMES)))
    assert not curriculum.may_enter_in_turn(own)
