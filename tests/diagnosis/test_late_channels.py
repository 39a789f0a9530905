"""Channels that are late, told from the others alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import STEP
from effect_cases import STIFFNESS, EffectCase, geared, with_gear
from plant import Plant

from friction_ocp.diagnosis.lateness import latenesses
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.effects.sensors import SensorDelayEffect
from friction_ocp.estimation.model import prepare
from friction_ocp.problem_file.load import load_problem

LATE = 5e-3
DRIVE = Drive(
    (Shaft("motor", 1.0), Shaft("load", 1.0)),
    motors=(Motor("motor", "motor"),),
    channels=(
        Channel("current", "motor.current", "input"),
        Channel("position", "motor.theta"),
        Channel("load_position", "load.theta"),
    ),
)


def read_late(plant: Plant, name: str, delay: float) -> Plant:
    """Return a plant with a sensor that is late."""
    sensors = (replace(item, delay=delay) if item.name == name else item for item in plant.sensors)
    return replace(plant, sensors=tuple(sensors))


def found_late(plant: Plant, folder: Path) -> dict[str, float]:
    """Return how late the channels of a plant are, by what its recordings show."""
    model = prepare(load_problem(EffectCase(plant, "load_position", (), with_gear()).write("sensor_delay", folder)))
    numbers = model.space.numbers_by_path(model.space.guess, model.train[0].name)
    return latenesses(model.problem.drive, model.train, numbers)


@pytest.mark.parametrize("name", ["position", "load_position"])
def test_a_late_channel_is_told_by_the_other_one(name: str, tmp_path: Path) -> None:
    """To a tenth of a sample, whatever the spring between both does; the other one is early by as much."""
    found = found_late(read_late(geared(stiffness=10.0 * STIFFNESS), name, LATE), tmp_path)
    (other,) = {"position", "load_position"} - {name}
    assert found[name] == pytest.approx(LATE, abs=0.1 * STEP)
    assert found[other] == pytest.approx(-LATE, abs=0.1 * STEP)


@pytest.mark.parametrize("joint", [{}, {"backlash": 0.01}])
def test_a_joint_makes_no_channel_late(joint: dict[str, float], tmp_path: Path) -> None:
    """Neither a spring that carries the friction of the load nor play."""
    assert found_late(geared(**joint), tmp_path) == {}


def test_a_fit_may_begin_where_a_channel_is_late() -> None:
    """Not where it would be early, as no channel is that an input moves, nor for one that nothing shows to be late."""
    time = np.arange(0.0, 1.0, STEP)
    nothing = Missing(np.zeros(0, dtype=np.int64), {}, {}, {})
    clues = Clues((Track(time, {}, {}, {}, nothing, nothing),), {}, {}, late={"load_position": LATE, "position": -LATE})
    delay, begins = SensorDelayEffect(), ({"load_position.delay": LATE},)
    assert delay.augment(DRIVE, "load_position", clues).outright == begins
    assert delay.augment(DRIVE, "position", clues).outright == ()
    assert delay.augment(DRIVE, "load_position", replace(clues, late={})).outright == ()
