"""The EMPS benchmark: its force error, its problem files, its published numbers."""

from __future__ import annotations

from pathlib import Path

import emps
import numpy as np
import pytest
from checks import status
from plant import Plant, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory

from friction_ocp.estimation.estimate import ParameterEstimate
from friction_ocp.estimation.identifiability import Verdict
from friction_ocp.problem_file.check import check
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

NAMES = ("force_driven", "closed_loop", "force_driven_asymmetric", "closed_loop_asymmetric")
JUMP = 0.03
"""What filtering makes of the jumps of Coulomb friction, over the force."""
DURATION = 12.0
"""s of a simulated run."""
with_data = pytest.mark.skipif(emps.source_folder() is None, reason=f"needs the EMPS data, in {emps.VARIABLE}")


def made_up(values: dict[str, float]) -> Recording:
    """A reversing motion of 8 s and the force that it takes."""
    time = np.arange(0.0, 8.0, emps.PERIOD)
    rate = 2.0 * np.pi * 0.5
    position, speed = 0.1 * (1.0 - np.cos(rate * time)), 0.1 * rate * np.sin(rate * time)
    motion = emps.Motion(speed, 0.1 * rate**2 * np.cos(rate * time), time)
    columns = {
        "position": (position, "m"),
        "reference": (position, "m"),
        "force": (emps.model_force(values, motion), "N"),
    }
    return Recording("emps", {name: Channel(name, time, data, unit) for name, (data, unit) in columns.items()})


@pytest.mark.parametrize("values", [emps.SYMMETRIC, emps.ASYMMETRIC], ids=["symmetric", "asymmetric"])
def test_force_error_of_the_true_parameters_is_small(values: dict[str, float]) -> None:
    """The true parameters leave what filtering makes of the reversals; a tenth more mass leaves more."""
    recording = made_up(values)
    error = emps.force_error(values, recording)
    assert error < JUMP
    heavier = {**values, "carriage.inertia": 1.1 * values["carriage.inertia"]}
    assert emps.force_error(heavier, recording) > 1.5 * error


@pytest.mark.parametrize("name", NAMES)
def test_problem_files_are_sound(name: str, tmp_path: Path) -> None:
    """Each file reads the converted recordings beside it and nothing is wrong with it."""
    recording = made_up(dict(emps.SYMMETRIC))
    for stem in ("emps", "emps_pulses"):
        write_recording(Recording(stem, recording.channels), tmp_path / f"{stem}.h5")
    path = tmp_path / f"{name}.yaml"
    path.write_text((emps.PROBLEMS / path.name).read_text())
    problem = load_problem(path)
    assert not [finding for finding in check(problem) if finding.severity == "error"]
    assert problem.question.startswith("Asked: ")


def driven(name: str, values: dict[str, float], swing: float) -> Recording:
    """The axis as the plant has it, with published numbers, under its loop: both directions and many speeds."""
    sides = {
        key: values.get(f"carriage.friction.{key}")
        or (values[f"carriage.friction.{key}.positive"], values[f"carriage.friction.{key}.negative"])
        for key in ("tau_c", "viscous")
    }
    constant = values.get("carriage.external_torque.constant", 0.0)
    shaft = PlantShaft(
        "carriage",
        values["carriage.inertia"],
        PlantFriction("coulomb_viscous", **sides),
        external_torque=constant,
    )
    loop = PlantController(
        "loop",
        "pd",
        "encoder",
        kp=1370728.5287,
        kd=8557.4262,
        derivative="two_tap_mean",
        saturation=(-351.5065188, 351.5065188),
    )
    sensors = (
        PlantSensor("encoder", "carriage.theta"),
        PlantSensor("position", "carriage.theta", noise_std=1e-7),
        PlantSensor("force", "motor.torque"),
    )
    plant = Plant((shaft,), (), (PlantMotor("motor", "carriage", "torque", controller="loop"),), (loop,), sensors)
    time = np.arange(0.0, DURATION, emps.PERIOD)
    sizes = ((0.08, 0.25), (0.03, 0.6), (swing, 1.1))
    angle = sum(size * (1.0 - np.cos(2.0 * np.pi * rate * time)) for size, rate in sizes) * (1.0 - np.exp(-time))
    wanted = Trajectory(time, np.asarray(angle), "zero")
    done = plant.simulate(DURATION, {"reference.theta": wanted}, np.random.default_rng(1), step=1e-4)
    columns = {"position": (done.channels["position"], "m"), "force": (done.channels["force"], "N")}
    channels = {key: Channel(key, *column, unit) for key, (column, unit) in columns.items()}
    grid = channels["position"].time
    return Recording(name, channels | {"reference": Channel("reference", grid, wanted.at(grid), "m")})


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_problem_files_find_the_numbers_of_a_simulated_axis(name: str, tmp_path: Path) -> None:
    """Without the data, too, each file is identified: on runs of the plant that has the published numbers."""
    values = emps.ASYMMETRIC if name.endswith("asymmetric") else emps.SYMMETRIC
    for stem, swing in (("emps", 0.01), ("emps_pulses", 0.006)):
        write_recording(driven(stem, dict(values), swing), tmp_path / f"{stem}.h5")
    found = emps.identify_problem(name, tmp_path).estimate
    assert found.converged
    for key, wanted in values.items():
        assert found.values[key] == pytest.approx(wanted, rel=emps.PARAMETER_TOLERANCE), key


@pytest.mark.parametrize(
    ("value", "interval", "word", "expected"),
    [
        (1.01, (1.005, 1.015), "ok", True),
        (1.05, (0.9, 1.2), "traded", True),
        (1.05, (1.04, 1.06), "traded", False),
        (1.05, (0.9, 1.2), "ok", False),
    ],
)
def test_parameter_is_within_two_per_cent_or_traded(
    value: float, interval: tuple[float, float], word: str, expected: bool
) -> None:
    """A parameter that is further away needs the verdict and the interval."""
    estimate = ParameterEstimate("a", value, "kg", 0.1, interval, 1.0, Verdict(word))
    assert emps.parameter_is_right(estimate, 1.0) is expected


def test_benchmark_is_skipped_without_data(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The message says what to do."""
    monkeypatch.delenv(emps.VARIABLE, raising=False)
    assert emps.main([]) == 0
    assert f"skipped: {emps.VARIABLE}" in capsys.readouterr().out


def test_data_are_not_committed() -> None:
    """Recordings in the folder of the problem files are ignored."""
    assert "*.h5" in (emps.PROBLEMS / ".gitignore").read_text().splitlines()


@with_data
def test_published_force_errors_are_reproduced(tmp_path: Path) -> None:
    """The protocol is the published one: its parameters give its errors."""
    source = emps.source_folder()
    assert source is not None
    emps.convert_folder(source, tmp_path)
    assert emps.force_errors(emps.SYMMETRIC, tmp_path) == pytest.approx((0.04083, 0.05982), abs=1e-5)
    assert emps.force_errors(emps.ASYMMETRIC, tmp_path)[0] == pytest.approx(0.03112, abs=1e-5)


@pytest.mark.slow
@with_data
def test_force_driven_fit_meets_the_reference(capsys: pytest.CaptureFixture[str]) -> None:
    """Every line of the force-driven fit holds, and the table is printed."""
    source = emps.source_folder()
    assert source is not None
    assert status(emps.run_benchmark(source, ["force_driven"])) == 0
    assert "carriage.inertia" in capsys.readouterr().out
