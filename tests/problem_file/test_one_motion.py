"""Two sensors of one shaft show one motion, however badly they see it; what does not is no sensor of it."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.problem_file.check import check_before_fit
from friction_ocp.problem_file.load import load_problem

STEP = 2e-3


def second_sensor(kind: str, theta: Any) -> tuple[Any, str]:
    """Return what another sensor shows of an angle, and its unit."""
    rng, omega = np.random.default_rng(2), np.gradient(theta, STEP)
    smooth = np.convolve(theta, np.ones(51) / 51.0, "same")
    shown = {
        "noisy tachometer": omega + 0.3 * np.std(omega) * rng.standard_normal(omega.size),
        "reversed and late": -np.roll(omega, 10),
        "coarse encoder": np.round(theta / 0.1) * 0.1,
        "noise of a sensor that is not connected": 1e-3 * rng.standard_normal(omega.size),
        "following error": 0.05 * np.gradient(omega, STEP) / 50.0 + 0.002 * (smooth - theta),
        "another axis": np.sin(2.0 * np.pi * 1.13 * STEP * np.arange(theta.size)),
    }[kind]
    return shown, "rad/s" if kind in ("noisy tachometer", "reversed and late") else "rad"


@pytest.mark.parametrize(
    "told, kinds",
    [
        (False, ("noisy tachometer", "reversed and late", "coarse encoder", "noise of a sensor that is not connected")),
        (True, ("following error", "another axis")),
    ],
)
def test_sensors_that_see_another_motion_are_told(workshop: Workshop, told: bool, kinds: tuple[str, ...]) -> None:
    """A following error and another axis are told; noise, coarse steps, a sign and 20 ms are not."""
    for kind in kinds:

        def add(file: h5py.File, kind: str = kind) -> None:
            file["channels/second"], unit = second_sensor(kind, file["channels/position"][:])
            file["channels/second"].attrs["unit"] = unit

        workshop.recording("sweep.h5", add)
        signal = "omega" if kind in ("noisy tachometer", "reversed and late") else "theta"
        path = workshop.problem(
            lambda content, signal=signal: content["channels"].update(second={"measures": f"load.{signal}"})
        )
        said = [str(finding) for finding in check_before_fit(load_problem(path))]
        assert any("'second' and 'position' see no one motion" in line for line in said) == told, kind
