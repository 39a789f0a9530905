"""A current at its limits is true where the amplifier is at its limit, and false where the log is cut off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from problem_workshop import COULOMB, INERTIA, TORQUE_CONSTANT, VISCOUS, Workshop

from friction_ocp.problem_file.check import check
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.grid import FloatArray

LIMIT = 0.4


def turned(time: FloatArray, current: FloatArray) -> FloatArray:
    """Integrate a body with friction under a current that is held between samples."""
    omega = np.zeros_like(time)
    for k in range(time.size - 1):
        friction = VISCOUS * omega[k] + COULOMB * np.tanh(omega[k] / 0.02)
        omega[k + 1] = omega[k] + (time[k + 1] - time[k]) * (TORQUE_CONSTANT * current[k] - friction) / INERTIA
    return np.concatenate(([0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]) * np.diff(time))))


@pytest.mark.parametrize(("flows", "severity"), [(True, "warning"), (False, "error")])
def test_motion_tells_whether_a_current_was_limited_or_its_record(
    workshop: Workshop, flows: bool, severity: str
) -> None:
    """A noisy demand cut off at its limit is doubtful if that current flowed, and wrong if the whole demand did."""
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 6.0, 0.002)
    demand = 0.6 * np.sin(2 * np.pi * 0.7 * time) + 0.03 * rng.standard_normal(time.size)
    shown = np.clip(demand, -LIMIT, LIMIT)

    def record(file: Any) -> None:
        for name, values in (("current", shown), ("position", turned(time, shown if flows else demand))):
            file[f"/channels/{name}"][...] = values

    workshop.recording(spoil=record)
    found = [item for item in check(load_problem(workshop.problem())) if "is clipped" in item.what]
    assert [item.severity for item in found] == [severity]
    assert ("amplifier was at its limit" in found[0].remedy) == flows


@pytest.mark.parametrize(("stated", "found"), [(LIMIT, []), (1.5 * LIMIT, ["error"])])
def test_a_command_may_stay_at_the_stated_limits_of_its_controller(
    workshop: Workshop, stated: float, found: list[str]
) -> None:
    """A recorded command without noise that saturates is as it should be; one cut off elsewhere is not."""
    time = np.arange(0.0, 6.0, 0.002)
    current = np.clip(0.6 * np.sin(2 * np.pi * 0.7 * time), -LIMIT, LIMIT)

    def record(file: Any) -> None:
        for name, values in (("current", current), ("position", turned(time, current))):
            file[f"/channels/{name}"][...] = values
        file["/channels/wanted"] = 3.0 * np.sin(2 * np.pi * 0.7 * time)
        file["/channels/wanted"].attrs["unit"] = "rad"

    def close(content: dict[str, Any]) -> None:
        loop = {"type": "pd", "feedback": "position", "output": "current", "kp": 1.0, "kd": 0.1, "sample_time": 0.002}
        content["drive"]["controller"] = loop | {"saturation": [-stated, stated]}
        content["channels"]["wanted"] = {"measures": "reference.theta", "role": "input"}
        content["channels"]["current"]["role"] = "output"

    workshop.recording(spoil=record)
    findings = check(load_problem(workshop.problem(close)))
    assert [item.severity for item in findings if "is clipped" in item.what] == found


def goes(time: FloatArray, abruptly: bool, on: float = 1.0) -> FloatArray:
    """Return an angle that goes to and fro, at one speed or as a sine, and is cut off at both ends: `on` as far out."""
    if abruptly:
        return np.clip(np.abs((0.5 * time) % 2.0 - 1.0) - 0.5, -0.3 * on, 0.3 * on)
    return np.clip(0.6 * np.sin(np.pi * time), -0.5 * on, 0.5 * on)


def found(workshop: Workshop, signals: dict[str, FloatArray], speed_is_recorded: bool) -> list[str]:
    """Return the severities of what is found to be clipped."""

    def record(file: Any) -> None:
        for name, values in signals.items():
            file.pop(f"channels/{name}", None)
            file[f"/channels/{name}"] = values
            file[f"/channels/{name}"].attrs["unit"] = {"current": "A", "position": "rad"}.get(name, "rad/s")

    def see(content: dict[str, Any]) -> None:
        if speed_is_recorded:
            content["channels"]["speed"] = {"measures": "load.omega", "noise_std": 1e-3}

    workshop.recording(spoil=record)
    findings = check(load_problem(workshop.problem(see)))
    return [item.severity for item in findings if "is clipped" in item.what and "position" in item.what]


@pytest.mark.parametrize(("abruptly", "severity"), [(True, "warning"), (False, "error")])
def test_a_motion_that_comes_straight_to_its_extremes_may_rest_there(
    workshop: Workshop, abruptly: bool, severity: str
) -> None:
    """What was turning and is cut off is wrong; what stops at one speed within a sample may be a machine at rest."""
    time = np.arange(0.0, 6.0, 0.002)
    signals = {"current": 0.2 * np.sin(time), "position": goes(time, abruptly)}
    assert found(workshop, signals, speed_is_recorded=False) == [severity]


@pytest.mark.parametrize("rests", [True, False])
@pytest.mark.parametrize("abruptly", [True, False])
def test_another_channel_shows_whether_a_motion_rests(workshop: Workshop, abruptly: bool, rests: bool) -> None:
    """An angle is not cut off where the recorded speed is zero, and is where it goes on."""
    time, rng = np.arange(0.0, 6.0, 0.002), np.random.default_rng(3)
    angle = goes(time, abruptly)
    speed = np.gradient(goes(time, abruptly, on=1.0 if rests else 2.0), time) + 1e-3 * rng.standard_normal(time.size)
    signals = {"current": 0.2 * np.sin(time), "position": angle, "speed": speed}
    assert bool(found(workshop, signals, speed_is_recorded=True)) == (not rests)
