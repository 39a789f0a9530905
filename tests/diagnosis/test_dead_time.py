"""Commands that are acted on after a dead time: all that is seen of the drive is later by it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import INERTIA, SECONDS, STEP, axis, write_case
from plant import Plant, PlantAmplifier, PlantSensor, Trajectory, steps_and_multisine

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.model import late_of, prepare
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

LAG, DEAD = 0.006, 0.009
"""s: three samples, and four and a half."""
TIMES = ("lag", "dead_time")
UNITS = {"position": "rad", "speed": "rad/s", "current": "A"}


def late_axis(lag: float = LAG) -> Plant:
    """Return an axis with a tachometer beside its encoder, whose motor follows late what is recorded: the command."""
    plain = axis()
    speed = PlantSensor("speed", "motor.omega", period=STEP, noise_std=0.05)
    command = replace(plain.sensors[1], measures="motor.command", noise_std=0.0)
    amplifier = PlantAmplifier(delay=DEAD, time_constant=lag)
    motors = (replace(plain.motors[0], amplifier=amplifier),)
    return replace(plain, motors=motors, sensors=(plain.sensors[0], speed, command))


def write(folder: Path, plant: Plant, **motor: object) -> Path:
    """Write recordings of the axis and a problem that knows of no lateness but what is stated of the motor."""
    path = write_case(folder, axis(), effects=("drive_lag", "sensor_delay", "quadratic_drag"))
    for k, name in enumerate("abc"):
        rng = np.random.default_rng(20 + k)
        steps = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 20.0), SECONDS, rng)
        time = np.arange(0.0, SECONDS, STEP)
        current = Trajectory(time, np.interp(time, np.asarray(steps.time), np.asarray(steps.value)), "zero")
        run = plant.simulate(SECONDS, {"motor.current": current}, rng)
        channels = {key: Channel(key, *run.channels[key], unit) for key, unit in UNITS.items()}
        write_recording(Recording(name, channels), folder / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["channels"]["speed"] = {"measures": "motor.omega", "noise_std": 0.05}
    document["drive"]["motor"] |= motor
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lag", "within"), [(LAG, {"lag": 0.05 * LAG, "dead_time": 0.05 * DEAD}), (0.0, dict.fromkeys(TIMES, 0.4 * STEP))]
)
def test_lag_and_dead_time_are_told_apart(lag: float, within: dict[str, float], tmp_path: Path) -> None:
    """Late by both or by dead time alone, the motor is named and not its sensors; both times are those of the plant.

    Without a lag the recordings, a sample every 2 ms, tell the sum better than what of it is which.
    """
    found = diagnose(load_problem(write(tmp_path, late_axis(lag))))
    assert found.accepted == (("drive_lag", "motor"),) and found.verdict == "explained"
    for name, true in zip(TIMES, (lag, DEAD), strict=True):
        assert found.final.values[f"motor.{name}"] == pytest.approx(true, abs=within[name])
    assert found.final.values["motor.lag"] + found.final.values["motor.dead_time"] == pytest.approx(
        lag + DEAD, rel=0.02
    )


def test_a_motor_that_is_stated_late_is_late_in_the_simulation(tmp_path: Path) -> None:
    """Whole samples are read earlier, the rest is expanded; nothing is left to explain."""
    fitted = fit_base(prepare(load_problem(write(tmp_path, late_axis(), lag=LAG, dead_time=DEAD))))
    assert not innovations(fitted).significant(0.01)
    assert fitted.values["motor.inertia"] == pytest.approx(INERTIA, rel=1e-3)
    for late in late_of(fitted.model).values():
        assert late == pytest.approx({"position": 4 * STEP, "speed": 4 * STEP})


def test_a_lag_may_be_all_dead_time(tmp_path: Path) -> None:
    """Where a refit of both ends at one of them, it begins again where the other is as late."""
    fitted = fit_base(prepare(load_problem(write(tmp_path, late_axis()))))
    lag = effects()["drive_lag"].addition(fitted.model.problem.drive, "motor", clues_of(fitted))
    assert lag.otherwise is not None
    instead = lag.otherwise({"motor.lag": 0.003, "motor.dead_time": 0.001})
    assert instead["motor.dead_time"] == pytest.approx(0.004) and 0.0 < instead["motor.lag"] < 0.1 * STEP
