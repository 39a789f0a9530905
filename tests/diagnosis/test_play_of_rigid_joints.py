"""A joint that the model says is rigid: flanks with a gap between them, or a spring; and what rubs behind it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import ENCODER_STEP, STEP, axis, diagnosed, record, write_case
from plant import Plant, PlantFriction, PlantSensor, PlantShaft, PlantTransmission

from friction_ocp.diagnosis.additions import with_additions
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.model import prepare
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.static import CoulombViscous, NoFriction
from friction_ocp.parameters import Free
from friction_ocp.problem_file.load import load_problem
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


def without_play(folder: Path, plant: Plant, rubs: bool = True) -> Path:
    """Write runs of a plant and a problem whose model has a rigid gear, and behind it friction that `rubs`."""
    path = write_case(folder, axis(), effects=["backlash", "compliance", "sensor_delay", "unbalance"])
    for k, name in enumerate("abc"):
        write_recording(record(plant, name, 10 + k), folder / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    friction = {"law": "coulomb_viscous", "tau_c": {"guess": 0.12, "min": 0}, "viscous": 0.01}
    document["drive"]["shafts"].append({"name": "load", "inertia": LOAD, **({"friction": friction} if rubs else {})})
    document["drive"]["transmissions"] = [{"ratio": RATIO, "stiffness": "rigid"}]
    document["channels"]["load_position"] = {"measures": "load.theta", "resolution": ENCODER_STEP}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


@pytest.mark.slow
def test_play_is_told_from_a_spring(tmp_path: Path) -> None:
    """Hard flanks with play between them are backlash, its size within a tenth."""
    result = diagnosed(without_play(tmp_path, geared(3000.0, PLAY)))
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("backlash", "motor-load")
    assert accepted["parameters"]["motor-load.backlash"]["value"] == pytest.approx(PLAY, rel=0.1)


@pytest.mark.slow
def test_a_spring_is_no_play(tmp_path: Path) -> None:
    """A soft joint without play is compliance: play that comes out as none takes nothing away from it."""
    result = diagnosed(without_play(tmp_path, geared(40.0, 0.0)))
    assert [(item["effect"], item["component"]) for item in result["accepted"]] == [("compliance", "motor-load")]
    assert not result["alias_sets"]


@pytest.mark.slow
def test_a_spring_with_friction_behind_it_is_one_effect(tmp_path: Path) -> None:
    """While a joint is rigid all its friction may stand on one side; once it gives, what rubs behind it comes along."""
    result = diagnosed(without_play(tmp_path, geared(40.0, 0.0), rubs=False))
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("compliance", "motor-load")
    assert accepted["parameters"]["load.friction.tau_c"]["value"] == pytest.approx(0.1, rel=0.1)
    assert result["verdict"] == "explained"


@pytest.mark.slow
def test_friction_that_is_missing_behind_a_spring_is_found(tmp_path: Path) -> None:
    """A model with all of it on the motor's side is named for what it lacks, and no loop of the joint stands in."""
    path = without_play(tmp_path, geared(40.0, 0.0), rubs=False)
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    spring = {"stiffness": {"guess": 35.0, "min": 1.0}, "damping": {"guess": 1.0, "min": 0.0}}
    document["drive"]["transmissions"] = [{"ratio": RATIO, **spring}]
    document["diagnosis"]["effects"] = ["friction", "transmission_hysteresis", "presliding", "backlash"]
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    result = diagnosed(path)
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("friction", "load")
    assert accepted["parameters"]["load.friction.tau_c"]["value"] == pytest.approx(0.1, rel=0.1)


SPEED, TIME = 20.0, 1e-3 * np.arange(100)


def seen(stiffness: float = np.inf) -> Clues:
    """Return clues of a motor that turns steadily and of the load that it takes along."""
    angles, speeds = {"motor": SPEED * TIME, "load": SPEED / RATIO * TIME}, {"motor": SPEED + 0 * TIME}
    speeds["load"] = speeds["motor"] / RATIO
    missing = Missing(np.arange(0, 100, 4), {"motor": np.zeros(25), "load": np.zeros(25)}, {}, {})
    track = Track(TIME, angles, speeds, {"motor": np.ones(100)}, missing, missing)
    numbers = {"motor.friction.tau_c": 0.2, "motor.friction.viscous": 0.01, "motor-load.stiffness": stiffness}
    inertias = {"motor.inertia": 0.002, "load.inertia": LOAD, "motor-load.ratio": RATIO}
    return Clues((track,), numbers | inertias, {"motor": 1.0, "load": RATIO})


def rigid(behind: AbstractFrictionLaw) -> Drive:
    """Return a motor whose friction is fitted, and a load on a rigid gear."""
    law = FrictionElement(CoulombViscous(Free(0.2, 0.0, 1.0), Free(0.01, 0.0, 1.0)))
    shafts = (Shaft("motor", 0.002, law), Shaft("load", LOAD, FrictionElement(behind)))
    channels = (Channel("current", "motor.current", "input"), Channel("theta", "motor.theta"))
    return Drive(shafts, (Transmission("motor", "load", RATIO),), (Motor("motor", "motor"),), None, channels)


@pytest.mark.parametrize("effect", ["compliance", "backlash"])
def test_friction_may_be_on_both_sides_of_what_gives(effect: str) -> None:
    """It is tried where the model has it, and half on either side; the two halves take the same power."""
    found = effects()[effect].augment(rigid(NoFriction()), "motor-load", seen())
    assert {"load.friction.tau_c": 0.0, "load.friction.viscous": 0.0}.items() <= found.off.items()
    half = {"motor.friction.tau_c": 0.1, "motor.friction.viscous": 0.005}
    behind = {"load.friction.tau_c": 0.1 * RATIO, "load.friction.viscous": 0.005 * RATIO**2}
    split = [{key: value for key, value in trial.fixed.items() if "friction" in key} for trial in found.trials]
    count = len(found.trials) // 2
    assert split[:count] == [{}] * count and count > 0
    assert all(each == pytest.approx(half | behind) for each in split[count:])


def test_compliance_is_tried_outright() -> None:
    """At every spring that is tried for its promise, with friction on both sides; a stiff one is a bowl of its own."""
    found = effects()["compliance"].augment(rigid(NoFriction()), "motor-load", seen())
    springs = sorted(trial.amplitudes[0]["motor-load.stiffness"] for trial in found.trials)
    outright = [begin["motor-load.stiffness"] for begin in found.outright]
    assert sorted(outright * 2) == springs and len({*springs}) > 2
    assert all(
        {"motor-load.damping", "motor.friction.tau_c", "load.friction.tau_c"} <= {*one} for one in found.outright
    )


@pytest.mark.parametrize(
    ("stiffness", "motor", "load", "places"),
    [
        (None, NoFriction(), NoFriction(), ["motor", "load"]),
        (None, CoulombViscous(0.2, 0.01), NoFriction(), []),
        (40.0, CoulombViscous(0.2, 0.01), NoFriction(), ["load"]),
        (40.0, NoFriction(), CoulombViscous(0.2, 0.01), ["motor"]),
        (40.0, NoFriction(), NoFriction(), ["motor", "load"]),
    ],
)
def test_friction_may_be_missing_where_nothing_that_turns_alike_has_any(
    stiffness: float | None, motor: AbstractFrictionLaw, load: AbstractFrictionLaw, places: list[str]
) -> None:
    """A spring parts what rubs, a rigid gear does not."""
    drive = rigid(load)
    shafts = (replace(drive.shafts[0], friction=FrictionElement(motor)), drive.shafts[1])
    drive = replace(drive, shafts=shafts, transmissions=(Transmission("motor", "load", RATIO, stiffness),))
    assert list(effects()["friction"].places(drive)) == places


def test_friction_is_tried_outright_as_half_of_what_is_fitted_elsewhere() -> None:
    """What is known there stays there."""
    fitted = rigid(NoFriction())
    drive = replace(fitted, transmissions=(Transmission("motor", "load", RATIO, 40.0),))
    motor = {"motor.friction.tau_c": 0.1, "motor.friction.viscous": 0.005}
    (begin,) = effects()["friction"].augment(drive, "load", seen(40.0)).outright
    assert begin == pytest.approx(
        motor | {"load.friction.tau_c": 0.1 * RATIO, "load.friction.viscous": 0.005 * RATIO**2}
    )
    known = replace(drive.shafts[0], friction=FrictionElement(CoulombViscous(0.2, 0.01)))
    drive = replace(drive, shafts=(known, drive.shafts[1]))
    assert not effects()["friction"].augment(drive, "load", seen(40.0)).outright


@pytest.mark.parametrize("effect", ["compliance", "backlash"])
def test_friction_that_is_there_already_stays_as_it_is(effect: str) -> None:
    """A model with friction on both sides says where it is."""
    found = effects()[effect].augment(rigid(CoulombViscous(0.5, 0.1)), "motor-load", seen())
    assert not any("friction" in path for path in found.off)
    assert not any("friction" in path for trial in found.trials for path in trial.fixed)


def test_an_addition_builds_on_what_another_brought(tmp_path: Path) -> None:
    """A joint that one effect made elastic grows stiffer by another, though the base model knows no stiffness."""
    base = fit_base(prepare(load_problem(without_play(tmp_path, geared(40.0, 0.0)))))
    drive = with_additions(base, [("compliance", "motor-load"), ("stiffening", "motor-load")])
    assert drive.transmissions[0].second_stage is not None


@pytest.mark.parametrize("effect", ["backlash", "stiffening", "transmission_hysteresis"])
def test_a_joint_that_has_lost_its_stiffness_twists_no_farther_than_it_travels(effect: str) -> None:
    """A fit that makes a spring as soft as may be leaves no size by which something else could be tried."""
    drive = rigid(CoulombViscous(0.5, 0.1))
    elastic = replace(drive, transmissions=(replace(drive.transmissions[0], stiffness=Free(800.0), damping=2.0),))
    found = effects()[effect].augment(elastic, "motor-load", seen(0.0))
    travel, torque = SPEED / RATIO * float(TIME[-1]), RATIO
    sizes = [abs(value) for trial in found.trials for value in trial.values(found.off, [1.0]).values()]
    assert 0.0 < max(sizes) <= max(2.0 * travel, torque / travel)
