"""A pendulum whose current is measured with noise: free runs wander by it, and segments that it joins do not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from plant import Plant, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory

from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.warnings import LOST_FREE_RUN
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

SECONDS, STEP, RESOLUTION, NOISE = 2.0, 1e-3, 2.0 * np.pi / 2**17, 0.02
INERTIA, COULOMB, VISCOUS, WEIGHT, TORQUE_CONSTANT = 0.01, 0.2, 5e-3, 1.5, 0.5


def record(noise: float) -> Recording:
    """Swing the pendulum by a loop that holds it against its weight."""
    friction = PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)
    plant = Plant(
        shafts=(PlantShaft("arm", INERTIA, friction, gravity=(WEIGHT, 0.0)),),
        motors=(PlantMotor("motor", "arm", torque_constant=TORQUE_CONSTANT, controller="loop"),),
        controllers=(PlantController("loop", "cascade", "fine", kp=20.0, ki=4.0, kd=0.6, sample_time=STEP),),
        sensors=(
            PlantSensor("fine", "arm.theta", period=STEP, resolution=RESOLUTION / 16),
            PlantSensor("angle", "arm.theta", period=STEP, resolution=RESOLUTION),
            PlantSensor("current", "motor.current", period=STEP, noise_std=noise),
        ),
    )
    time = np.arange(0.0, SECONDS, STEP)
    wanted = 1.2 * np.sin(np.pi * time) * (1.0 - np.exp(-time / 0.3)) + 0.4 * np.sin(1.8 * np.pi * time)
    run = plant.simulate(SECONDS, {"reference.theta": Trajectory(time, wanted, "linear")}, np.random.default_rng(5))
    return Recording(
        "a", {key: Channel(key, *run.channels[key], unit) for key, unit in (("current", "A"), ("angle", "rad"))}
    )


def identified(folder: Path, noise: float, estimation: dict[str, Any], inertia: float = 0.012) -> Estimate:
    """Return what is identified of the pendulum, its inertia guessed."""
    write_recording(record(noise), folder / "a.h5")
    friction = {
        "law": "coulomb_viscous",
        "tau_c": {"guess": 0.25, "min": 0, "max": 2},
        "viscous": {"guess": 4e-3, "min": 0, "max": 0.1},
    }
    arm = {
        "name": "arm",
        "inertia": {"guess": inertia, "min": 1e-3, "max": 0.1},
        "gravity": {"torque": {"guess": 1.65, "min": 0, "max": 20}},
        "friction": friction,
    }
    document = {
        "format": "friction-ocp-problem/1",
        "drive": {"motor": {"torque_constant": TORQUE_CONSTANT}, "shafts": [arm]},
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero"},
            "angle": {"measures": "arm.theta", "resolution": float(RESOLUTION)},
        },
        "recordings": {"train": ["a.h5"]},
        "estimation": estimation,
    }
    path = folder / "pendulum.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return identify(load_problem(path))


TRUTH = {
    "arm.inertia": INERTIA,
    "arm.friction.tau_c": COULOMB,
    "arm.friction.viscous": VISCOUS,
    "arm.gravity.torque": WEIGHT,
}


def widths(found: Estimate) -> dict[str, float]:
    """Return the widths of the intervals over the true values, which they hold."""
    for item in found.parameters:
        low, high = item.interval95
        assert low < TRUTH[item.name] < high
    return {item.name: (item.interval95[1] - item.interval95[0]) / TRUTH[item.name] for item in found.parameters}


def test_noise_of_the_current_joins_segments_instead(tmp_path: Path) -> None:
    """The answer says so, and knows the values several times better than a fit of free runs, which stays to be had."""
    found, free = (identified(tmp_path, NOISE, options) for options in ({}, {"fit": "simulation"}))
    assert found.converged and found.warnings[0] == LOST_FREE_RUN
    assert LOST_FREE_RUN not in free.warnings
    known, before = widths(found), widths(free)
    assert all(known[name] < 0.3 * before[name] for name in TRUTH)
    assert known["arm.friction.tau_c"] < 0.03


def test_segments_begin_where_free_runs_have_ended(tmp_path: Path) -> None:
    """So that their end does not hang on the guesses."""
    one, other = (identified(tmp_path, NOISE, {}, guess) for guess in (0.012, 0.03))
    known = widths(one)
    assert all(abs(one.values[name] - other.values[name]) < 0.1 * known[name] * TRUTH[name] for name in TRUTH)


def test_free_runs_are_fitted_where_the_current_is_known(tmp_path: Path) -> None:
    """What sensors err explains what is left."""
    found = identified(tmp_path, 0.0, {})
    assert found.converged and LOST_FREE_RUN not in found.warnings
    assert found.values["arm.friction.tau_c"] == pytest.approx(COULOMB, rel=1e-3)
