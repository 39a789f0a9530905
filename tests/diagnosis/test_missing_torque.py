"""Waves at a motor that drives an arm nobody sees, by a stiff joint: whose torque it is that is missing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from diagnosis_cases import write_problem
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantRipple,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
)

from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.effects.effect import Clues
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.statistics.execution import Execution

RATIO, STIFFNESS, DAMPING, TORQUE_CONSTANT = 100.0, 1.6e4, 25.0, 0.1
INERTIAS, FRICTION = (1.1e-4, 3.1), ((0.045, 1.1e-4), (2.0, 1.2))
SECONDS, STEP, RESOLUTION = 2.5, 1e-3, 2.0 * np.pi / 2**17
WAVES, SHARE, PHASE = 8, 0.05, 0.4
"""Of the ripple in a turn, its size over the torque, and where it begins."""
UNITS = {"current": "A", "motor_angle": "rad"}


def record(name: str, seed: int) -> Recording:
    """Move far and fast, or creep, by a loop that holds against the weight of the friction."""
    shafts = (
        PlantShaft(
            "motor", INERTIAS[0], PlantFriction("coulomb_viscous", tau_c=FRICTION[0][0], viscous=FRICTION[0][1])
        ),
        PlantShaft("arm", INERTIAS[1], PlantFriction("coulomb_viscous", tau_c=FRICTION[1][0], viscous=FRICTION[1][1])),
    )
    ripple = PlantRipple(2.0 * np.pi / WAVES, SHARE * np.cos(PHASE), SHARE * np.sin(PHASE))
    plant = Plant(
        shafts=shafts,
        transmissions=(PlantTransmission("motor", "arm", RATIO, STIFFNESS, DAMPING, 0.0),),
        motors=(
            PlantMotor("motor", "motor", torque_constant=TORQUE_CONSTANT, controller="loop", torque_ripple=ripple),
        ),
        controllers=(PlantController("loop", "cascade", "fine", kp=20.0, ki=2.0, kd=0.3, sample_time=STEP),),
        sensors=(
            PlantSensor("fine", "motor.theta", period=STEP, resolution=RESOLUTION / 16),
            PlantSensor("motor_angle", "motor.theta", period=STEP, resolution=RESOLUTION),
            PlantSensor("current", "motor.current", period=STEP, noise_std=0.01),
        ),
    )
    rng, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, STEP)
    size, rate = (3.0, 0.4) if name == "b" else (60.0, 0.7)
    wanted = size * np.sin(2.0 * np.pi * rate * time) * (1.0 - np.exp(-time / 0.3))
    run = plant.simulate(SECONDS, {"reference.theta": Trajectory(time, wanted, "linear")}, rng)
    return Recording(name, {key: Channel(key, *run.channels[key], UNITS[key]) for key in UNITS})


def document() -> dict[str, Any]:
    """Return the problem of an arm whose motor has no ripple."""

    def shaft(name: str, inertia: float, coulomb: float, viscous: float) -> dict[str, Any]:
        return {
            "name": name,
            "inertia": {"guess": inertia, "min": 0.5 * inertia, "max": 2.0 * inertia},
            "friction": {
                "law": "coulomb_viscous",
                "tau_c": {"guess": coulomb, "min": 0.0, "max": 10.0 * coulomb},
                "viscous": {"guess": viscous, "min": 0.0, "max": 10.0 * viscous},
            },
        }

    shafts = [shaft(*parts) for parts in zip(("motor", "arm"), INERTIAS, *zip(*FRICTION, strict=True), strict=True)]
    return {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": TORQUE_CONSTANT},
            "shafts": shafts,
            "transmissions": [{"ratio": RATIO, "stiffness": STIFFNESS, "damping": DAMPING}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input"},
            "motor_angle": {"measures": "motor.theta", "resolution": float(RESOLUTION)},
        },
    }


@pytest.fixture(scope="module")
def clues(tmp_path_factory: pytest.TempPathFactory) -> Clues:
    """Return what the base model says of the arm."""
    path = write_problem(tmp_path_factory.mktemp("arm"), record, document())
    return open_bench(load_problem(path), Execution(InProcess())).clues


def test_a_ripple_is_found_where_the_motor_alone_lacks_torque(clues: Clues) -> None:
    """A joint shares it out between both shafts, and fast moves pass a wave within every segment."""
    likeliest = clues.waves("motor", "theta", against_torque="motor")[0]
    travel = float(np.ptp(clues.angles("motor")))
    assert abs(1.0 / likeliest.period - WAVES / (2.0 * np.pi)) < 1.0 / travel
    assert likeliest.share > 0.2 and not likeliest.apart


def test_what_is_missing_at_the_motor_alone_is_the_ripple(clues: Clues) -> None:
    """In size, too, where the motor creeps; with the arm free to lack torque it is a small part of it."""
    (track,) = [track for track in clues.tracks if track.recording == "b"]
    for found, least, most in ((track.alone["motor"], 0.7, 1.1), (track.finely, 0.0, 0.5)):
        moving = np.abs(found.omega["motor"]) > 1.0
        torque = track.torque["motor"][found.middle][moving]
        ripple = SHARE * torque * np.cos(WAVES * found.theta["motor"][moving] - PHASE)
        share = float(ripple @ found.torque["motor"][moving]) / float(ripple @ ripple)
        assert least < share < most
