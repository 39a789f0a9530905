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
