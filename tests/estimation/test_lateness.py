"""Delays of many samples: late channels are read earlier by whole intervals between nodes, the rest is expanded."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from axes import COULOMB, ENCODER_NOISE, INERTIA, RATE, SECONDS, TORQUE_CONSTANT, VISCOUS, fitted_axis
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, steps_and_multisine

from friction_ocp.drive.parts import Channel as DriveChannel
from friction_ocp.drive.parts import Controller
from friction_ocp.estimation.estimate import Estimate, identify, simulate
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.lateness import lateness, read_earlier
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.parameter_space import parameter_space
from friction_ocp.estimation.problem import Problem
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.result_document import run_series

FAR = 3.5
"""Standard errors that a right estimate keeps within."""
ENCODER, ACCELEROMETER, NODE = 0.0204, 0.013, 1e-3
"""Delays of 10.2 and 6.5 samples, and the interval between nodes, where the current is sampled, s.

The current jumps from one node to the next, and the acceleration with it: that one is late by whole nodes.
"""
ACCELERATION_NOISE = 0.5


def run(seed: int) -> Recording:
    """Return a run whose encoder and accelerometer are late by many samples, each by another number of them."""
    rng = np.random.default_rng(seed)
    current = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 40.0), SECONDS, rng)
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(
            PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=ENCODER_NOISE, delay=ENCODER),
            PlantSensor("shaking", "motor.alpha", 1 / RATE, noise_std=ACCELERATION_NOISE, delay=ACCELEROMETER),
        ),
    )
    seen = plant.simulate(SECONDS, {"drive.current": current}, rng).channels
    channels = {
        "position": Channel("position", *seen["position"], "rad"),
        "shaking": Channel("shaking", *seen["shaking"], "rad/s^2"),
        "current": Channel("current", np.asarray(current.time), np.asarray(current.value), "A"),
    }
    return Recording(f"run{seed}", channels)


def late(recording: Recording, position: Any, shaking: Any) -> Problem:
    """Return the problem with the delays of both channels."""
    plain = fitted_axis(recording)
    current, encoder = plain.drive.channels
    channels = (
        current,
        replace(encoder, delay=position),
        DriveChannel("shaking", "motor.alpha", noise_std=ACCELERATION_NOISE, delay=shaking),
    )
    return replace(plain, drive=replace(plain.drive, channels=channels))


@pytest.fixture(scope="module")
def fitted() -> Estimate:
    """Return the fit of the encoder's delay beside the machine, from none; that of the accelerometer is known."""
    return identify(late(run(1), Free(0.0, -0.2, 0.2), ACCELEROMETER))


def test_a_delay_of_many_samples_is_found(fitted: Estimate) -> None:
    """Within its standard error, a fraction of a sample, and the residuals are noise."""
    (found,) = [item for item in fitted.parameters if item.name == "position.delay"]
    assert abs(found.value - ENCODER) < FAR * found.std_error < 0.1 * NODE
    for name in ("position", "shaking"):
        assert fitted.simulation.train_errors[name][0].noise_ratio == pytest.approx(1.0, abs=0.05)


def test_a_loop_sees_the_whole_delay_of_samples_that_are_read_earlier() -> None:
    """What is undone in the recording still happens in the machine."""
    problem = late(run(2), ENCODER, 0.0)
    loop = replace(problem.drive, controller=Controller("p", "position", "torque", kp=1.0))
    (use,) = problem.train
    undone = 0.02
    space = parameter_space(
        replace(problem, drive=loop, train=(replace(use, late={"position": undone}),)),
        ("position.delay", "controller.feedback_delay"),
    )
    assert space.numbers(space.guess, use.name) == pytest.approx([ENCODER - undone, ENCODER])


def test_known_delays_are_undone() -> None:
    """A simulation with stated delays leaves noise, though they are far beyond what an expansion can do."""
    problem = late(run(1), ENCODER, ACCELEROMETER)
    (shaft,) = problem.drive.shafts
    law = replace(shaft.friction.law, tau_c=COULOMB, viscous=VISCOUS)  # pyright: ignore[reportCallIssue]
    shafts = (replace(shaft, inertia=INERTIA, friction=replace(shaft.friction, law=law)),)
    known = simulate(replace(problem, drive=replace(problem.drive, shafts=shafts)))
    for name in ("position", "shaking"):
        assert known.train_errors[name][0].noise_ratio == pytest.approx(1.0, abs=0.1)


def test_series_keep_the_stamps_of_the_recording(fitted: Estimate) -> None:
    """What is shown of a late channel has the times at which it was recorded."""
    (free,) = fitted.simulation.train
    shown = run_series(free, fitted.simulation.units, fitted.simulation.state_names).channels["position"]
    recorded = run(1).channels["position"]
    by_time = dict(zip(np.round(recorded.time, 6), recorded.values, strict=True))
    seen = np.isfinite(shown.measured)
    assert seen.sum() > 0.97 * recorded.time.size
    assert [by_time[round(at, 6)] for at in shown.time[seen]] == shown.measured[seen].tolist()


def evenly() -> Experiment:
    """Return a recording of two channels that are read as they are stamped."""
    return prepare(late(run(2), Free(0.0, -0.2, 0.2), 0.0)).train[0]


def test_reading_earlier_and_back_loses_ends_only() -> None:
    """Samples move by whole nodes; those that leave the recording are told as lost, so that no gain comes of it."""
    item = evenly()
    names = ("position", "shaking")
    moved = read_earlier(item, names, {"position": 4 * NODE})
    np.testing.assert_array_equal(moved.measured[:-4, 0], item.measured[4:, 0])
    np.testing.assert_array_equal(moved.measured[:, 1], item.measured[:, 1])
    assert moved.lost[:, 0].sum() == 2 and not moved.lost[:, 1].any()
    back = read_earlier(moved, names, {})
    np.testing.assert_array_equal(back.measured[4:, 0], item.measured[4:, 0])
    assert np.isnan(back.measured[:4, 0]).all() and back.lost[:, 0].sum() == 2


def test_half_a_node_is_left_to_the_model() -> None:
    """An estimate that stays near keeps what was undone; uneven nodes undo nothing."""
    item = evenly()
    assert lateness(item, {"position": 0.5 * NODE}, {}) == {}
    assert lateness(item, {"position": 0.6 * NODE}, {}) == {"position": pytest.approx(NODE)}
    undone = {"position": NODE}
    assert lateness(item, {"position": 1.5 * NODE}, undone) == undone
    uneven = replace(item, grid=replace(item.grid, time=item.grid.time + 1e-3 * np.sin(item.grid.time * 7.0)))
    assert lateness(uneven, {"position": 40 * NODE}, {}) == {}
