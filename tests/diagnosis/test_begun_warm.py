"""Friction that has settled by another share wherever a recording begins: machines do not cool down for a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import (
    COULOMB,
    CURRENT_NOISE,
    ENCODER_STEP,
    SECONDS,
    STEP,
    VISCOUS,
    axis,
    diagnosed,
    plain_drive,
    write_problem,
)
from plant import PlantWarmUp, Trajectory, steps_and_multisine

from friction_ocp.drive.parts import Drive, Shaft
from friction_ocp.effects.beginnings import begins_apart
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.effects.friction_time import WarmUpEffect
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SAMPLES, INTERVAL, TIME_CONSTANT = 4000, 1e-3, 1.2
LEVEL, NOISE = 0.2, 0.01
"""N m."""
NUMBERS = {"motor.friction.tau_c": LEVEL, "motor.friction.viscous": 0.0}
DRIVE = Drive(shafts=(Shaft("motor", 1e-3, FrictionElement(CoulombViscous(LEVEL, Free(0.0)))),))


def tracks(cold: Sequence[float], settles: float = TIME_CONSTANT) -> tuple[Track, ...]:
    """Return recordings whose friction is higher than a model says, times a share each, and settles; beside noise."""
    rng, made = np.random.default_rng(5), list[Track]()
    time, middle = INTERVAL * np.arange(SAMPLES), np.arange(2, SAMPLES, 4)
    for k, share in enumerate(cold):
        omega = 20.0 * np.sin(2.0 * np.pi * time / (0.9 + 0.1 * k))
        theta = INTERVAL * np.cumsum(omega)
        more = 0.3 * LEVEL * share * np.exp(-time[middle] / settles) * np.sign(omega[middle])
        torque = NOISE * rng.standard_normal(middle.size) - more
        missing = Missing(middle, {"motor": torque}, {"motor": theta[middle]}, {"motor": omega[middle]})
        made.append(Track(time, {"motor": theta}, {"motor": omega}, {}, missing, missing, f"run-{k}"))
    return tuple(made)


def test_recordings_tell_how_far_friction_had_settled_where_they_begin() -> None:
    """As shares of the way from the coldest."""
    found = begins_apart(DRIVE, "motor", Clues(tracks((0.5, 1.0, 0.2)), NUMBERS, {"motor": 1.0}))
    assert found is not None
    assert found.time_constant == pytest.approx(TIME_CONSTANT, rel=0.4)
    assert found.begun == pytest.approx({"run-0": 0.5, "run-1": 0.0, "run-2": 0.8}, abs=0.1)
    assert found.by_path("motor.friction.warm_up") == {
        f"motor.friction.warm_up.begun@{name}": share for name, share in found.begun.items()
    }


@pytest.mark.parametrize("cold", [(1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0,)])
def test_recordings_that_begin_alike_have_no_beginnings_of_their_own(cold: tuple[float, ...]) -> None:
    """All cold, nothing that settles, or one alone."""
    assert begins_apart(DRIVE, "motor", Clues(tracks(cold), NUMBERS, {"motor": 1.0})) is None


def test_static_points_know_no_beginning() -> None:
    """Nobody says how warm it was where they were taken."""
    known = Clues(tracks((0.5, 1.0, 0.2)), NUMBERS, {"motor": 1.0}, {"motor": np.array([1.0, 2.0])})
    assert begins_apart(DRIVE, "motor", known) is None


SECOND = "motor.friction.warm_up.begun@run-2"


def test_a_warm_up_that_was_accepted_gets_beginnings_where_recordings_show_them() -> None:
    """Once; and begins with none at all. Where they are added at once, all may yet begin alike: both is tried."""
    apart, alike = (Clues(tracks(cold), NUMBERS, {"motor": 1.0}) for cold in ((0.5, 1.0, 0.2), (1.0, 1.0, 1.0)))
    effect = WarmUpEffect()
    plain = effect.augment(DRIVE, "motor", alike)
    part = plain.drive.shaft("motor").friction.warm_up
    assert part is not None and part.begun is None
    assert effect.reshaped(plain.drive, "motor", alike) is None
    shaped = effect.reshaped(plain.drive, "motor", apart)
    assert shaped is not None
    assert shaped.off == {f"motor.friction.warm_up.begun@run-{k}": 0.0 for k in range(3)}
    assert effect.reshaped(shaped.drive, "motor", apart) is None
    outright = effect.augment(DRIVE, "motor", apart)
    part = outright.drive.shaft("motor").friction.warm_up
    assert part is not None and isinstance(part.begun, Free) and part.begun.scope == "recording"
    assert all(trial.fixed["motor.friction.warm_up.begun@run-1"] == 0.0 for trial in outright.trials)
    assert sum(trial.fixed[SECOND] > 0.0 for trial in outright.trials) == len(plain.trials)
    assert sum(trial.fixed[SECOND] == 0.0 for trial in outright.trials) == len(plain.trials)


SETTLES, CHANGE = 3.0, -0.4
BEGUN = {"a": 0.1, "b": 0.6, "c": 0.9}
"""Of the warmth that it settles at, by recording."""


def begun_warm(name: str, seed: int) -> Recording:
    """Run a plant that has settled in part on a current that goes slow and fast, both ways."""
    rng, plain = np.random.default_rng(seed), axis()
    shaft = replace(plain.shafts[0], warm_up=PlantWarmUp(SETTLES, CHANGE, CHANGE))
    steps = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 20.0), SECONDS, rng)
    time = np.arange(0.0, SECONDS, STEP)
    current = Trajectory(time, np.interp(time, np.asarray(steps.time), np.asarray(steps.value)), "zero")
    initial = {"motor.warmth": BEGUN[name]}
    run = replace(plain, shafts=(shaft,)).simulate(SECONDS, {"motor.current": current}, rng, initial=initial)
    units = {"position": "rad", "current": "A"}
    return Recording(name, {key: Channel(key, *run.channels[key], unit) for key, unit in units.items()})


@pytest.mark.slow
def test_friction_that_begins_warm_is_found(tmp_path: Path) -> None:
    """With the friction in which each recording begins and the one at which all settle."""
    document: dict[str, Any] = {
        "format": "friction-ocp-problem/1",
        "drive": plain_drive(VISCOUS),
        "channels": {
            "current": {"measures": "motor.current", "role": "input", "hold": "zero", "noise_std": CURRENT_NOISE},
            "position": {"measures": "motor.theta", "resolution": ENCODER_STEP},
        },
        "diagnosis": {"effects": ["stribeck", "quadratic_drag", "asymmetry", "sensor_delay", "warm_up"]},
    }
    found = diagnosed(write_problem(tmp_path, begun_warm, document))
    assert found["verdict"] == "explained"
    (accepted,) = found["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("warm_up", "motor")
    assert found["gap"]["shrink"]["overall"] > 0.9
    drive = yaml.safe_load((tmp_path / "out" / "augmented.yaml").read_text(encoding="utf-8"))["drive"]
    friction = drive["shafts"][0]["friction"]
    level, amplitude = friction["tau_c"]["guess"], friction["warm_up"]["amplitude"]["guess"]
    values = {name: item["value"] for name, item in accepted["parameters"].items()}
    for name in "ab":
        beginning = level * (1.0 + amplitude * values[f"motor.friction.warm_up.begun@{name}"])
        assert beginning == pytest.approx(COULOMB * (1.0 + CHANGE * BEGUN[name]), rel=0.05)
    assert level * (1.0 + amplitude) == pytest.approx(COULOMB * (1.0 + CHANGE), rel=0.15)
