"""A sound problem on disk, to be spoiled by the tests."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from friction_ocp.errors import FrictionOcpError
from friction_ocp.problem_file.check import check
from friction_ocp.problem_file.document import dump_document
from friction_ocp.problem_file.load import load_problem

INERTIA, VISCOUS, COULOMB, TORQUE_CONSTANT = 0.01, 0.02, 0.05, 0.5

PROBLEM: dict[str, Any] = {
    "format": "friction-ocp-problem/1",
    "title": "One shaft",
    "drive": {
        "motor": {"torque_constant": 0.5},
        "shafts": [
            {
                "name": "load",
                "inertia": {"guess": 0.02, "min": 0, "max": 1},
                "friction": {
                    "law": "stribeck",
                    "tau_c": {"guess": 0.05, "min": 0, "max": 1},
                    "tau_s": {"guess": 0.06, "min": 0, "max": 1},
                    "omega_s": 0.5,
                    "viscous": {"guess": 0.01, "min": 0},
                },
            }
        ],
    },
    "channels": {
        "current": {"measures": "motor.current", "role": "input"},
        "position": {"measures": "load.theta", "noise_std": 1e-4},
    },
    "recordings": {"train": ["sweep.h5"]},
}

Spoil = Callable[[dict[str, Any]], object]


@dataclass(frozen=True)
class Workshop:
    """A folder in which problems are written and read."""

    folder: Path

    def recording(self, name: str = "sweep.h5", spoil: Callable[[Any], object] = lambda file: None) -> Path:
        """Write a recording of a body with friction under a sine of current, then spoil it."""
        path = self.folder / name
        with h5py.File(path, "w") as file:
            file.attrs["format"] = "friction-ocp-recording/1"
            for key, (values, unit) in swing().items():
                file[key] = values
                file[key].attrs["unit"] = unit
            spoil(file)
        return path

    def problem(self, spoil: Spoil = lambda content: None, head: str = "") -> Path:
        """Write the sound problem after spoiling its content."""
        content = copy.deepcopy(PROBLEM)
        spoil(content)
        path = self.folder / "problem.yaml"
        path.write_text(dump_document(content, head), encoding="utf-8")
        return path

    def messages(self, path: Path | None = None) -> list[str]:
        """Return every finding about a problem, by loading and by checking it."""
        path = path or self.folder / "problem.yaml"
        try:
            return [str(finding) for finding in check(load_problem(path))]
        except FrictionOcpError as error:
            return [str(finding) for finding in error.findings]


def swing() -> dict[str, tuple[Any, str]]:
    """Integrate J domega/dt = torque - friction under 0.4 A sin(2 pi 0.7 t)."""
    time = np.arange(0.0, 6.0, 0.002)
    current = 0.4 * np.sin(2 * np.pi * 0.7 * time)
    omega = np.zeros_like(time)
    for k in range(time.size - 1):
        friction = VISCOUS * omega[k] + COULOMB * np.tanh(omega[k] / 0.02)
        omega[k + 1] = omega[k] + 0.002 / INERTIA * (TORQUE_CONSTANT * current[k] - friction)
    theta = np.cumsum(omega) * 0.002
    return {"/time": (time, "s"), "/channels/current": (current, "A"), "/channels/position": (theta, "rad")}
