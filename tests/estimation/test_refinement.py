"""The integrator's steps are as short as the noise of the recordings demands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from axes import COULOMB, CURRENT, INERTIA, TORQUE_CONSTANT, VISCOUS
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, steps_and_multisine

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft
from friction_ocp.estimation.fit import fit, settled
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.friction.bristle import Dahl
from friction_ocp.friction.element import FrictionElement
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SIGMA0 = 20.0
STILL = 0.1
"""Standard errors that half the step may move an estimate."""
FAR = 4.5
"""Standard errors; one estimate in 150,000 is farther off by chance."""


def _model(noise: float, **options: Any) -> Model:
    """A shaft with a stiff bristle, seen by an encoder of this noise."""
    rng = np.random.default_rng(3)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.1, 0.25), 0.3, (0.5, 40.0), 2.0, rng)
    friction = PlantFriction("dahl", tau_c=COULOMB, sigma0=SIGMA0, viscous=VISCOUS)
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, friction),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1e-3, noise_std=noise),),
    )
    (stamps, values) = plant.simulate(2.0, {"drive.current": current}, rng).channels["position"]
    channels = {
        "position": Channel("position", stamps, values, "rad"),
        "current": Channel("current", np.asarray(current.time), np.asarray(current.value), "A"),
    }
    law = Dahl(Free(0.9 * COULOMB, 0.0), Free(1.1 * SIGMA0, 0.0), Free(VISCOUS, 0.0))
    shaft = Shaft("motor", Free(INERTIA), FrictionElement(law))
    held = Sensor("current", CURRENT.measures, role="input", hold="zero")
    channels_of_drive = (held, Sensor("position", "motor.theta", noise_std=noise))
    drive = Drive((shaft,), (), (Motor("drive", "motor", TORQUE_CONSTANT),), channels=channels_of_drive)
    use = RecordingUse(Recording("run", channels))
    return prepare(Problem("stiff", drive, (use,), estimation=EstimationOptions(fit="simulation", **options)))


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
