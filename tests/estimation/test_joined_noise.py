"""Identification where noise of a measured current, which nobody states, moves an encoder over many samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission
from swinging import swung

from friction_ocp.estimation.estimate import Estimate, conclude
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.preparation import is_moved_by_inputs, joined_by_input_noise, prepare_identification
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.rounds import Fitted
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Recording
from friction_ocp.statistics.optimum import Optimum

TRUTH = {
    "motor.friction.tau_c": 0.04,
    "load.inertia": 0.012,
    "load.friction.tau_c": 0.4,
    "motor-load.stiffness": 150.0,
    "motor-load.damping": 0.09,
}
TORQUE_CONSTANT, RATIO = 0.25, 5.0
STEP, SECONDS = 1e-3, 3.0
NOISE, RESOLUTION = 0.02, 2.0 * np.pi / 2**13
"""Of the current, A, and of the encoder, rad."""
UNITS = {"current": "A", "encoder": "rad", "acceleration": "rad/s^2"}


def record(name: str, seed: int, noise: float = NOISE) -> Recording:
    """Swing a load behind an elastic gear to and fro by a current of three sines."""
    motor = PlantShaft("motor", 2e-4, PlantFriction("coulomb_viscous", tau_c=0.04, viscous=2e-4))
    load = PlantShaft("load", 0.012, PlantFriction("coulomb_viscous", tau_c=0.4, viscous=0.03))
    plant = Plant(
        shafts=(motor, load),
        transmissions=(PlantTransmission("motor", "load", RATIO, 150.0, 0.09),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(
            PlantSensor("current", "drive.current", STEP, noise_std=noise),
            PlantSensor("encoder", "motor.theta", STEP, resolution=RESOLUTION),
            PlantSensor("acceleration", "load.alpha", STEP, noise_std=2.0),
        ),
    )
    return swung(name, plant, (0.7, 1.9, 4.3), SECONDS, STEP, UNITS, seed)


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """A problem whose model is right, but for its numbers."""
    return problem_in(tmp_path_factory.mktemp("joined"), NOISE, 2e-4)


def problem_in(folder: Path, noise: float, inertia: float | dict[str, float]) -> Problem:
    """Return the problem of recordings with some noise of the current; `inertia` of the motor is known or fitted."""
    for k, name in enumerate(("one", "two", "three")):
        write_recording(record(name, 30 + k, noise), folder / f"{name}.h5")

    def friction(guess: float, viscous: float) -> dict[str, Any]:
        return {"law": "coulomb_viscous", "tau_c": {"guess": guess, "min": 0}, "viscous": viscous}

    joint = {"stiffness": {"guess": 110.0, "min": 10, "max": 1e5}, "damping": {"guess": 0.05, "min": 0}}
    content = {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": [
                {"name": "motor", "inertia": inertia, "friction": friction(0.03, 2e-4)},
                {"name": "load", "inertia": {"guess": 0.01, "min": 0.001}, "friction": friction(0.28, 0.03)},
            ],
            "transmissions": [{"ratio": RATIO, **joint}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input"},
            "encoder": {"measures": "motor.theta", "resolution": RESOLUTION},
            "acceleration": {"measures": "load.alpha"},
        },
        "recordings": {"train": ["one.h5", "two.h5"], "validation": ["three.h5"]},
    }
    (folder / "problem.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return load_problem(folder / "problem.yaml")


@pytest.fixture(scope="module")
def fit(problem: Problem) -> tuple[Model, Fitted]:
    return settled(prepare_identification(problem))


@pytest.fixture(scope="module")
def estimate(fit: tuple[Model, Fitted]) -> Estimate:
    return conclude(*fit, 0.0, 0.0)


def test_the_noise_of_the_current_is_seen(problem: Problem) -> None:
    """It moves the encoder within a segment by more than a count, and joins short segments."""
    model = prepare_identification(problem)
    assert is_moved_by_inputs(model) and not model.noisy_inputs
    joined = joined_by_input_noise(model)
    assert joined.process_noise["motor"] == pytest.approx(TORQUE_CONSTANT * NOISE * np.sqrt(STEP), rel=0.1)
    assert joined.problem.estimation.samples < model.problem.estimation.samples
    assert not is_moved_by_inputs(joined) and joined_by_input_noise(joined) is joined


@pytest.mark.slow
def test_the_drive_is_found(estimate: Estimate) -> None:
    """Within four standard errors, each no more than a few per cent."""
    assert estimate.converged
    for item in estimate.parameters:
        assert item.std_error < 0.05 * TRUTH[item.name], item.name
        assert abs(item.value - TRUTH[item.name]) < 4.0 * item.std_error, item.name


@pytest.mark.slow
def test_noise_of_a_meter_does_not_make_a_rotor_heavy(tmp_path: Path) -> None:
    """What an ammeter adds moves no rotor: three times the noise leaves inertias and friction where they are."""
    rotor = {"guess": 1.6e-4, "min": 2e-5}
    noisy = conclude(*settled(prepare_identification(problem_in(tmp_path, 3.0 * NOISE, rotor))), 0.0, 0.0)
    assert noisy.converged
    for item in noisy.parameters:
        wanted = {**TRUTH, "motor.inertia": 2e-4}[item.name]
        assert item.std_error < 0.05 * wanted, item.name
        assert abs(item.value - wanted) < 3.0 * item.std_error, item.name


@pytest.mark.slow
def test_a_right_model_is_not_said_to_miss_anything(estimate: Estimate) -> None:
    """What is left is white, and the free run is as far off as the noise of the current takes it."""
    assert all(test.white for tests in estimate.residuals.values() for test in tests.values())
    assert not [text for text in estimate.warnings if "free run" in text or "white" in text]


@pytest.mark.slow
def test_an_optimum_read_from_a_file_has_its_program(problem: Problem, fit: tuple[Model, Fitted]) -> None:
    """Statistics work with the segments that the fit ended with."""
    model, fitted = fit
    read = Optimum.read(Optimum.of(model, fitted).document())
    fresh = read.settled(prepare_identification(problem))
    again: Fitted = read.fitted(fresh)
    assert again.program.objective(read.solution.point) == pytest.approx(fitted.solution.objective)
    assert [cut.count for cut in again.program.segments] == [cut.count for cut in fitted.program.segments]
