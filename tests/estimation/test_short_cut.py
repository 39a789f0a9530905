"""A way to the answer through short segments, where an encoder is so fine that long ones lead nowhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission
from swinging import swung

from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.model import Model, prepare_fit
from friction_ocp.estimation.progress import Phases, silent
from friction_ocp.estimation.rounds import Fitted, joined, limits
from friction_ocp.estimation.short_cut import through_short_segments
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.simulation.losses import Squares

TRUTH = {
    "motor.inertia": 2e-4,
    "motor.friction.tau_c": 0.04,
    "motor.friction.viscous": 2e-4,
    "load.inertia": 0.012,
    "load.friction.tau_c": 0.4,
    "load.friction.viscous": 0.03,
    "motor-load.stiffness": 150.0,
}
STEP, SECONDS = 4e-3, 12.0
COUNT, FINE = 2.0 * np.pi / 8000.0, 2.0 * np.pi / 2**24
"""Of the encoders of motor and load, rad."""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """A right model of an elastic drive whose load has a fine encoder, its numbers guessed a third off."""
    folder = tmp_path_factory.mktemp("fine")
    motor = PlantShaft("motor", 2e-4, PlantFriction("coulomb_viscous", tau_c=0.04, viscous=2e-4))
    load = PlantShaft("load", 0.012, PlantFriction("coulomb_viscous", tau_c=0.4, viscous=0.03))
    plant = Plant(
        shafts=(motor, load),
        transmissions=(PlantTransmission("motor", "load", 5.0, 150.0, 0.09),),
        motors=(PlantMotor("drive", "motor", torque_constant=0.25),),
        sensors=(
            PlantSensor("current", "drive.current", STEP, noise_std=2e-5),
            PlantSensor("encoder", "motor.theta", STEP, resolution=COUNT),
            PlantSensor("scale", "load.theta", STEP, resolution=FINE, noise_std=2e-7),
        ),
    )
    units = {"current": "A", "encoder": "rad", "scale": "rad"}
    for k, name in enumerate(("one", "two")):
        write_recording(swung(name, plant, (0.31, 0.83, 1.9), SECONDS, STEP, units, 60 + k), folder / f"{name}.h5")
    return prepare_fit(load_problem(_written(folder)))


def _written(folder: Path) -> Path:
    def shaft(name: str, inertia: float, dry: float, viscous: float) -> dict[str, Any]:
        friction = {
            "law": "coulomb_viscous",
            "tau_c": {"guess": dry, "min": 0},
            "viscous": {"guess": viscous, "min": 0},
        }
        return {"name": name, "inertia": {"guess": inertia, "min": 0.1 * inertia}, "friction": friction}

    content = {
        "format": "friction-ocp-problem/1",
        "drive": {
            "motor": {"torque_constant": 0.25},
            "shafts": [shaft("motor", 1.2e-4, 0.03, 3e-4), shaft("load", 0.01, 0.28, 0.02)],
            "transmissions": [{"ratio": 5.0, "stiffness": {"guess": 80.0, "min": 10, "max": 1e5}, "damping": 0.09}],
        },
        "channels": {
            "current": {"measures": "motor.current", "role": "input"},
            "encoder": {"measures": "motor.theta", "resolution": COUNT},
            "scale": {"measures": "load.theta", "resolution": FINE, "noise_std": 2e-7},
        },
        "recordings": {"train": ["one.h5", "two.h5"]},
    }
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def stuck(model: Model) -> Fitted:
    """Where long segments lead from the guesses."""
    program = joined(model, 0.0, Squares())
    watch = Phases(silent, 1).begin("fit")
    return Fitted(
        solve_gauss_newton(program, suggested_point(program, model.space.guess), limits(model), watch), program
    )


def test_long_segments_lead_nowhere(model: Model, stuck: Fitted) -> None:
    """Though the model is right, they end at a thousand times the noise and a tenth beside the truth."""
    assert stuck.solution.objective > 1e6 * 0.5 * stuck.program.samples
    assert np.max(np.abs(stuck.solution.point.theta / _truth(model) - 1.0)) > 0.1


def test_short_ones_lead_to_the_truth(model: Model, stuck: Fitted) -> None:
    """Within a per cent, and the program is the one that it was."""
    found = through_short_segments(model, stuck, Phases(silent, 2))
    assert found.program is stuck.program
    assert found.solution.objective == pytest.approx(found.program.objective(found.solution.point))
    assert found.solution.objective < 1e-5 * stuck.solution.objective
    assert found.solution.iterations > stuck.solution.iterations
    assert found.solution.point.theta == pytest.approx(_truth(model), rel=0.01)


def test_segments_of_few_samples_lead_where_loose_noise_joins_long_ones(model: Model) -> None:
    """Stated far too large, it lets every segment stick and slide on its own, and the end is none of a right model."""
    loose = _joined_by(model, process_noise={"load": 1e-2})
    program = joined(loose, 0.0, Squares())
    start = suggested_point(program, loose.space.guess)
    stuck = Fitted(
        solve_gauss_newton(program, start, limits(loose), Phases(silent, 1).begin("fit")),
        program,
    )
    found = through_short_segments(loose, stuck, Phases(silent, 5))
    assert found.program is program
    assert found.solution.objective < 0.1 * stuck.solution.objective
    assert found.solution.point.theta == pytest.approx(_truth(model), rel=0.01)


@pytest.mark.slow
def test_noise_that_is_asked_for_is_not_what_a_stuck_fit_leaves(model: Model) -> None:
    """The load has none: what is found is a thousandth of its friction from sample to sample."""
    asked = _joined_by(model, estimated_noise=("load",))
    after, fitted = settled(asked)
    assert fitted.solution.point.theta == pytest.approx(_truth(model), rel=0.01)
    (level,) = after.noise_levels
    assert level.value / np.sqrt(STEP) < 1e-3 * TRUTH["load.friction.tau_c"]


def _joined_by(model: Model, **options: Any) -> Model:
    """Return the model with segments that torque noise joins."""
    problem = model.problem
    return prepare_fit(replace(problem, estimation=replace(problem.estimation, fit="relaxed", **options)))


def test_what_ends_at_the_noise_stays(model: Model, stuck: Fitted) -> None:
    """No other way is tried from there."""
    quiet = replace(stuck.solution, objective=0.5 * stuck.program.samples)
    fitted = Fitted(quiet, stuck.program)
    assert through_short_segments(model, fitted, Phases(silent, 2)) is fitted


def _truth(model: Model) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([TRUTH[name] for name in model.space.names])
