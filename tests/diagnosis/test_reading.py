"""Inputs that a machine held between its samples, and whose file says otherwise."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, ENCODER_STEP, INERTIA, TORQUE_CONSTANT, VISCOUS, axis, plain_drive, write_case
from plant import Plant, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory

from friction_ocp.diagnosis import reading
from friction_ocp.diagnosis.aside import OtherReadings
from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.diagnose import Diagnosis, diagnose
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis_document import diagnosis_document
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.statistics.execution import Execution

TICK, LOGGED, SECONDS, STIFFNESS = 1e-3, 0.01, 4.0, 3.0
DAMPED = 30.0 * VISCOUS


def found(folder: Path, **friction: object) -> Diagnosis:
    """Diagnose an axis whose current was held, with a file that joins its samples by lines."""
    path = write_case(folder, axis(**friction))
    path.write_text(path.read_text(encoding="utf-8").replace("hold: zero", "hold: linear"), encoding="utf-8")
    return diagnose(load_problem(path))


@pytest.mark.slow
def test_a_held_input_is_no_delay(tmp_path: Path) -> None:
    """A model that lacks nothing has no gap; that its input is held is said beside what is assumed."""
    seen = found(tmp_path)
    assert seen.verdict == "no_gap"
    assert any(text.startswith("current: is held") for text in diagnosis_document(seen)["assumptions"])


@pytest.mark.slow
def test_an_effect_is_found_beside_it(tmp_path: Path) -> None:
    """What the drive has is named, and no delay with it."""
    assert found(tmp_path, law="stribeck", tau_s=0.15, omega_s=6.0).accepted == (("stribeck", "motor"),)


def servo(folder: Path, effects: tuple[str, ...], **friction: object) -> Path:
    """Write runs of a servo that is told its goal once a log line, and a file that does not say that it is held."""
    law = PlantFriction(**{"law": "coulomb_viscous", "tau_c": COULOMB, "viscous": DAMPED, **friction})
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, law),),
        motors=(PlantMotor("motor", "motor", torque_constant=TORQUE_CONSTANT, controller="loop"),),
        controllers=(PlantController("loop", "p", "position", kp=STIFFNESS, sample_time=TICK),),
        sensors=(
            PlantSensor("position", "motor.theta", period=TICK, resolution=ENCODER_STEP),
            PlantSensor("shown", "motor.theta", period=LOGGED, resolution=ENCODER_STEP),
        ),
    )
    for k, name in enumerate("abc"):
        rng = np.random.default_rng(k)
        time, phase = np.arange(0.0, SECONDS, LOGGED), rng.uniform(0.0, 2.0 * np.pi, 3)
        goal = 4.0 * np.sin((1.0 + 0.3 * k) * time**1.5 + phase[0]) - 4.0 * np.sin(phase[0])
        run = plant.simulate(SECONDS, {"reference.theta": Trajectory(time, goal, "zero")}, rng)
        stamps, shown = (values[: time.size] for values in run.channels["shown"])
        np.testing.assert_allclose(stamps, time, atol=1e-9)
        channels = {name: Channel(name, time, values, "rad") for name, values in (("position", shown), ("goal", goal))}
        write_recording(Recording(name, channels), folder / f"{name}.h5")
    document = {
        "format": "friction-ocp-problem/1",
        "drive": plain_drive(DAMPED),
        "controller": {"type": "p", "feedback": "position", "kp": STIFFNESS, "sample_time": TICK, "output": "current"},
        "channels": {
            "goal": {"measures": "reference.theta", "role": "input"},
            "position": {"measures": "motor.theta", "resolution": ENCODER_STEP},
        },
        "recordings": {"train": ["a.h5", "b.h5"], "validation": ["c.h5"]},
        "diagnosis": {"effects": list(effects)},
    }
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_held_goal_is_no_lag(tmp_path: Path) -> None:
    """A servo that follows its goal in steps has no lag that its model lacks."""
    seen = diagnose(load_problem(servo(tmp_path, ("stribeck", "drive_lag", "sensor_delay", "quadratic_drag"))))
    assert seen.verdict == "no_gap"
    assert any(text.startswith("goal: is held") for text in diagnosis_document(seen)["assumptions"])


@pytest.mark.slow
def test_a_held_goal_is_told_beside_what_nothing_explains(tmp_path: Path) -> None:
    """Read like that the model leaves less, though what is missing is none of the candidates; and it is no lag."""
    friction = {"law": "stribeck", "tau_s": 1.2 * COULOMB, "omega_s": 3.0}
    seen = diagnose(load_problem(servo(tmp_path, ("drive_lag", "quadratic_drag"), **friction)))
    assert seen.verdict == "unknown_effect" and "drive_lag" not in dict(seen.accepted)
    assert any(text.startswith("goal: is held") for text in diagnosis_document(seen)["assumptions"])


@pytest.mark.slow
def test_what_was_fitted_beside_the_refits_is_what_is_fitted_when_asked_for(tmp_path: Path) -> None:
    """The base model of another reading is the same, be it the work of a task before or of whoever asks."""
    path = write_case(tmp_path, axis(law="stribeck", tau_s=0.15, omega_s=6.0))
    problem = load_problem(path)
    bench = open_bench(problem, Execution(InProcess()))
    kept = OtherReadings(problem)
    tasks = kept.tasks()
    kept.keep(bench, [task.function(bench, *task.arguments) for task in tasks])
    asked = OtherReadings(problem).fitted(bench.base)
    assert len(tasks) == len(asked) > 0
    for (read, base), (same, expected) in zip(kept.fitted(bench.base), asked, strict=True):
        assert read.drive == same.drive
        np.testing.assert_allclose(base.theta, expected.theta, rtol=1e-12)
        assert base.objective == pytest.approx(expected.objective, rel=1e-12)


@pytest.mark.parametrize(
    ("left", "read", "more"), [(1.5, 1.4, False), (1.5, 1.2, True), (0.902, 0.903, False), (0.902, 0.8, True)]
)
def test_another_reading_has_to_leave_notably_less(
    left: float, read: float, more: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where stated floors are too high, and a slow torque alone shows that something is missing."""

    def power(fitted: Any) -> Excess:
        return Excess(float(fitted.power), 0.5)

    monkeypatch.setattr(reading, "innovations", power)
    stated, other = (cast(Any, SimpleNamespace(power=ratio)) for ratio in (left, read))
    assert reading.explains_more(other, stated, stated, (), {}, True) == more
    assert not reading.explains_more(other, stated, stated, (), {}, False)
