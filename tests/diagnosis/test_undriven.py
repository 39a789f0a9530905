"""Drives that no motor drives: a pendulum that is let go, a shaft on a dynamometer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import diagnosed
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory

from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

INERTIA, WEIGHT, OFFSET = 0.01, 0.35, 0.06
SECONDS, STEP, FINE, COUNT = 3.0, 4e-3, 1e-3, 2.0 * np.pi / 4096
TORQUE_NOISE = 2e-3
"""N m."""


def arm(name: str, **more: Any) -> dict[str, Any]:
    """Return a shaft with Coulomb and viscous friction, its guesses off."""
    friction = {"law": "coulomb_viscous", "tau_c": {"guess": 0.02, "min": 0}, "viscous": {"guess": 1e-3, "min": 0}}
    return {"name": name, "inertia": {"guess": 0.012, "min": 1e-3}, "friction": friction, **more}


def written(folder: Path, document: dict[str, Any]) -> Path:
    path = folder / "undriven.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def write_decays(folder: Path) -> Path:
    """Write two swings from either side, and the problem whose sensor has no offset."""
    shaft = PlantShaft("arm", INERTIA, PlantFriction("coulomb_viscous", tau_c=0.01, viscous=2e-3), (WEIGHT, 0.0))
    plant = Plant((shaft,), sensors=(PlantSensor("angle", "arm.theta", STEP, resolution=COUNT, offset=OFFSET),))
    for name, angle in (("left", -1.2), ("right", 0.9)):
        run = plant.simulate(SECONDS, {}, np.random.default_rng(1), initial={"arm.theta": angle})
        write_recording(
            Recording(name, {"angle": Channel("angle", *run.channels["angle"], "rad")}), folder / f"{name}.h5"
        )
    document = {
        "format": "friction-ocp-problem/1",
        "drive": {"shafts": [arm("arm", gravity={"torque": WEIGHT, "phase": 0.0})]},
        "channels": {"angle": {"measures": "arm.theta", "resolution": COUNT}},
        "recordings": {"train": ["left.h5", "right.h5"]},
        "diagnosis": {"effects": ["sensor_offset", "unbalance", "constant_torque"]},
    }
    return written(folder, document)


@pytest.mark.slow
def test_an_encoder_that_is_zeroed_elsewhere_is_found_by_letting_go(tmp_path: Path) -> None:
    """Its offset is told from a constant torque, and from the weight that is stated."""
    result = diagnosed(write_decays(tmp_path))
    assert [(item["effect"], item["component"]) for item in result["accepted"]] == [("sensor_offset", "angle")]
    found = result["rounds"][0]["causes"][0]["parameters"]["angle.offset"]
    assert found == pytest.approx(OFFSET, abs=0.1 * COUNT)
    assert result["gap"]["shrink"]["overall"] == pytest.approx(1.0, abs=0.02)


def write_bench(folder: Path, friction: PlantFriction, told: str, effects: list[str]) -> Path:
    """Write runs on a dynamometer whose `told` is recorded, theta or omega, and a problem with plain friction."""
    sensors = (
        PlantSensor("motion", f"shaft.{told}", FINE),
        PlantSensor("torque", "drive.torque", FINE, noise_std=TORQUE_NOISE),
    )
    plant = Plant(
        (PlantShaft("shaft", INERTIA, friction),), motors=(PlantMotor("drive", "shaft", "torque"),), sensors=sensors
    )
    time = np.arange(0.0, SECONDS, 1e-3)
    for k, name in enumerate("ab"):
        swing = 0.3 * np.sin(2.0 * np.pi * (0.7 + 0.3 * k) * time)
        run = plant.simulate(SECONDS, {"drive.torque": Trajectory(time, swing, "linear")}, np.random.default_rng(k))
        units = {"motion": {"theta": "rad", "omega": "rad/s"}[told], "torque": "N m"}
        channels = {key: Channel(key, *run.channels[key], unit) for key, unit in units.items()}
        write_recording(Recording(name, channels), folder / f"{name}.h5")
    document = {
        "format": "friction-ocp-problem/1",
        "drive": {"shafts": [arm("shaft")]},
        "channels": {
            "motion": {"measures": f"shaft.{told}", "role": "input"},
            "torque": {"measures": "shaft.drive_torque", "noise_std": TORQUE_NOISE},
        },
        "recordings": {"train": ["a.h5", "b.h5"]},
        "diagnosis": {"effects": effects},
    }
    return written(folder, document)


@pytest.mark.slow
def test_what_to_record_next_asks_for_no_command(tmp_path: Path) -> None:
    """Friction that differs by direction and a torque sensor that is off are the same; no motor tells them apart."""
    friction = PlantFriction("coulomb_viscous", tau_c=(0.06, 0.04), viscous=2e-3)
    result = diagnosed(write_bench(tmp_path, friction, "omega", ["asymmetry", "sensor_offset"]))
    assert result["verdict"] == "undecided"
    rivals = {(item["effect"], item["component"]) for item in result["alias_sets"][0]}
    assert rivals == {("asymmetry", "shaft"), ("sensor_offset", "torque")}
    assert result["next_experiment"]["recording"] is None
    assert "no command of a motor makes the motion" in result["next_experiment"]["text"]


@pytest.mark.slow
def test_bristles_are_found_where_the_angle_is_told(tmp_path: Path) -> None:
    """Nothing of the base model moves by itself then: it has no state."""
    friction = PlantFriction("dahl", tau_c=0.05, sigma0=2.0, viscous=2e-3)
    effects = ["presliding", "stribeck", "asymmetry", "quadratic_drag"]
    result = diagnosed(write_bench(tmp_path, friction, "theta", effects))
    assert result["verdict"] == "explained"
    assert [(item["effect"], item["component"]) for item in result["accepted"]] == [("presliding", "shaft")]
