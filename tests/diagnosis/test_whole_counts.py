"""A feed drive at feeds that are whole counts of its scale a sample: errors of rounding that stay for a whole move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
)

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.footing import footing
from friction_ocp.diagnosis.free_gap import left_out_errors
from friction_ocp.diagnosis.sharpening import sharpened
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.node_ends import begun
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.simulation.grid import FloatArray

TRUTH = {
    "screw.inertia": 1.1e-3,
    "screw.friction.tau_c": 0.25,
    "screw.friction.viscous": 1.5e-3,
    "carriage.inertia": 200.0,
    "carriage.friction.tau_c": 180.0,
    "carriage.friction.viscous": 500.0,
    "screw-carriage.stiffness": 6e7,
    "screw-carriage.damping": 9e3,
}
RATIO, TORQUE_CONSTANT = 2.0 * np.pi / 0.01, 0.6
"""Turns of the screw by travel, rad/m, and N m/A."""
STEP, SECONDS, TICK = 2e-3, 6.0, 5e-4
ENCODER, SCALE = 2.0 * np.pi / 2**17, 5e-7
"""Counts of the encoder, rad, and of the scale, m."""
FEEDS = {"fast": (0.02, 0.05, 0.1, 0.2), "slow": (0.001, 0.003, 0.01), "other": (0.005, 0.03, 0.15)}
"""By recording: m/s; all are whole counts a sample."""
UNITS = {"current": "A", "encoder": "rad", "scale": "m"}


def moves(feeds: tuple[float, ...], rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return m and m/s, every tick: moves of trapezoidal speed with rests between them."""
    speed, place, stroke = [np.zeros(400)], 0.0, 0.1 * min(1.0, max(feeds) / 0.05)
    while sum(part.size for part in speed) * TICK < SECONDS + 0.1:
        feed, wanted = float(rng.choice(feeds)), float(rng.uniform(-stroke, stroke))
        distance = abs(wanted - place)
        rise = round(feed / 3.0 / TICK) + 20
        flat = max(round(distance / feed / TICK) - rise, 0)
        ramp = np.sin(0.5 * np.pi * np.arange(rise) / rise) ** 2
        move = np.sign(wanted - place) * feed * np.concatenate([ramp, np.ones(flat), ramp[::-1]])
        place += float(np.sum(move)) * TICK
        speed += [move, np.zeros(round(rng.uniform(0.1, 0.4) / TICK))]
    rate = np.concatenate(speed)
    return np.cumsum(rate) * TICK, rate


def record(name: str, seed: int) -> Recording:
    """Move the carriage by the encoder of its motor."""
    screw = PlantShaft("screw", 1.1e-3, PlantFriction("coulomb_viscous", tau_c=0.25, viscous=1.5e-3))
    carriage = PlantShaft("carriage", 200.0, PlantFriction("coulomb_viscous", tau_c=180.0, viscous=500.0))
    plant = Plant(
        shafts=(screw, carriage),
        transmissions=(PlantTransmission("screw", "carriage", RATIO, 6e7, 9e3),),
        motors=(PlantMotor("motor", "screw", torque_constant=TORQUE_CONSTANT, controller="loop"),),
        controllers=(PlantController("loop", "cascade", "fine", kp=30.0, ki=4.0, kd=0.45, sample_time=TICK),),
        sensors=(
            PlantSensor("fine", "screw.theta", period=TICK, resolution=ENCODER / 16.0),
            PlantSensor("current", "motor.current", period=STEP, noise_std=0.03),
            PlantSensor("encoder", "screw.theta", period=STEP, resolution=ENCODER),
            PlantSensor("scale", "carriage.theta", period=STEP, resolution=SCALE),
        ),
    )
    rng = np.random.default_rng(seed)
    place, rate = moves(FEEDS[name], rng)
    time = TICK * np.arange(place.size)
    wanted = {"theta": RATIO * place, "omega": RATIO * rate}
    inputs = {f"reference.{key}": Trajectory(time, values, "linear") for key, values in wanted.items()}
    run = plant.simulate(SECONDS, inputs, rng)
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in UNITS.items()})


def shaft(name: str, inertia: float, spread: float, tau_c: float, viscous: float, motion: str) -> dict[str, Any]:
    numbers = {"tau_c": {"guess": tau_c, "min": 0}, "viscous": {"guess": viscous, "min": 0}}
    return {
        "name": name,
        "motion": motion,
        "inertia": {"guess": inertia, "prior_std": spread},
        "friction": {"law": "coulomb_viscous", **numbers},
    }


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """A model that is right, but for its numbers."""
    folder = tmp_path_factory.mktemp("feeds")
    for k, name in enumerate(FEEDS):
        write_recording(record(name, 20 + k), folder / f"{name}.h5")
    joint = {"guess": 5e7, "min": 5e6, "max": 1e9}
    document = {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": [
                shaft("screw", 1.2e-3, 1.2e-4, 0.2, 2e-3, "rotary"),
                shaft("carriage", 185.0, 20.0, 150.0, 400.0, "linear"),
            ],
            "transmissions": [{"ratio": RATIO, "stiffness": joint, "damping": {"guess": 6e3, "min": 0}}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input"},
            "encoder": {"measures": "screw.theta", "resolution": ENCODER},
            "scale": {"measures": "carriage.theta", "resolution": SCALE},
        },
        "recordings": {"train": ["fast.h5", "slow.h5"], "validation": ["other.h5"]},
    }
    (folder / "problem.yaml").write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return prepare(load_problem(folder / "problem.yaml"))


def test_errors_that_stay_count_once(model: Model) -> None:
    """What the truth leaves is what noise does then; with every sample of a move at once it is more."""
    foot = sharpened(model, footing(model, model.space.with_known(TRUTH)))
    assert foot.noisy_inputs == ("current",)
    program = foot.training(model)
    scale = model.drive.output_names.index("scale")
    seen, there = (
        sum(int(np.isfinite(item.measured[:, scale]).sum()) for item in items)
        for items in (program.experiments, foot.train)
    )
    assert seen < 0.5 * there
    truth = begun(program, model.space.with_known(TRUTH))
    assert 2.0 * program.objective(truth) / program.samples == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_the_load_behind_the_screw_is_told(model: Model) -> None:
    """Friction winds up the screw by a few counts, and an error of half a count that stays would change all of it."""
    fitted = fit_base(model)
    loads = ("carriage.inertia", "carriage.friction.tau_c", "screw-carriage.stiffness", "carriage.friction.viscous")
    for name in loads:
        assert fitted.values[name] == pytest.approx(TRUTH[name], rel=0.03), name
    every = sum(int(np.isfinite(item.measured).any(axis=1).sum()) for item in fitted.footing.train)
    assert np.sum(left_out_errors(fitted).count) >= every
