"""Static points as residuals: alone, together with recordings, and against what the plant needs at constant speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantSensor, PlantShaft, PlantTransmission, Trajectory

from friction_ocp import check, identify
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.parameter_space import nested_space
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous, Polyline, Stribeck
from friction_ocp.parameters import Directional, Free
from friction_ocp.recording.recording import Channel as RecordedChannel
from friction_ocp.recording.recording import Recording
from friction_ocp.recording.static_points import StaticPoints

FAST = PlantFriction("polyline", tau_c=(0.11, 0.13), slopes=(0.004, 0.0005), breaks=(40.0,))
SLOW = PlantFriction("coulomb_viscous", tau_c=2.0, viscous=0.4)
SHAFTS = (PlantShaft("motor", 0.001, FAST), PlantShaft("load", 0.2, SLOW))
JOINT = (PlantTransmission("motor", "load", 20.0, 60.0, 3.0),)
CONSTANT = 0.35
SPEEDS = np.concatenate([side * np.geomspace(4.0, 120.0, 12) for side in (1.0, -1.0)])
SCATTER = 1e-3


def needed_current(speeds: np.ndarray) -> np.ndarray:
    """Return the current at which the plant turns at given speeds: that of its motor, held there by a stiff loop."""
    plant = Plant(SHAFTS, JOINT)
    currents = []
    for speed in speeds:
        done = plant.simulate(
            4.0, {"motor.omega": float(speed)}, step=1e-4, initial={"load.omega": speed / 20.0}, truth_rate=100
        )
        last = slice(-100, None)
        passed = np.mean(done.truth["motor-load.torque"][last]) / 20.0
        currents.append((passed + np.mean(done.truth["motor.friction"][last])) / CONSTANT)
    return np.array(currents)


@pytest.fixture(scope="module")
def points() -> StaticPoints:
    """Currents at twelve speeds each way, averages of four runs."""
    rng = np.random.default_rng(20)
    current = needed_current(SPEEDS) + 0.5 * SCATTER * rng.standard_normal(SPEEDS.size)
    error = np.full(SPEEDS.size, 0.5 * SCATTER)
    return StaticPoints(
        "curve", SPEEDS, {"speed": "rad/s", "current": "A", "std_error": "A"}, current=current, std_error=error
    )


def drive_with(fast: Polyline, slow: CoulombViscous, channels: tuple[Channel, ...] = ()) -> Drive:
    """Return the chain under test."""
    shafts = (Shaft("motor", 0.001, FrictionElement(fast)), Shaft("load", 0.2, FrictionElement(slow)))
    joint = Transmission("motor", "load", 20.0, 60.0, 3.0)
    return Drive(shafts, (joint,), (Motor("motor", "motor", CONSTANT),), None, channels)


def unknown_fast() -> Polyline:
    """Return the fast side's friction, all of it fitted from guesses that are far off."""
    sides = Directional(Free(0.03, 0.0, 1.0), Free(0.3, 0.0, 1.0))
    return Polyline(sides, (Free(0.02, 0.0, 0.1), Free(0.02, 0.0, 0.1)), (Free(90.0, 5.0, 119.0),))


def problem_of(drive: Drive, points: StaticPoints, *recordings: Recording, **more: object) -> Problem:
    uses = tuple(RecordingUse(recording) for recording in recordings)
    return Problem("chain", drive, uses, static=(StaticUse(points),), **more)


def test_the_residuals_at_the_truth_are_the_scatter(points: StaticPoints) -> None:
    """With the plant's numbers the points scatter by their standard errors; derivatives are those of differences."""
    truth = Polyline(Directional(0.11, 0.13), (Free(0.004), Free(0.0005)), (Free(40.0),))
    model = prepare(problem_of(drive_with(truth, CoulombViscous(2.0, Free(0.4))), points))
    (term,), theta = model.static, model.space.guess
    errors, slope = term.residuals(model.space, theta)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * errors.size))
    step = 1e-6 * theta
    for k in range(theta.size):
        move = np.eye(theta.size)[k] * step
        sides = [term.residuals(model.space, theta + sign * move)[0] for sign in (1.0, -1.0)]
        difference = (sides[0] - sides[1]) / (2.0 * step[k])
        assert slope[:, k] == pytest.approx(difference, abs=1e-5 * np.max(np.abs(difference)))


def test_points_alone_are_a_problem(points: StaticPoints) -> None:
    """A curve, without any recording, gives the friction of the one shaft that is unknown, within its intervals."""
    estimate = identify(problem_of(drive_with(unknown_fast(), CoulombViscous(2.0, 0.4)), points))
    assert estimate.converged
    truth = (0.11, 0.13, 0.004, 0.0005, 40.0)
    for item, wanted in zip(estimate.parameters, truth, strict=True):
        assert item.verdict.word == "ok"
        assert abs(item.value - wanted) < 4.0 * item.std_error < 0.2 * wanted
    (fit,) = estimate.simulation.static
    assert fit.noise_ratio < 1.5 and fit.noise_source == "std_error" and fit.unit == "A"
    (curve,) = (curve for curve in estimate.curves if curve.shaft == "motor")
    assert curve.speed[-1] == pytest.approx(120.0)
    assert next(curve for curve in estimate.curves if curve.shaft == "load").speed[-1] == pytest.approx(6.0)


def stop_of_the_load() -> Recording:
    """Return the load's speed while the motor goes from 100 rad/s to a stop, kinematically."""
    profile = Trajectory(np.array([0.0, 1.0, 1.02, 4.0]), np.array([100.0, 100.0, 0.0, 0.0]), "linear")
    sensors = (PlantSensor("load_speed", "load.omega", 1e-2, noise_std=2e-3),)
    joint = (PlantTransmission("motor", "load", 20.0, 60.0, 0.3),)
    plant = Plant(SHAFTS, joint, sensors=sensors)
    done = plant.simulate(
        4.0, {"motor.omega": profile}, np.random.default_rng(3), initial={"load.omega": 5.0}, step=1e-4
    )
    time, speed = done.channels["load_speed"]
    grid = np.arange(0.0, 4.0, 1e-3)
    channels = {
        "motor_speed": RecordedChannel("motor_speed", grid, profile.at(grid), "rad/s"),
        "load_speed": RecordedChannel("load_speed", time, speed, "rad/s"),
    }
    return Recording("stop", channels)


def test_three_segments_are_found() -> None:
    """A curve of three segments, as in Fig. 3a of the Leighton telescope paper: every slope and both breaks."""
    friction = PlantFriction("polyline", tau_c=0.2, slopes=(0.02, 0.004, 0.01), breaks=(5.0, 15.0))
    plant, speeds = Plant((PlantShaft("motor", 0.001, friction),), ()), np.linspace(0.5, 30.0, 60)
    torque = [
        plant.simulate(0.01, {"motor.omega": float(speed)}, step=1e-4, truth_rate=1000).truth["motor.friction"][-1]
        for speed in speeds
    ]
    noise = SCATTER * np.random.default_rng(21).standard_normal(speeds.size)
    points = StaticPoints(
        "curve",
        speeds,
        {"speed": "rad/s", "torque": "N m", "std_error": "N m"},
        torque=np.array(torque) + noise,
        std_error=np.full(speeds.size, SCATTER),
    )
    law = Polyline(
        Free(0.1, 0.0, 1.0),
        tuple(Free(0.01, -0.1, 0.1) for _ in range(3)),
        (Free(3.0, 1.0, 12.0), Free(20.0, 12.0, 28.0)),
    )
    estimate = identify(problem_of(Drive((Shaft("motor", 0.001, FrictionElement(law)),)), points))
    assert estimate.converged
    for item, wanted in zip(estimate.parameters, (0.2, 0.02, 0.004, 0.01, 5.0, 15.0), strict=True):
        assert item.verdict.word == "ok", item.name
        assert abs(item.value - wanted) < 4.0 * item.std_error < 0.4 * wanted, item.name


def test_points_alone_that_leave_a_doubt_are_checked(points: StaticPoints) -> None:
    """Dry friction on both sides of a gear is one sum at constant speed: a warning, and no further channel to name."""
    drive = drive_with(
        Polyline(Free(0.1, 0.0, 1.0), (0.004, 0.0005), (40.0,)), CoulombViscous(Free(2.0, 0.0, 9.0), 0.4)
    )
    (finding,) = check(problem_of(drive, points))
    assert finding.severity == "warning" and "tau_c" in finding.what and "no further channel" in finding.remedy


def test_a_simpler_model_with_nothing_to_fit_is_none(points: StaticPoints) -> None:
    """Without its Stribeck part this friction has no parameter left: there is nothing to be fitted first."""
    law = Stribeck(tau_c=0.11, tau_s=Free(0.15, 0.0, 1.0), omega_s=3.0)
    model = prepare(problem_of(drive_with(law, CoulombViscous(2.0, 0.4)), points))
    assert nested_space(model.problem, model.space) is model.space


def test_points_and_a_recording_tell_together_what_neither_tells_alone(points: StaticPoints) -> None:
    """The curve knows only the sum of both shafts; the stop only the load; together they know both."""
    slow = CoulombViscous(Free(0.5, 0.0, 20.0), Free(1.0, 0.0, 10.0))
    channels = (
        Channel("motor_speed", "motor.omega", "input"),
        Channel("load_speed", "load.omega", noise_std=2e-3),
    )
    drive = drive_with(unknown_fast(), slow, channels)
    drive = replace(drive, transmissions=(Transmission("motor", "load", 20.0, 60.0, 0.3),))
    joint = identify(problem_of(drive, points, stop_of_the_load()))
    assert joint.converged
    truth = (0.11, 0.13, 0.004, 0.0005, 40.0, 2.0, 0.4)
    for item, wanted in zip(joint.parameters, truth, strict=True):
        assert abs(item.value - wanted) < 4.0 * item.std_error < 0.2 * wanted, item.name
    alone = identify(problem_of(drive_with(unknown_fast(), slow), points))
    assert {item.verdict.word for item in alone.parameters} & {"traded", "not_identifiable", "at_bound"}


@pytest.mark.parametrize(("source", "missing"), [("noise_std", False), ("estimate", True)])
def test_a_scatter_that_is_not_stated_comes_from_the_channel_or_the_neighbours(
    points: StaticPoints, source: str, missing: bool
) -> None:
    """Without /std_error the noise of the current channel counts, else the differences between neighbouring points."""
    bare = replace(points, std_error=None, runs=np.full(points.speed.size, 4.0))
    channels = () if missing else (Channel("current", "motor.current", "input", noise_std=SCATTER),)
    drive = drive_with(unknown_fast(), CoulombViscous(2.0, 0.4), channels)
    (term,) = prepare(problem_of(drive, bare)).static
    curvature = 3.0
    assert term.noise_source == source
    assert np.all(term.std_error < curvature * 0.5 * SCATTER) and np.all(term.std_error > 0.5 * SCATTER / curvature)


def test_too_few_points_without_a_scatter_are_refused(points: StaticPoints) -> None:
    """Three points have no neighbours to compare with."""
    few = replace(points, speed=points.speed[:3], current=points.current[:3], std_error=None)
    with pytest.raises(FrictionOcpError, match="the scatter of the points is not known"):
        prepare(problem_of(drive_with(unknown_fast(), CoulombViscous(2.0, 0.4)), few))


def test_sizes_with_a_direction_are_signed(points: StaticPoints) -> None:
    """Speed and current may be sizes beside a direction; a point at rest is the breakaway of its direction."""
    sizes = replace(
        points,
        speed=np.append(np.abs(points.speed), 0.0),
        current=np.append(np.abs(points.current), 0.6),
        std_error=np.append(points.std_error, 1e-3),
        direction=np.append(np.sign(points.speed), -1.0),
    )
    model = prepare(problem_of(drive_with(unknown_fast(), CoulombViscous(2.0, 0.4)), sizes))
    (term,) = model.static
    assert term.measured[:-1] == pytest.approx(points.current)
    assert term.predict(model.space, model.space.guess)[-1] == pytest.approx(-(0.3 + 2.0 / 20.0) / CONSTANT)
