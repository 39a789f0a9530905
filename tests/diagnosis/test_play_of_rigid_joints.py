"""Free play of a joint that the model says is rigid: flanks with a gap between them, not a spring."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from diagnosis_cases import ENCODER_STEP, STEP, axis, diagnosed, record, write_case
from plant import Plant, PlantFriction, PlantSensor, PlantShaft, PlantTransmission

from friction_ocp.recording.hdf5 import write_recording

RATIO, LOAD, PLAY = 5.0, 0.05, 0.02
"""Load inertia in kg m^2 and free play in rad, on the output side."""


def geared(stiffness: float, play: float) -> Plant:
    """Return the axis with a load on a gear, and an encoder on both sides."""
    plain = axis()
    load = PlantShaft("load", LOAD, PlantFriction(law="coulomb_viscous", tau_c=0.1, viscous=0.01))
    gear = PlantTransmission("motor", "load", RATIO, stiffness, 2.0, play)
    seen = PlantSensor("load_position", "load.theta", period=STEP, resolution=ENCODER_STEP)
    return replace(plain, shafts=(*plain.shafts, load), transmissions=(gear,), sensors=(*plain.sensors, seen))


def without_play(folder: Path, plant: Plant) -> dict[str, Any]:
    """Return the result document of a diagnosis whose model has a rigid gear."""
    path = write_case(folder, axis(), effects=["backlash", "compliance", "sensor_delay", "unbalance"])
    for k, name in enumerate("abc"):
        write_recording(record(plant, name, 10 + k), folder / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    friction = {"law": "coulomb_viscous", "tau_c": {"guess": 0.12, "min": 0}, "viscous": 0.01}
    document["drive"]["shafts"].append({"name": "load", "inertia": LOAD, "friction": friction})
    document["drive"]["transmissions"] = [{"ratio": RATIO, "stiffness": "rigid"}]
    document["channels"]["load_position"] = {"measures": "load.theta", "resolution": ENCODER_STEP}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return diagnosed(path)


@pytest.mark.slow
def test_play_is_told_from_a_spring(tmp_path: Path) -> None:
    """Hard flanks with play between them are backlash, its size within a tenth."""
    result = without_play(tmp_path, geared(3000.0, PLAY))
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("backlash", "motor-load")
    assert accepted["parameters"]["motor-load.backlash"]["value"] == pytest.approx(PLAY, rel=0.1)


@pytest.mark.slow
def test_a_spring_is_no_play(tmp_path: Path) -> None:
    """A soft joint without play is compliance: play that comes out as none takes nothing away from it."""
    result = without_play(tmp_path, geared(40.0, 0.0))
    assert [(item["effect"], item["component"]) for item in result["accepted"]] == [("compliance", "motor-load")]
    assert not result["alias_sets"]
