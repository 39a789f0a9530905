"""Drives with known numbers, as result files: the recorded servo, and simulated ones of every structure."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml
from servo_problem import servo_document, write_problem

FITTED = {"resistance": 4.74, "inertia": 0.001574, "tau_c": 0.01217, "viscous": 0.009812, "offset": -0.0233}
"""What the identification of the servo gives, rounded."""


def servo(folder: Path, model: str = "coulomb_viscous") -> Path:
    """Write the servo with fitted values as known numbers; one validation recording."""
    document = servo_document(model)
    drive, channel = document["drive"], document["channels"]["position"]
    drive["motor"]["resistance"] = {**drive["motor"]["resistance"], "guess": FITTED["resistance"]}
    drive["motor"]["torque_constant"] = 0.3648
    shaft = drive["shafts"][0]
    shaft["inertia"] = {**shaft["inertia"], "guess": FITTED["inertia"]}
    for key in ("tau_c", "viscous"):
        shaft["friction"][key] = {**shaft["friction"][key], "guess": FITTED[key]}
    channel["offset"] = {**channel["offset"], "guess": FITTED["offset"]}
    del document["estimation"]["max_step"]
    return write_problem(folder / "fitted.yaml", document)


DRIVE: dict[str, Any] = {
    "format": "friction-ocp-problem/1",
    "title": "Geared axis",
    "drive": {
        "motor": {"torque_constant": 0.5},
        "shafts": [
            {"name": "motor", "inertia": {"guess": 0.002}, "friction": {"law": "coulomb", "tau_c": 0.03}},
            {
                "name": "arm",
                "inertia": 1.5,
                "gravity": {"torque": 4.0, "phase": 0.4},
                "friction": {"law": "coulomb_viscous", "tau_c": 0.2, "viscous": 0.7},
            },
        ],
        "transmissions": [{"ratio": -20.0, "stiffness": "rigid"}],
    },
    "channels": {
        "current": {"measures": "motor.current", "role": "input"},
        "position": {"measures": "arm.theta", "noise_std": 1e-4},
    },
    "recordings": {"train": ["run.h5"]},
}


def axis(folder: Path, **changes: Any) -> Path:
    """Write a geared axis under a sine of current; `changes` are sections by path, such as drive__transmissions."""
    document = copy.deepcopy(DRIVE)
    for path, value in changes.items():
        place: Any = document
        *parents, last = path.split("__")
        for key in parents:
            place = place[int(key) if key.isdigit() else key]
        place[int(last) if last.isdigit() else last] = value
    time = np.arange(0.0, 1.5, 0.004)
    with h5py.File(folder / "run.h5", "w") as file:
        file.attrs["format"] = "friction-ocp-recording/1"
        columns = {"current": (2.0 * np.sin(7.0 * time), "A"), "position": (0.1 * np.sin(7.0 * time), "rad")}
        for name, (values, unit) in {"/time": (time, "s"), **{f"/channels/{k}": v for k, v in columns.items()}}.items():
            file[name] = values
            file[name].attrs["unit"] = unit
    path = folder / "axis.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


ELASTIC = {"ratio": 20.0, "stiffness": 900.0, "damping": 3.0}
