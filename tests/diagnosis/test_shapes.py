"""What a machine has is of another shape than the catalogue gives it: still one effect, and nothing is left."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import COULOMB, TORQUE_CONSTANT, axis, write_case
from plant import Plant, PlantRipple, PlantSaturation

from friction_ocp.cli import main
from friction_ocp.drive.parts import (
    Channel,
    Cogging,
    Disturbance,
    Drive,
    Hysteresis,
    KinematicError,
    Motor,
    Shaft,
    TorqueRipple,
    Transmission,
)
from friction_ocp.drive.stepping import stepped
from friction_ocp.drive.values import drive_leaves
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.effects.registry import effects
from friction_ocp.friction.composite import AddedFriction, Bristle, StribeckRise, Sum, with_bristle
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.modifiers import Ripple
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free, start_of

EXPONENT = 0.8
LAW = CoulombViscous(0.1, 0.02)
RISING = Sum(LAW, AddedFriction(stribeck=StribeckRise(0.1, 3.0, 2.0)))


def geared(
    law: FrictionElement = FrictionElement(LAW),
    wave: Disturbance | None = None,
    loop: Hysteresis | None = None,
    **motor: Any,
) -> Drive:
    """Return a motor and a load on an elastic gear whose ratio ripples."""
    ripple = KinematicError(0.01, 0.02, 0.9)
    gear = Transmission("motor", "load", 5.0, 800.0, 2.0, hysteresis=loop, kinematic_error=ripple)
    channels = (Channel("torque", "drive.torque", "input"), Channel("theta", "motor.theta"))
    shafts = (Shaft("motor", 0.02, law, disturbance=wave), Shaft("load", 0.5))
    return Drive(shafts, (gear,), (Motor("drive", "motor", **motor),), None, channels)


SHAPES: dict[str, tuple[Drive, str]] = {
    "stribeck": (geared(FrictionElement(RISING)), "motor"),
    "position_ripple": (geared(FrictionElement(LAW, ripple=Ripple(0.2, 0.1, 0.7))), "motor"),
    "cogging": (geared(cogging=Cogging(0.05, 0.08, 0.7)), "motor"),
    "torque_ripple": (geared(torque_ripple=TorqueRipple(0.1, 0.2, 0.7)), "motor"),
    "periodic_disturbance": (geared(wave=Disturbance(0.1, 0.05, 0.3)), "motor"),
    "kinematic_error": (geared(), "motor-load"),
    "torque_saturation": (geared(saturation=0.5), "motor"),
    "presliding": (geared(FrictionElement(with_bristle(LAW, Bristle(Free(500.0), 0.2)))), "motor"),
    "transmission_hysteresis": (geared(loop=Hysteresis(0.4, Free(2e-3))), "motor-load"),
}
"""A drive that has the effect already, and where."""
MOVING, DEFLECTION = {"motor.theta": 1.3, "load.theta": 0.2, "motor.omega": 2.0, "load.omega": 0.5}, 1e-3
COSINES, SINES = (0.03, 0.0, 0.006), (0.0, -0.012, 0.0)


def cogging() -> Plant:
    """Return an axis whose cogging has overtones."""
    plain = axis()
    return replace(plain, motors=(replace(plain.motors[0], cogging=PlantRipple(3.1, COSINES, SINES)),))


def cogging_once_a_turn() -> Plant:
    """Return an axis that cogs once a turn, which looks like unbalance, and has overtones, which do not."""
    plain = axis()
    return replace(
        plain,
        motors=(replace(plain.motors[0], cogging=PlantRipple(2.0 * np.pi, (0.03, 0.02, 0.01), (0.01, 0.0, 0.01))),),
    )


def diagnosed(folder: Path, plant: Plant, effects: list[str]) -> dict[str, Any]:
    """Return the result document of a diagnosis with a narrow catalogue."""
    path = write_case(folder, plant, effects=effects)
    assert main(["diagnose", str(path), "--out", str(folder / "out"), "--workers", "1"]) == 0
    return json.loads((folder / "out" / "result.json").read_text(encoding="utf-8"))


def values_of(result: dict[str, Any]) -> dict[str, float]:
    """Return the parameters of the one effect that explains all, by the last part of their names."""
    (accepted,) = result["accepted"]
    assert result["verdict"] == "explained" and not result["alias_sets"]
    shaped = [item["accepted"] for item in result["rounds"] if item["reshaped"]]
    assert shaped == [{key: accepted[key] for key in ("effect", "component")}]
    return {name.rpartition(".")[2]: item["value"] for name, item in accepted["parameters"].items()}


@pytest.mark.slow
@pytest.mark.parametrize("breakaway", [1.15 * COULOMB, 1.5 * COULOMB])
def test_another_exponent_is_no_break_of_the_slope(breakaway: float, tmp_path: Path) -> None:
    """A break comes nearer to such a curve than one of the usual exponent, be it down to the noise; neither stands in
    for it, nor stays beside it, nor is as likely."""
    plant = axis(law="stribeck", tau_s=breakaway, omega_s=20.0, delta=1.0)
    result = diagnosed(tmp_path, plant, ["stribeck", "polyline_break"])
    assert result["verdict"] == "explained" and not result["alias_sets"]
    assert [item["effect"] for item in result["accepted"]] == ["stribeck"]
    assert values_of(result)["delta"] == pytest.approx(1.0, abs=0.1)


def lacking(period: float) -> Clues:
    """Return clues of a motor, 0.7 rad of whose angle one wave takes, that lacks a wave over its angle."""
    time = 1e-3 * np.arange(6000)
    theta = 20.0 * time
    middle = np.arange(2, 6000, 4)
    torque = 0.02 * np.cos(2.0 * np.pi * theta[middle] / period)
    angles, speeds = {"motor": theta, "load": theta / 5.0}, {"motor": np.full(6000, 20.0), "load": np.full(6000, 4.0)}
    there = [{name: values[middle] for name, values in each.items()} for each in (angles, speeds)]
    missing = Missing(middle, {"motor": torque, "load": 5.0 * torque}, *there)
    track = Track(time, angles, speeds, {"drive": np.ones(6000)}, missing, missing)
    return Clues((track,), {"motor-load.stiffness": 800.0}, {"motor": 1.0, "load": 5.0})


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_begins_as_what_it_was(name: str) -> None:
    """At its off values the drive is the one it was, at others it is not; and general shapes have an end."""
    (drive, place), effect, clues = SHAPES[name], effects()[name], lacking(0.35)
    found = effect.reshaped(drive, place, clues)
    assert found is not None and effect.addition(drive, place, clues) == found
    further = effect.reshaped(found.drive, place, clues)
    assert further is None or effect.reshaped(further.drive, place, clues) is None
    assert set(found.off) == {path for trial in found.trials for grown in trial.amplitudes for path in grown}
    sizes = [1.0] * len(found.trials[0].amplitudes)
    plain = moved(drive, {})
    off, on = (moved(found.drive, at) for at in (found.off, found.trials[0].values(found.off, sizes)))
    assert {state: off[state] for state in plain} == pytest.approx(plain, rel=1e-12)
    assert {state: on[state] for state in plain} != pytest.approx(plain, rel=1e-9)


@pytest.mark.parametrize("period", [0.35, 0.7, 0.43])
def test_a_wave_gets_overtones_and_one_of_another_period(period: float) -> None:
    """What is missing at none of its orders says the other period; there is one to begin with in any case."""
    drive, effect, clues = geared(cogging=Cogging(0.05, 0.08, 0.7)), effects()["cogging"], lacking(period)
    found = effect.reshaped(drive, "motor", clues)
    assert found is not None
    parts = ("second_cosine", "second_sine", "third_cosine", "third_sine", "other_cosine", "other_sine")
    assert set(found.off) == {f"drive.cogging.{part}" for part in parts}
    overtones, *others = found.trials
    periods = [trial.fixed["drive.cogging.other_period"] for trial in others]
    assert not overtones.fixed and all(abs(each / 0.7 * order - 1.0) > 0.1 for each in periods for order in (1, 2, 3))
    assert period != 0.43 or periods[0] == pytest.approx(period, rel=0.01)
    assert effect.reshaped(found.drive, "motor", lacking(0.35)) is None


@pytest.mark.parametrize(
    ("known", "added"),
    [({"second_cosine": 0.01}, "other"), ({"other_cosine": 0.01, "other_sine": 0.0, "other_period": 0.3}, "second")],
)
def test_a_wave_gets_what_it_does_not_have_yet(known: dict[str, float], added: str) -> None:
    """A wave that a problem states with overtones gets one of another period alone, and the other way round."""
    drive, effect = geared(cogging=Cogging(0.05, 0.08, 0.7, **known)), effects()["cogging"]
    found = effect.reshaped(drive, "motor", lacking(0.43))
    assert found is not None and f"drive.cogging.{added}_cosine" in found.off
    assert not any(path.rpartition(".")[2] in known for path in found.off)
    assert effect.reshaped(found.drive, "motor", lacking(0.43)) is None


def test_overtones_start_small_beside_a_wave_that_is_not_fitted_yet() -> None:
    """Where nothing is known of the size of a wave, its guess tells."""
    small = 2e-4
    drive = geared(cogging=Cogging(Free(small), Free(0.0), 0.7))
    found = effects()["cogging"].reshaped(drive, "motor", lacking(0.35))
    assert found is not None
    sizes = [size for trial in found.trials for grown in trial.amplitudes for size in grown.values()]
    assert sizes == pytest.approx([0.1 * small] * len(sizes))


def test_stribeck_friction_is_tried_where_only_fast_moves_leave_it() -> None:
    """A log that creeps most of the time may have friction that falls over all of its speeds: servos break away so."""
    time, creeping, fast = 1e-3 * np.arange(1000), 0.1, 3.0
    omega = np.where(time < 0.7, creeping, fast * time)
    still = Missing(np.arange(2, 1000, 4), {"motor": np.zeros(250)}, {}, {})
    track = Track(time, {"motor": np.cumsum(omega) * 1e-3}, {"motor": omega}, {"drive": np.ones(1000)}, still, still)
    found = effects()["stribeck"].augment(geared(), "motor", Clues((track,), {}, {"motor": 1.0}))
    tried = [value for trial in found.trials for path, value in trial.fixed.items() if path.endswith("omega_s")]
    assert min(tried) < creeping < 0.5 * fast < max(tried)


def test_other_effects_keep_their_shape() -> None:
    """An effect without a more general shape, or that the drive does not have, is added as the catalogue gives it."""
    drive, clues = geared(), Clues((), {}, {"motor": 0.1})
    names = [name for name, (_, place) in SHAPES.items() if place == "motor"]
    assert [name for name in names if effects()[name].reshaped(drive, "motor", clues) is not None] == []
    added = effects()["constant_torque"].addition(drive, "motor", clues).drive
    assert added.shaft("motor").external_torque is not None


def moved(drive: Drive, values: Mapping[str, float]) -> dict[str, float]:
    """Return the state, by name, a step after some state in motion."""
    made = stepped(drive)
    numbers = {leaf.path: start_of(leaf.value) for leaf in drive_leaves(drive)} | dict(values)
    at = [MOVING.get(name, DEFLECTION) for name in made.state_names]
    after = made.step(
        at, [0.4, 0.13, 0.13][: len(made.input_names)], [numbers[name] for name in made.parameter_names], 1e-3, 0
    )
    return dict(zip(made.state_names, map(float, np.ravel(np.asarray(after))), strict=True))


@pytest.mark.slow
def test_the_exponent_of_a_stribeck_curve_is_found(tmp_path: Path) -> None:
    """Friction that falls more pointedly than a bell is Stribeck friction all the same."""
    plant = axis(law="stribeck", tau_s=2.0 * COULOMB, omega_s=6.0, delta=EXPONENT)
    found = values_of(diagnosed(tmp_path, plant, ["stribeck"]))
    assert found["delta"] == pytest.approx(EXPONENT, rel=0.1)
    assert found["torque"] == pytest.approx(COULOMB, rel=0.1)
    assert "Given a more general shape: stribeck at motor" in (tmp_path / "out" / "report.html").read_text("utf-8")


@pytest.mark.slow
def test_overtones_belong_to_their_wave(tmp_path: Path) -> None:
    """Cogging with overtones is no second ripple."""
    found = values_of(diagnosed(tmp_path, cogging(), ["cogging", "torque_ripple", "position_ripple"]))
    sizes = [np.hypot(found[f"{order}cosine"], found[f"{order}sine"]) for order in ("", "second_", "third_")]
    assert sizes == pytest.approx(np.hypot(COSINES, SINES), rel=0.1)
    assert max(sizes) < TORQUE_CONSTANT


@pytest.mark.slow
def test_a_wave_of_another_period_belongs_to_its_effect(tmp_path: Path) -> None:
    """Slots beside magnets, in no ratio of small numbers, are no second ripple; both periods are found."""
    plain, periods, sizes = axis(), (3.1, 1.37), (0.03, 0.012)
    slots = PlantRipple(periods[1], (0.0,), (sizes[1],))
    magnets = PlantRipple(periods[0], (sizes[0],), (0.0,), beside=slots)
    plant = replace(plain, motors=(replace(plain.motors[0], cogging=magnets),))
    found = values_of(diagnosed(tmp_path, plant, ["cogging", "torque_ripple", "position_ripple"]))
    assert (found["period"], found["other_period"]) == pytest.approx(periods, rel=0.01)
    assert np.hypot(found["cosine"], found["sine"]) == pytest.approx(sizes[0], rel=0.1)
    assert np.hypot(found["other_cosine"], found["other_sine"]) == pytest.approx(sizes[1], rel=0.1)


@pytest.mark.slow
def test_the_sharpness_of_saturation_is_found(tmp_path: Path) -> None:
    """A motor whose torque ceases to rise suddenly saturates all the same."""
    plain, limit, sharpness = axis(), 2.5, 4.0
    iron = PlantSaturation(limit, "algebraic", sharpness)
    plant = replace(plain, motors=(replace(plain.motors[0], saturation=iron),))
    found = values_of(diagnosed(tmp_path, plant, ["torque_saturation", "quadratic_drag"]))
    assert found["saturation"] == pytest.approx(limit**-2.0, rel=0.05)
    assert found["saturation_sharpness"] == pytest.approx(sharpness, rel=0.1)


@pytest.mark.slow
def test_presliding_of_springs_is_presliding(tmp_path: Path) -> None:
    """Springs that slip one after another are closer to springs than to a bristle, and nothing else."""
    elements = ((0.75, 0.3), (0.4, 0.4), (0.12, 0.3))
    plant = axis(law="gms", elements=elements)
    result = diagnosed(tmp_path, plant, ["presliding", "stribeck", "position_ripple"])
    (accepted,), (shaped,) = result["accepted"], [item for item in result["rounds"] if item["reshaped"]]
    assert accepted["effect"] == shaped["accepted"]["effect"] == "presliding"
    assert accepted["parameters"]["motor.friction.bristle.springs.share"]["value"] > 0.5
    assert result["remainder"]["ratio"] < shaped["excess"]["ratio"]


@pytest.mark.slow
@pytest.mark.parametrize("form", ["tanh", "cubic"])
def test_a_saturation_of_another_form_is_no_second_effect(tmp_path: Path, form: str) -> None:
    """What a motor loses more of, or less, than the catalogue's saturation does is no friction."""
    plain = axis()
    plant = replace(plain, motors=(replace(plain.motors[0], saturation=PlantSaturation(2.5, form)),))
    result = diagnosed(tmp_path, plant, ["torque_saturation", "polyline_break", "quadratic_drag", "parameter_error"])
    assert [item["effect"] for item in result["accepted"]] == ["torque_saturation"]
    assert not result["remainder"]["significant"]


@pytest.mark.slow
def test_what_does_the_work_of_two_in_a_more_general_shape_takes_their_place(tmp_path: Path) -> None:
    """Unbalance explains a wave once a turn, and cogging one of its overtones: cogging with overtones is all of it."""
    result = diagnosed(tmp_path, cogging_once_a_turn(), ["unbalance", "cogging"])
    assert [item["effect"] for item in result["accepted"]] == ["cogging"]
    assert not result["remainder"]["significant"]
