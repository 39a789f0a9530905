"""Noise of measured inputs as unknowns of every sample."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import diagnosed
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission, Trajectory
from test_relaid_gaps import MOTOR_INERTIA, TORQUE_CONSTANT, written

from friction_ocp.diagnosis import base_fit
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import footing
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.sharpening import seen_on, sharpened
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.node_ends import begun
from friction_ocp.estimation.program import Point, Program
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.grid import FloatArray

TRUTH = {
    "axis.inertia": MOTOR_INERTIA,
    "axis.friction.tau_c": 0.1,
    "axis.friction.viscous": 1.5e-3,
    "load.inertia": 0.05,
    "load.friction.tau_c": 0.1,
    "load.gravity.torque": 1.0,
    "axis-load.stiffness": 800.0,
    "axis-load.damping": 0.2,
}
STEP, SECONDS = 8e-3, 12.0
NOISE, RESOLUTION = 0.1, 1e-5
"""Of the current, A, and of the encoder, rad."""
STATED = 0.1
"""Standard deviation of the stated inertia of the rotor, as a share of it."""


def swings(k: int) -> Trajectory:
    """Return A: three sines of no common period."""
    time, rng = np.arange(0.0, 2.0 * SECONDS, STEP), np.random.default_rng(40 + k)
    waves = [np.sin(2 * np.pi * f * time + rng.uniform(0.0, 6.0)) for f in (0.3, 0.8, 1.9)]
    return Trajectory(time, 0.9 * np.sum(waves, axis=0), "linear")


def write(folder: Path, both: bool = False) -> Path:
    """Write runs of a motor and a load that hangs on a gear, seen by a noisy current and a fine encoder, or `both`."""
    motor = PlantShaft("axis", MOTOR_INERTIA, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3))
    load = PlantShaft("load", 0.05, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.02), gravity=(1.0, 0.0))
    sensors: tuple[PlantSensor, ...] = (
        PlantSensor("current", "motor.current", STEP, noise_std=NOISE),
        PlantSensor("position", "axis.theta", STEP, resolution=RESOLUTION),
    )
    channels: dict[str, Any] = {
        "current": {"measures": "motor.current", "role": "input"},
        "position": {"measures": "axis.theta", "resolution": RESOLUTION},
    }
    if both:
        sensors += (PlantSensor("load_position", "load.theta", STEP, resolution=RESOLUTION / 5.0),)
        channels["load_position"] = {"measures": "load.theta", "resolution": RESOLUTION / 5.0}
    drive = PlantMotor("motor", "axis", torque_constant=TORQUE_CONSTANT)
    plant = Plant((motor, load), (PlantTransmission("axis", "load", 5.0, 800.0, 0.2),), (drive,), sensors=sensors)
    changes: dict[str, Any] = {
        "axis": {"inertia": {"guess": 0.97 * MOTOR_INERTIA, "prior_std": STATED * MOTOR_INERTIA}},
        "load": {
            "friction": {"law": "coulomb_viscous", "tau_c": {"guess": 0.12, "min": 0}, "viscous": 0.02},
            "gravity": {"torque": {"guess": 0.9, "min": 0, "max": 5}},
        },
        "joint": {"stiffness": {"guess": 744.0, "min": 10, "max": 1e5}},
        "channels": channels,
    }
    return written(folder, plant, SECONDS, swings, changes)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A problem whose model is right; its current is noisy and its encoder fine."""
    return write(tmp_path_factory.mktemp("noisy"))


@pytest.fixture(scope="module")
def model(path: Path) -> Model:
    return prepare(load_problem(path))


@pytest.fixture(scope="module")
def program(model: Model) -> Program:
    """Its likelihood with the noise of its current as an unknown of every sample, laid at the truth."""
    foot = sharpened(model, footing(model, model.space.with_known(TRUTH)))
    assert foot.noisy_inputs == ("current",)
    return foot.training(model)


def test_the_truth_leaves_as_much_as_noise_does(model: Model, program: Program) -> None:
    """Every sample of the encoder tells one of the noises of the current; what is left has the power of all of them."""
    truth = begun(program, model.space.with_known(TRUTH))
    chance = 5.0 * np.sqrt(2.0 / program.samples)
    assert 2.0 * program.objective(truth) / program.samples == pytest.approx(1.0, abs=chance)
    noise = program.drive.state_names.index("current.noise")
    found = np.concatenate([nodes[:, noise] for nodes in truth.nodes])
    assert np.std(found) == pytest.approx(NOISE, rel=0.05)


def test_lines_join_the_noise_of_neighbours(model: Model, program: Program) -> None:
    truth = begun(program, model.space.with_known(TRUTH))
    noise, rate = (program.drive.state_names.index(f"current.{kind}") for kind in ("noise", "noise_rate"))
    nodes, spans = truth.nodes[0], np.diff(program.experiments[0].grid.time)
    assert np.allclose(nodes[:-1, noise] + spans[:-1] * nodes[:-1, rate], nodes[1:, noise], atol=0.01 * NOISE)


def test_a_model_is_seen_on_the_sharpened_footing_where_it_stands(model: Model, program: Program) -> None:
    """At its parameters, its nodes where they are best: as far from the recordings as noise is, at the truth."""
    theta = model.space.with_known(TRUTH)
    foot = footing(model, theta)
    plain = foot.training(model)
    fitted = FittedModel(model, foot, linear_program(plain, begun(plain, theta)))
    seen = seen_on(sharpened(model, foot), fitted)
    assert np.array_equal(seen.theta, theta)
    assert seen.linear.point.nodes[0].shape == (program.segments[0].count, len(program.drive.state_names))
    assert seen.objective == pytest.approx(0.5 * program.samples, rel=0.1)


def test_noise_of_inputs_that_are_sampled_otherwise_is_that_of_torque(path: Path) -> None:
    """There is no unknown for every node where an input has samples at every second one alone."""
    problem = load_problem(path)
    use, *others = problem.train
    current = use.recording.channels["current"]
    halved = replace(current, time=current.time[::2], values=current.values[::2])
    recording = replace(use.recording, channels={**use.recording.channels, "current": halved})
    model = prepare(replace(problem, train=(replace(use, recording=recording), *others)))
    foot = footing(model, model.space.with_known(TRUTH))
    assert sharpened(model, foot) is foot


def test_slopes_are_those_of_the_objective(model: Model, program: Program) -> None:
    start = suggested_point(program, model.space.with_known(TRUTH))
    slope, scale = program.linearise(start).theta_gradient, model.space.scale
    expected = _slopes(model, program, start)
    assert np.allclose(slope * scale, expected * scale, rtol=0.01, atol=1e-4 * np.abs(slope * scale).max())
    rows = linear_program(program, start).rows
    moved = [linear_program(program, Point(start.theta + step, start.nodes)).rows.residual for step in _steps(model)]
    for k, step in enumerate(_steps(model)):
        predicted = rows.jacobian @ step
        assert float(predicted @ (moved[k] - rows.residual - predicted)) < 0.05 * float(predicted @ predicted)


def _steps(model: Model) -> list[FloatArray]:
    return [1e-5 * model.space.scale[k] * np.eye(model.space.scale.size)[k] for k in range(model.space.scale.size)]


def _slopes(model: Model, program: Program, at: Point) -> FloatArray:
    found: list[float] = []
    for step in _steps(model):
        ends = [program.objective(Point(at.theta + sign * step, at.nodes)) for sign in (1.0, -1.0)]
        found.append((ends[0] - ends[1]) / (2.0 * float(np.sum(step))))
    return np.array(found)


@pytest.mark.slow
def test_a_stated_inertia_that_is_right_is_found_again(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """Gaps laid for one inertia favour a rotor that answers less to noise, far beyond what its prior allows."""
    fitted = fit_base(model)
    assert fitted.footing.noisy_inputs
    assert fitted.values["axis.inertia"] == pytest.approx(MOTOR_INERTIA, rel=0.1)
    assert 0.9 < fitted.objective / (0.5 * fitted.linear.program.samples) < 1.1
    monkeypatch.setattr(base_fit, "fitted_sharply", lambda fitted, guesses: fitted)
    assert fit_base(model).values["axis.inertia"] > (1.0 + 2.0 * STATED) * MOTOR_INERTIA


@pytest.mark.slow
def test_a_noisy_current_is_no_wrong_inertia(path: Path) -> None:
    result: dict[str, Any] = diagnosed(path)
    assert result["verdict"] == "no_gap" and not result["accepted"]


@pytest.mark.slow
def test_two_encoders_see_no_eccentricity_in_it(tmp_path: Path) -> None:
    """A sample bears on the segments on either side of it, which two encoders see."""
    result: dict[str, Any] = diagnosed(write(tmp_path, both=True))
    assert result["verdict"] == "no_gap" and not result["accepted"]
