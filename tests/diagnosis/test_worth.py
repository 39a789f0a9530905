"""What counts as lost, where free runs are to show whether an addition matters."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from friction_ocp.diagnosis import worth
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors
from friction_ocp.diagnosis.rival import is_another
from friction_ocp.diagnosis.screen import Screened, Start
from friction_ocp.diagnosis.worth import Standard, with_resembling
from friction_ocp.drive.parts import Channel, Drive, Motor, Shaft, Transmission
from friction_ocp.effects.effect import Augmentation, Clues, Trial
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.score import FreeRun

FLOOR = 0.01


@pytest.mark.parametrize(("error", "lost"), [(0.005, False), (0.3, False), (1.5, True)])
def test_a_run_is_lost_where_the_mean_would_be_nearer(error: float, lost: bool) -> None:
    """A free run that misses a sine by more than the sine's own deviation says nothing of what the model lacks."""
    time = np.linspace(0.0, 1.0, 400)
    measured = np.sin(2.0 * np.pi * time)[:, None]
    run = FreeRun("a", time, measured, measured + error, np.zeros((400, 2)), {})
    power, count = np.array([[400.0 * (error / FLOOR) ** 2]]), np.array([[400.0]])
    assert FreeErrors((run,), ("position",), np.array([FLOOR]), power, count, np.zeros(1)).lost is lost


def seen(effect: str, component: str, gain: float) -> Screened:
    """Return a candidate as a score test sees it, with one start."""
    start = Start(Trial(({"x": 1.0},)), (1.0,), {})
    return Screened(effect, component, gain, 0.5, (start,), cast(Augmentation, SimpleNamespace(off={})))


def test_far_from_the_recordings_an_effect_is_tried_at_all_its_places() -> None:
    """There predictions say little about the place; nearer they decide."""
    found = [seen("cogging", "motor", 100.0), seen("asymmetry", "motor", 50.0), seen("asymmetry", "load", 0.1)]
    assert with_resembling(found[:2], found) == found[:2]
    assert with_resembling(found[:2], found, astray=True) == found


@pytest.mark.parametrize(
    ("effect", "place", "path"),
    [
        ("sensor_gain", "torque", "torque.gain"),
        ("sensor_eccentricity", "theta", "theta.eccentricity.sine"),
        ("parameter_error", "motor-load", "motor-load.ratio"),
    ],
)
def test_what_is_as_large_as_it_may_be_is_another_effect(effect: str, place: str, path: str) -> None:
    """An angle that is half a radian off is not that of an eccentric disc, nor half as much again a wrong scale.

    A ratio that is a fifth off is of another gear.
    """
    channels = (Channel("torque", "drive.torque", "input"), Channel("theta", "motor.theta"))
    shafts, gear = (Shaft("motor", 0.02), Shaft("load", 0.5)), Transmission("motor", "load", 20.0)
    drive = Drive(shafts, (gear,), (Motor("drive", "motor"),), None, channels)
    added = effects()[effect].augment(drive, place, Clues((), {}, {"motor": 0.1}))
    candidate = Screened(effect, place, 1.0, 0.0, (), added)
    for ended, another in ((path, True), ("motor.inertia", False)):
        fitted = cast(FittedModel, SimpleNamespace(at_bound=lambda name, ended=ended: name == ended))
        assert is_another(candidate, fitted) is another


def test_a_mode_that_nothing_damps_is_another_effect() -> None:
    """What rings for ever at one frequency is driven by something periodic in time."""
    drive = Drive((Shaft("motor", 0.02),), (), (Motor("drive", "motor"),), None, (Channel("theta", "motor.theta"),))
    track = SimpleNamespace(time=np.arange(0.0, 10.0, 1e-3))
    clues: Any = SimpleNamespace(numbers={"motor.inertia": 0.02}, tracks=(track,), ringing=lambda *known: ())
    added = effects()["structural_mode"].augment(drive, "motor", clues)
    candidate = Screened("structural_mode", "motor", 1.0, 0.0, (), added)
    for ended, another in (("motor-motor_mode.damping", True), ("motor-motor_mode.stiffness", False)):
        fitted = cast(FittedModel, SimpleNamespace(at_bound=lambda name, ended=ended: name == ended))
        assert is_another(candidate, fitted) is another


def drifting(power: float, beyond: float, seed: int, drift: float = 0.0, noisy: bool = False) -> FittedModel:
    """Return a fit whose free runs drift, unevenly, and whose one-step predictions leave something beyond noise."""
    blocks = 100.0 * power * np.random.default_rng(seed).chisquare(1.0, (24, 1))
    run = FreeRun("a", np.arange(2.0), np.array([[-1e6], [1e6]]), np.zeros((2, 1)), np.zeros((2, 1)), {})
    free = FreeErrors((run,), ("position",), np.ones(1), blocks, np.full((24, 1), 100.0), np.array([drift]))
    model = SimpleNamespace(problem=SimpleNamespace(estimation=SimpleNamespace(seed=0)))
    linear = SimpleNamespace(rows=SimpleNamespace(recording=np.zeros(1), static=()))
    foot = SimpleNamespace(predicted=False, noisy_inputs=("current",) if noisy else ())
    return cast(FittedModel, SimpleNamespace(free=free, beyond=beyond, model=model, linear=linear, footing=foot))


@pytest.fixture
def looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take free runs and innovations from where `drifting` puts them."""

    def free_errors(fitted: SimpleNamespace, held_out: bool) -> FreeErrors:
        assert not held_out
        return fitted.free

    def innovations(fitted: SimpleNamespace) -> Excess:
        return Excess(1.0 + fitted.beyond, 0.5)

    monkeypatch.setattr(worth, "free_errors", free_errors)
    monkeypatch.setattr(worth, "innovations", innovations)


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(("left", "after", "material"), [(0.0, 6.0, True), (0.3, 6.0, False), (0.0, 500.0, False)])
def test_free_runs_that_drift_may_get_worse_by_chance(left: float, after: float, material: bool) -> None:
    """Where nothing is left from sample to sample, an addition counts unless free runs get worse for certain."""
    assert Standard(drifting(5.0, 0.7, 1)).is_material(drifting(after, left, 2)) is material


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(("left", "after", "material"), [(4.0, 500.0, True), (8.0, 500.0, False), (0.0, 500.0, False)])
def test_what_else_is_missing_does_not_speak_against_an_addition(left: float, after: float, material: bool) -> None:
    """That takes almost all of the innovations: free runs show the rest. Where nothing else is missing, they tell."""
    assert Standard(drifting(5.0, 50.0, 1)).is_material(drifting(after, left, 2)) is material


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(
    ("beyond", "left", "after", "material"),
    [(0.7, 0.0, 500.0, True), (0.7, 0.6, 500.0, False)],
)
def test_what_torque_noise_does_to_free_runs_is_no_evidence_against(
    beyond: float, left: float, after: float, material: bool
) -> None:
    """Against an addition: there the one-step predictions tell."""
    before, then = drifting(5.0, beyond, 1, drift=1e3), drifting(after, left, 2, drift=1e3)
    assert Standard(before).is_material(then) is material


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(("drift", "noisy", "material"), [(0.0, True, True), (1e3, True, False), (1e3, False, True)])
def test_what_torque_noise_does_to_free_runs_is_no_evidence_for(drift: float, noisy: bool, material: bool) -> None:
    """For an addition: there free runs come closer by chance, where channels show more from sample to sample."""
    before, then = drifting(50.0, 0.0, 1, drift, noisy), drifting(5.0, 0.0, 2, drift, noisy)
    assert Standard(before).is_material(then) is material


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(
    ("power", "beyond", "drift", "met"),
    [(50.0, 0.0, 0.0, True), (50.0, 0.0, 1e3, False), (50.0, 0.3, 1e3, True), (0.5, 0.0, 0.0, False)],
)
def test_where_nothing_is_left_no_addition_can_take_it_away(
    power: float, beyond: float, drift: float, met: bool
) -> None:
    assert Standard(drifting(power, beyond, 1, drift, noisy=True)).may_be_met is met


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(
    ("before", "after", "left", "material"),
    [(4e12, 4e13, 3.5, True), (4e11, 4e12, 3.5, False), (4e12, 4e13, 4.0, False)],
)
def test_how_far_two_runs_are_lost_is_chance(before: float, after: float, left: float, material: bool) -> None:
    """There the innovations tell, if they lose a quarter; what alone gets lost is contradicted."""
    assert Standard(drifting(before, 5.0, 1)).is_material(drifting(after, left, 2)) is material


@pytest.mark.usefixtures("looked_at")
@pytest.mark.parametrize(
    ("beyond", "share", "seed", "material"),
    [(0.3, 0.6, 1, True), (0.0, 0.6, 1, False), (0.0, 0.3, 1, True), (0.3, 0.6, 2, True), (0.0, 0.45, 2, False)],
)
def test_where_nothing_else_is_missing_free_runs_get_better_for_certain(
    beyond: float, share: float, seed: int, material: bool
) -> None:
    """And by most of what they show: runs that stick or slide differ by chance."""
    assert Standard(drifting(20.0, beyond, 1)).is_material(drifting(20.0 * share, beyond, seed))
    assert (
        Standard(drifting(20.0, beyond, 1), silent=True).is_material(drifting(20.0 * share, beyond, seed)) is material
    )
