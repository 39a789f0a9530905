"""Gaps that the noise of a measured torque makes, as wide as each model makes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import diagnosed
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission, Trajectory
from test_relaid_gaps import MOTOR_INERTIA, TORQUE_CONSTANT, written

from friction_ocp.diagnosis import base_fit
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.footing import footing
from friction_ocp.diagnosis.gathered_noise import sampled_covariances
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.sharpening import sharpened
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import Model, prepare
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


def write(folder: Path) -> Path:
    """Write runs of a motor and a load that hangs on a gear, seen by a noisy current and a fine encoder."""
    motor = PlantShaft("axis", MOTOR_INERTIA, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=1.5e-3))
    load = PlantShaft("load", 0.05, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.02), gravity=(1.0, 0.0))
    sensors = (
        PlantSensor("current", "motor.current", STEP, noise_std=NOISE),
        PlantSensor("position", "axis.theta", STEP, resolution=RESOLUTION),
    )
    drive = PlantMotor("motor", "axis", torque_constant=TORQUE_CONSTANT)
    plant = Plant((motor, load), (PlantTransmission("axis", "load", 5.0, 800.0, 0.2),), (drive,), sensors=sensors)
    changes: dict[str, Any] = {
        "axis": {"inertia": {"guess": 0.97 * MOTOR_INERTIA, "prior_std": STATED * MOTOR_INERTIA}},
        "load": {
            "friction": {"law": "coulomb_viscous", "tau_c": {"guess": 0.12, "min": 0}, "viscous": 0.02},
            "gravity": {"torque": {"guess": 0.9, "min": 0, "max": 5}},
        },
        "joint": {"stiffness": {"guess": 744.0, "min": 10, "max": 1e5}},
        "channels": {
            "current": {"measures": "motor.current", "role": "input"},
            "position": {"measures": "axis.theta", "resolution": RESOLUTION},
        },
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
    """Its likelihood with gaps that are each model's own, laid at the truth."""
    foot = sharpened(model, footing(model, model.space.with_known(TRUTH)))
    assert foot.sharp == (True,)
    return foot.training(model)


def test_only_samples_at_nodes_count(program: Program) -> None:
    for item, cut in zip(program.experiments, program.segments, strict=True):
        seen = np.isfinite(item.measured)
        assert np.all(seen[cut.first[:-1]])
        assert np.sum(seen) == seen.shape[1] * cut.count


def test_gaps_of_a_free_rotor_are_those_of_independent_samples(model: Model) -> None:
    """Two samples of unit density, each held for a step: the speeds add up, and the angle gathers the first one's."""
    step, states = 0.1, model.state_scale.size
    slopes = np.zeros((1, states, states))
    slopes[0, 0, 2] = 1.0
    found = sampled_covariances(model, slopes, np.array([2.0 * step]), step)[0, 0]
    power = 1.0 / step
    assert found[2, 2] == pytest.approx(2.0 * power * step**2)
    assert found[0, 0] == pytest.approx(power * (1.5**2 + 0.5**2) * step**4)
    assert found[0, 2] == pytest.approx(power * (1.5 + 0.5) * step**3)


def test_what_follows_a_torque_at_once_is_moved_by_no_more_than_its_noise(model: Model) -> None:
    """The speed of a rotor that a damper holds at once is the torque over the damping."""
    step, states, rate = 0.1, model.state_scale.size, 1e4
    slopes = np.zeros((1, states, states))
    slopes[0, 2, 2] = -rate
    found = sampled_covariances(model, slopes, np.array([2.0 * step]), step)[0, 0, 2, 2]
    assert found == pytest.approx(1.0 / step / rate**2, rel=1e-3)


def test_gaps_are_as_wide_as_the_torque_moves_each_rotor(model: Model, program: Program) -> None:
    """A free rotor of half the inertia is moved twice as far, by the noise of the current; the gear holds it back."""
    theta = model.space.with_known(TRUTH)
    light = theta * np.where(np.array(model.space.names) == "axis.inertia", 0.5, 1.0)
    speed = model.drive.state_names.index("axis.omega")
    widths: list[float] = []
    for at in (theta, light):
        weight = program.joined(0, at).gap_weight
        assert weight is not None
        widths.append(float(np.sqrt(np.linalg.inv(weight[100].T @ weight[100])[speed, speed])))
    step = float(program.experiments[0].grid.dt[0])
    assert 0.5 < widths[0] / (np.sqrt(2.0) * NOISE * TORQUE_CONSTANT * step / MOTOR_INERTIA) < 1.0
    assert 1.4 < widths[1] / widths[0] < 2.0


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
    assert fitted.footing.sharp
    assert fitted.values["axis.inertia"] == pytest.approx(MOTOR_INERTIA, rel=0.1)
    assert 0.4 < fitted.objective / (0.5 * fitted.linear.program.samples) < 1.3
    monkeypatch.setattr(base_fit, "fitted_sharply", lambda fitted, guesses: fitted)
    assert fit_base(model).values["axis.inertia"] > (1.0 + 2.0 * STATED) * MOTOR_INERTIA


@pytest.mark.slow
def test_a_noisy_current_is_no_wrong_inertia(path: Path) -> None:
    result: dict[str, Any] = diagnosed(path)
    assert result["verdict"] == "no_gap" and not result["accepted"]
