"""The integrator's steps are as short as the noise of the recordings demands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from axes import COULOMB, CURRENT, INERTIA, POSITION, TORQUE_CONSTANT, VISCOUS, axis, problem
from scipy.integrate import solve_ivp
from stiff_axis import SIGMA0, stiff_problem

from friction_ocp.diagnosis import base_fit
from friction_ocp.diagnosis.bench import Bench, Seat, footing_document, point_document
from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Controller, Gravity
from friction_ocp.estimation.fit import fit, settled
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.modes import STEP_PER_RADIAN
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

STILL = 0.1
"""Standard errors that half the step may move an estimate."""
FAR = 4.5
"""Standard errors; one estimate in 150,000 is farther off by chance."""


def _model(noise: float, **options: Any) -> Model:
    return prepare(stiff_problem(noise, **options))


def _off(model: Model, theta: np.ndarray, std_error: np.ndarray) -> np.ndarray:
    truth = {
        "motor.inertia": INERTIA,
        "motor.friction.tau_c": COULOMB,
        "motor.friction.sigma0": SIGMA0,
        "motor.friction.sigma2": VISCOUS,
    }
    return (theta - np.array([truth[name] for name in model.space.names])) / std_error


@pytest.fixture(scope="module")
def fine() -> Model:
    """A fine encoder."""
    return _model(1e-4)


def test_a_fine_encoder_shortens_the_step_until_the_answer_stands(fine: Model) -> None:
    """Half the step that is left moves nothing; the parameters are the plant's; the first step's were not."""
    rough = fit(fine)
    model, fitted = settled(fine)
    assert model.max_step < fine.max_step
    information = influence(fitted.program, fitted.solution.point).information
    std_error = np.sqrt(np.diag(np.linalg.inv(information)))
    assert np.max(np.abs(_off(model, fitted.solution.point.theta, std_error))) < FAR
    moved = (rough.solution.point.theta - fitted.solution.point.theta) / std_error
    assert np.max(np.abs(moved)) > STILL
    again = fit(_model(1e-4, max_step=0.5 * model.max_step))
    move = (again.solution.point.theta - fitted.solution.point.theta) / std_error
    assert np.max(np.abs(move)) < STILL


def test_a_coarse_encoder_and_a_stated_step_are_left_alone() -> None:
    """Where the noise hides the error of the step, or the user has chosen, nothing is refined."""
    coarse = _model(1e-2)
    assert settled(coarse)[0].max_step == coarse.max_step
    stated = _model(1e-2, max_step=1e-3)
    assert settled(stated)[0].max_step == 1e-3


TORQUE, INTERVAL = 0.5, 0.02


def swing(inertia: float | Free, noise: float) -> Model:
    """Return a pendulum that swings freely for 4 s, its angle seen by an encoder of this noise."""
    time = np.arange(0.0, 4.0, INTERVAL)

    def rates(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -TORQUE / INERTIA * np.sin(state[0])]

    true = solve_ivp(rates, (0.0, 4.0), [1.0, 0.0], t_eval=time, rtol=1e-10, atol=1e-10).y[0]
    seen = Channel("position", time, true + noise * np.random.default_rng(5).standard_normal(time.size), "rad")
    still = Channel("current", time, 0.0 * time, "A")
    drive = axis(inertia=inertia, gravity=Gravity(TORQUE))
    drive = replace(drive, channels=(CURRENT, replace(POSITION, noise_std=noise)))
    return prepare(problem(drive, Recording("swing", {"current": still, "position": seen})))


def test_a_first_step_longer_than_the_samples_are_apart_is_shortened() -> None:
    """A guess of the inertia 400 times too large makes the pendulum slow; the log is fitted at its own speed."""
    first = swing(Free(400.0 * INERTIA, 1e-2 * INERTIA, 1e4 * INERTIA), 3e-3)
    assert first.max_step > 2.0 * INTERVAL
    model, fitted = settled(first)
    std_error = 1.0 / np.sqrt(influence(fitted.program, fitted.solution.point).information[0, 0])
    assert model.max_step < 0.5 * INTERVAL
    assert abs(fitted.solution.point.theta[0] - INERTIA) < FAR * std_error


def test_steps_are_shortened_where_nothing_is_fitted() -> None:
    """A known drive has no parameter that they could move, but its residuals show them."""
    first = swing(INERTIA, 3e-4)
    model, fitted = settled(first)
    assert model.max_step < first.max_step
    cost = 2.0 * fitted.solution.objective / fitted.program.samples
    assert cost == pytest.approx(1.0, abs=FAR * np.sqrt(2.0 / fitted.program.samples))


def test_a_loop_is_stepped_as_fast_as_it_is_near_its_set_point() -> None:
    """Far from it the effort is at its limit, and nothing swings; the step does not hang on where the log begins."""
    loop = Controller("duty", "position", "current", kp=50.0, saturation=(-1.0, 1.0))
    wanted = Sensor("wanted", "reference.theta", role="input")
    drive = replace(axis(inertia=Free(INERTIA)), channels=(wanted, POSITION), controller=loop)
    time = np.arange(0.0, 2.0, 0.01)
    position = Channel("position", time, np.sin(time), "rad")
    recordings = [
        Recording("run", {"wanted": Channel("wanted", time, far + np.sin(time), "rad"), "position": position})
        for far in (0.0, 3.0)
    ]
    near, far = (prepare(problem(drive, recording)).max_step for recording in recordings)
    assert far == near
    assert near == pytest.approx(STEP_PER_RADIAN * np.sqrt(INERTIA / (50.0 * TORQUE_CONSTANT)), rel=1e-3)


def test_models_of_a_diagnosis_are_compared_on_steps_that_suffice(fine: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """The base model's are shortened where its fit ends, and other processes build it, and what follows, with those.

    Asked as strictly as an identification; the short segments of a diagnosis hang less on the step.
    """
    monkeypatch.setattr(base_fit, "SEARCHING", STILL)
    base = base_fit.fit_base(fine)
    assert base.model.max_step < fine.max_step
    assert base.missed == pytest.approx(1.0, abs=0.1)
    point = point_document(base)
    bench = Bench(fine.problem, footing_document(base.footing), point, Seat.of(base))
    assert bench.base.model.max_step == base.model.max_step
    assert bench.base.objective == pytest.approx(base.objective, rel=1e-9)
