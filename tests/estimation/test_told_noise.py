"""Identification where the noise of a measured current moves a fine encoder by more than the encoder's own noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission
from swinging import swung

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.innovations import innovations
from friction_ocp.estimation.model import Model, laid_for
from friction_ocp.estimation.node_ends import begun
from friction_ocp.estimation.preparation import prepare_identification
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.rounds import program_builder
from friction_ocp.estimation.whiteness import whiteness
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Recording
from friction_ocp.simulation.losses import Squares

TRUTH = {
    "motor.inertia": 2e-4,
    "motor.friction.tau_c": 0.1,
    "load.inertia": 0.05,
    "load.friction.tau_c": 0.15,
    "motor-load.stiffness": 800.0,
    "motor-load.damping": 0.2,
}
TORQUE_CONSTANT, RATIO = 0.3, 5.0
STEP, SECONDS = 4e-3, 5.0
NOISE, RESOLUTION = 0.1, 1e-5
"""Of the current, A, and of the encoders, rad."""
UNITS = {"current": "A", "fine": "rad", "output": "rad"}


def record(name: str, seed: int) -> Recording:
    """Swing a motor and a load behind an elastic gear, which nothing holds, by a current of three sines."""
    motor = PlantShaft("motor", 2e-4, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3))
    load = PlantShaft("load", 0.05, PlantFriction("coulomb_viscous", tau_c=0.15, viscous=0.02))
    plant = Plant(
        shafts=(motor, load),
        transmissions=(PlantTransmission("motor", "load", RATIO, 800.0, 0.2),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(
            PlantSensor("current", "drive.current", STEP, noise_std=NOISE),
            PlantSensor("fine", "motor.theta", STEP, resolution=RESOLUTION),
            PlantSensor("output", "load.theta", STEP, resolution=RESOLUTION / 5.0),
        ),
    )
    return swung(name, plant, (0.4, 0.9, 2.1), SECONDS, STEP, UNITS, seed)


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A problem whose model is right, but for its numbers; nothing is said of the noise of the current."""
    folder = tmp_path_factory.mktemp("told")
    for k, name in enumerate(("one", "two", "three")):
        write_recording(record(name, 70 + k), folder / f"{name}.h5")
    shafts: list[dict[str, Any]] = [
        {
            "name": "motor",
            "inertia": {"guess": 2.1e-4, "prior_std": 2e-5},
            "friction": {"law": "coulomb_viscous", "tau_c": {"guess": 0.08, "min": 0}, "viscous": 1.5e-3},
        },
        {
            "name": "load",
            "inertia": {"guess": 0.04, "min": 0.001},
            "friction": {"law": "coulomb_viscous", "tau_c": {"guess": 0.12, "min": 0}, "viscous": 0.02},
        },
    ]
    joint = {"stiffness": {"guess": 650.0, "min": 10, "max": 1e5}, "damping": {"guess": 0.3, "min": 0}}
    content = {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": shafts,
            "transmissions": [{"ratio": RATIO, **joint}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input"},
            "fine": {"measures": "motor.theta", "resolution": RESOLUTION},
            "output": {"measures": "load.theta", "resolution": RESOLUTION / 5.0},
        },
        "recordings": {"train": ["one.h5", "two.h5"], "validation": ["three.h5"]},
    }
    (folder / "problem.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return folder / "problem.yaml"


@pytest.fixture(scope="module")
def model(document: Path) -> Model:
    return prepare_identification(load_problem(document))


@pytest.fixture(scope="module")
def truth(model: Model) -> tuple[Program, Point]:
    """The likelihood with the noise of the current as an unknown, and its nodes at the truth."""
    telling = replace(laid_for(model, TRUTH), tells_noise=True)
    program = program_builder(telling)(telling, 0.0, Squares())
    return program, begun(program, model.space.with_known(TRUTH))


def test_what_rules_is_found(document: Path, model: Model) -> None:
    assert model.noisy_inputs == ("current",)
    problem = load_problem(document)
    for asked in ({"process_noise": {"motor": 1e-3}}, {"fit": "simulation"}, {"loss": "huber"}):
        options = replace(problem.estimation, **asked)
        assert not prepare_identification(replace(problem, estimation=options)).noisy_inputs, asked


def test_surprises_are_white_at_the_truth(truth: tuple[Program, Point]) -> None:
    """Residuals of nodes that all samples have drawn to themselves are not."""
    program, point = truth
    for index, item in enumerate(program.experiments):
        found = innovations(program, point, index)
        for column in range(found.shape[1]):
            seen = np.isfinite(found[:, column])
            assert np.mean(np.square(found[seen, column])) == pytest.approx(1.0, abs=0.25)
            assert whiteness(item.grid.time[seen], found[seen, column]).white
    residuals = program.residuals(0, program.simulate(0, point).y)
    assert not whiteness(program.experiments[0].grid.time, residuals[:, 0]).white


def test_rows_hold_what_the_recordings_tell(truth: tuple[Program, Point]) -> None:
    """The noise of every sample is told by its size, too; only where recordings begin is left out."""
    program, point = truth
    rows = influence(program, point).information
    whole = reduce_system(program.linearise(point), 0.0).hessian
    size = np.sqrt(np.diag(whole))
    assert (rows / np.outer(size, size)) == pytest.approx(whole / np.outer(size, size), abs=0.02)


@pytest.mark.slow
def test_the_answer_is_that_of_the_machine(document: Path) -> None:
    estimate = identify(load_problem(document))
    assert estimate.converged, estimate.message
    for item in estimate.parameters:
        assert abs(item.value - TRUTH[item.name]) < 4.0 * item.std_error, item.name
        assert item.value == pytest.approx(TRUTH[item.name], rel=0.1), item.name
    assert all(test.white for tests in estimate.residuals.values() for test in tests.values())
    assert not [text for text in estimate.warnings if "free run" in text]
