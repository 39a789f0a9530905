"""Waves whose phase differs from recording to recording: nobody waits for them, and encoders begin anywhere."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, VISCOUS, axis, diagnosed, plain_drive, record, write_case
from plant import Plant, PlantRipple

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.held_out import fitted_without
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.locate import shape
from friction_ocp.drive.parts import Cogging, Drive, Motor, Shaft
from friction_ocp.effects.effect import Clues, Missing, Track
from friction_ocp.effects.periodic import CoggingEffect
from friction_ocp.effects.periods import Seen, likeliest
from friction_ocp.estimation.estimate import identify, simulate
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.own_numbers import _at_other_crests, own_numbers
from friction_ocp.estimation.program import Point
from friction_ocp.parameters import Free
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.result_folder import save

PERIOD, SIZE = 0.3, 0.04
"""s, N m: of a torque from outside."""
TEETH, COGS = 6, 0.05
"""Waves of cogging in a turn, and its size, N m."""
SAMPLES, INTERVAL = 4000, 1e-3


def tracks(
    phases: tuple[float, ...], sizes: tuple[float, ...] = (0.1, 0.1, 0.1), beside: tuple[float, float] = (1.0, 0.0)
) -> tuple[Track, ...]:
    """Return motors to and fro that lack a wave over their angle, of a phase and a size each, beside noise.

    And one `beside` it: how much finer it is, and how much larger.
    """
    rng, made = np.random.default_rng(11), list[Track]()
    time, middle = INTERVAL * np.arange(SAMPLES), np.arange(2, SAMPLES, 4)
    for k, phase in enumerate(phases):
        omega = 20.0 * np.sin(2.0 * np.pi * time / (1.0 + 0.1 * k))
        theta = INTERVAL * np.cumsum(omega)
        turned, (finer, larger) = TEETH * theta[middle] + phase, beside
        waves = sizes[k] * (np.cos(turned) + larger * np.cos(finer * turned))
        torque = waves + 0.05 * rng.standard_normal(middle.size)
        missing = Missing(middle, {"motor": torque}, {"motor": theta[middle]}, {"motor": omega[middle]})
        moved = {"motor": theta}, {"motor": omega}, {"drive": np.ones(SAMPLES)}
        made.append(Track(time, *moved, missing, missing, f"run-{k}"))
    return tuple(made)


@pytest.mark.parametrize(
    ("phases", "apart"), [((0.4, 0.4, 0.4), ()), ((0.4, 2.0, 4.0), ("run-0", "run-1", "run-2")), ((0.4,), ())]
)
def test_recordings_tell_whether_they_share_a_phase(phases: tuple[float, ...], apart: tuple[str, ...]) -> None:
    """And the period is found either way."""
    known = Clues(tracks(phases), {}, {"motor": 1.0})
    assert known.apart(known.waves("motor", "theta")) == apart
    travel = float(np.ptp(known.angles("motor")))
    assert 1.0 / known.periods("motor", "theta")[0] == pytest.approx(TEETH / (2.0 * np.pi), abs=0.5 / travel)
    found = shape(known, "motor")
    assert found is not None and found.variable == "motor.theta" and found.period is not None and found.share > 0.4


def test_waves_of_another_size_in_every_recording_are_none_with_phases_of_their_own() -> None:
    """Something else is missing that looks like them."""
    known = Clues(tracks((0.4, 2.0, 4.0), (0.02, 0.03, 0.3)), {}, {"motor": 1.0})
    assert known.apart(known.waves("motor", "theta")) == ()


@pytest.mark.parametrize(
    ("phases", "beside", "apart"),
    [
        ((0.4, 2.0, 4.0), (1.0, 0.0), True),
        ((0.4, 2.0, 4.0), (2.0, 3.0), True),
        ((0.4, 2.0, 4.0), (7.3, 3.0), True),
        ((0.4, 0.4, 0.4), (2.0, 3.0), False),
    ],
)
def test_a_wave_that_was_accepted_is_set_apart_whatever_is_stronger(
    phases: tuple[float, ...], beside: tuple[float, float], apart: bool
) -> None:
    """What is left of it may be less than an overtone of its own, or than a wave of another period."""
    wave = Cogging(0.2, 0.1, 2.0 * np.pi / TEETH)
    drive = Drive(shafts=(Shaft("motor", inertia=1e-3),), motors=(Motor("drive", "motor", cogging=wave),))
    shaped = CoggingEffect().reshaped(drive, "motor", Clues(tracks(phases, beside=beside), {}, {"motor": 1.0}))
    assert shaped is not None
    origins = {f"drive.cogging.origin@run-{k}" for k in range(3)}
    assert (shaped.off.keys() & origins == origins) == apart
    assert ("drive.cogging.second_cosine" in shaped.off) != apart


def test_what_comes_from_outside_is_looked_for_where_it_shows_best() -> None:
    """Its period is the same at every shaft, and the torque of one may be known badly."""
    rng, time, middle = np.random.default_rng(4), INTERVAL * np.arange(SAMPLES), np.arange(2, SAMPLES, 4)
    omega = 20.0 * np.sin(2.0 * np.pi * time)
    pushes = SIZE * np.cos(2.0 * np.pi * time[middle] / PERIOD)
    torque = {
        name: pushes + noise * rng.standard_normal(middle.size) for name, noise in (("motor", 0.1), ("load", 4.0))
    }
    both = dict.fromkeys(torque, omega)
    missing = Missing(middle, torque, {}, {name: item[middle] for name, item in both.items()})
    clues = Clues((Track(time, {}, both, {}, missing, missing, "run"),), {}, {})
    (best, *_), seen = clues.waves("motor", "time"), clues.waves_in_time("load")
    assert best.period == pytest.approx(PERIOD, rel=0.03)
    assert clues.waves("load", "time")[0].share < best.share
    assert (seen[0], seen[1:]) == (best, clues.waves("load", "time"))
    assert clues.waves_in_time("motor") == [*clues.waves("motor", "time"), clues.waves("load", "time")[0]]


@pytest.mark.parametrize(("turns", "apart"), [((4.4, 4.4, 4.4), True), ((4.4, 1.5, 1.5), False)])
def test_two_recordings_at_least_tell_of_phases(turns: tuple[float, ...], apart: bool) -> None:
    """What is missing looks like a wave of any phase where that is hardly shorter than the way."""
    rng, seen = np.random.default_rng(3), list[Seen]()
    for k, (turn, phase) in enumerate(zip(turns, (0.4, 2.0, 4.0), strict=True)):
        place = np.linspace(0.0, turn, 400)
        torque = np.cos(2.0 * np.pi * place + phase) + 0.1 * rng.standard_normal(place.size)
        seen.append(Seen(place, torque, torque, np.ones(place.size), f"run-{k}"))
    assert likeliest(seen, 0.5)[0].apart == apart


def written(folder: Path, plants: tuple[Plant, ...], effects: tuple[str, ...]) -> Path:
    """Write a problem whose recordings a, b (training) and c (validation) are of a plant each."""
    path = write_case(folder, plants[0], effects=effects)
    for k, (name, plant) in enumerate(zip("abc", plants, strict=True)):
        write_recording(record(plant, name, 10 + k), folder / f"{name}.h5")
    return path


def pushed(phase: float) -> Plant:
    """Return an axis that something outside pushes and pulls."""
    plain, torque = axis(), SIZE * np.exp(1j * phase)
    shaft = replace(plain.shafts[0], disturbance=PlantRipple(PERIOD, float(torque.real), float(torque.imag)))
    return replace(plain, shafts=(shaft,))


@pytest.mark.slow
def test_a_disturbance_does_not_wait_for_recordings(tmp_path: Path) -> None:
    """Found with a phase for each; that of the recording held out is its own, and is kept beside it."""
    path = written(tmp_path, tuple(map(pushed, (0.3, 2.1, 4.0))), ("periodic_disturbance", "cogging", "stribeck"))
    result = diagnosed(path)
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"], result["verdict"]) == (
        "periodic_disturbance",
        "motor",
        "explained",
    )
    values = {name: item["value"] for name, item in accepted["parameters"].items()}
    assert values["motor.disturbance.period"] == pytest.approx(PERIOD, rel=1e-3)
    values |= {f"{path}@c": value for path, value in result["gap"]["own_values"]["c"].items()}
    for name, phase in zip("abc", (0.3, 2.1, 4.0), strict=True):
        crest = 2.0 * np.pi * values[f"motor.disturbance.origin@{name}"] / values["motor.disturbance.period"]
        torque = values["motor.disturbance.cosine"] * np.exp(1j * crest)
        assert complex(torque) == pytest.approx(SIZE * np.exp(1j * phase), abs=0.1 * SIZE)
    assert result["gap"]["shrink"]["overall"] > 0.99
    own = "every recording has its own motor.disturbance.origin"
    assert any(line.startswith(own) for line in result["assumptions"])
    again = simulate(load_problem(tmp_path / "out" / "augmented.yaml"))
    errors, _ = again.validation_errors["position"]
    assert errors.rms == pytest.approx(result["gap"]["after"]["position"]["rms"], rel=0.05)
    fresh = yaml.safe_load((tmp_path / "out" / "augmented.yaml").read_text(encoding="utf-8"))
    fresh["recordings"] = {"train": [str(tmp_path / "c.h5")]}
    (tmp_path / "fresh.yaml").write_text(yaml.safe_dump(fresh), encoding="utf-8")
    afresh = simulate(load_problem(tmp_path / "fresh.yaml"))
    assert afresh.train_errors["position"][0].rms == pytest.approx(errors.rms, rel=0.05)
    (path, origin), (kept, known) = *afresh.train[0].own.items(), *result["gap"]["own_values"]["c"].items()
    turns = (origin - known) / values["motor.disturbance.period"]
    assert (path, turns - round(turns)) == (kept, pytest.approx(0.0, abs=1e-3))


@pytest.mark.slow
def test_cogging_is_found_behind_an_encoder_that_begins_at_zero(tmp_path: Path) -> None:
    """The rotor stands anywhere when an incremental encoder is switched on."""

    def cogged(phase: float) -> Plant:
        plain, torque = axis(), COGS * np.exp(1j * phase)
        waves = PlantRipple(2.0 * np.pi / TEETH, float(torque.real), float(torque.imag))
        return replace(plain, motors=(replace(plain.motors[0], cogging=waves),))

    result = diagnosed(
        written(tmp_path, tuple(map(cogged, (0.3, 2.1, 4.0))), ("cogging", "position_ripple", "stribeck"))
    )
    (accepted,) = result["accepted"]
    assert (accepted["effect"], result["verdict"]) == ("cogging", "explained")
    values = {name: item["value"] for name, item in accepted["parameters"].items()}
    assert abs(values["motor.cogging.cosine"]) == pytest.approx(COGS, rel=0.1)
    for name, phase in zip("ab", (0.3, 2.1), strict=True):
        angle = TEETH * values[f"motor.cogging.origin@{name}"] - phase
        assert np.sign(values["motor.cogging.cosine"]) * np.cos(angle) > 0.95


@pytest.mark.parametrize("share", [0.4, 0.5])
def test_a_wave_that_begins_far_away_in_a_recording_is_found_there(share: float, tmp_path: Path) -> None:
    """All others begin together."""
    path = written(tmp_path, (pushed(0.0), pushed(2.0 * np.pi * share), pushed(0.0)), ())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"] = plain_drive(VISCOUS)
    origin = {"guess": 0.0, "scope": "recording"}
    document["drive"]["shafts"][0]["disturbance"] = {"cosine": SIZE, "sine": 0.0, "period": PERIOD, "origin": origin}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    model = prepare(load_problem(path))
    second = [item for item in model.train if item.name == "b"]
    ((path, origin),) = own_numbers(model, second, model.space.guess, fitted=False)["b"].items()
    assert path == "motor.disturbance.origin"
    assert origin % PERIOD == pytest.approx(share * PERIOD, abs=0.02 * PERIOD)


def test_every_wave_is_tried_at_other_places_of_its_period() -> None:
    """No more than half a period from zero; one whose period is fitted to the recording itself, or that begins nowhere
    of its own, as it is.
    """
    paths = [
        "motor.cogging.origin",
        "motor.external_torque.constant",
        "motor.cogging.other_origin",
        "load.ripple.origin",
    ]
    numbers = {"motor.cogging.period": 1.0, "motor.cogging.other_period": 0.2, "load.ripple.period": Free(1.0)}
    start = np.array([15.1, 0.3, 0.05, 0.4])
    found = np.array(list(_at_other_crests(start, paths, numbers)))
    np.testing.assert_array_equal(found[0], start)
    np.testing.assert_allclose(found[1:4, 0], [0.35, -0.4, -0.15], atol=1e-12)
    np.testing.assert_allclose(found[4:, 2], [0.1, -0.05, 0.0], atol=1e-12)
    assert len(found) == 7
    moved = found != start
    assert np.all(moved[1:4] == [True, False, False, False]) and np.all(moved[4:] == [False, False, True, False])


@pytest.mark.slow
def test_what_differs_by_recording_is_fitted_to_what_is_held_out(tmp_path: Path) -> None:
    """A constant torque of each recording: on the one held out it is estimated as its start is, and said."""
    torques = (0.02, -0.03, 0.05)
    plain = axis()
    plants = tuple(replace(plain, shafts=(replace(plain.shafts[0], external_torque=one),)) for one in torques)
    path = written(tmp_path, plants, ())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"] = plain_drive(VISCOUS)
    constant = {"guess": 0.0, "min": -COULOMB, "max": COULOMB, "scope": "recording"}
    document["drive"]["shafts"][0]["external_torque"] = {"constant": constant}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    problem = load_problem(path)
    found = identify(problem)
    (held,) = found.simulation.validation
    name = "motor.external_torque.constant"
    values = {**found.values, f"{name}@c": held.own[name]}
    for recording, torque in zip("abc", torques, strict=True):
        assert values[f"{name}@{recording}"] == pytest.approx(torque, abs=2e-3)
    model = prepare(problem)
    far = model.space.with_known({**found.values, f"{name}@a": 0.9 * COULOMB})
    again = own_numbers(model, model.train[:1], far, fitted=False)
    assert again == {"a": {name: pytest.approx(torques[0], abs=2e-3)}}
    train, validation = (
        one["position"][0].noise_ratio for one in (found.simulation.train_errors, found.simulation.validation_errors)
    )
    assert validation < 2.0 * max(train, 1.0)
    save(found, tmp_path / "out")
    written_down = yaml.safe_load((tmp_path / "out" / "fitted.yaml").read_text(encoding="utf-8"))["recordings"]
    assert written_down["validation"][0]["set"] == {name: pytest.approx(held.own[name])}
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["fit"]["own_values"] == {"c": {name: pytest.approx(held.own[name])}}


def test_what_a_recording_has_for_itself_is_fitted_to_it_where_it_is_left_out(tmp_path: Path) -> None:
    """From where it was with all of them: short segments of it alone need not lead there."""
    phases = {"a": 0.3, "b": 2.1, "c": 4.0}
    path = written(tmp_path, tuple(map(pushed, phases.values())), ())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"] = plain_drive(VISCOUS)
    origin = {"guess": 0.0, "scope": "recording"}
    document["drive"]["shafts"][0]["disturbance"] = {"cosine": SIZE, "sine": 0.0, "period": PERIOD, "origin": origin}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    fitted = fit_base(prepare(load_problem(path)))
    (own,) = (k for k, name in enumerate(fitted.model.space.names) if name.endswith("@a"))
    others = [k for k, name in enumerate(fitted.model.space.names) if "@" not in name]
    far = fitted.theta.copy()
    far[own] += 0.1 * PERIOD
    moved = replace(fitted, linear=linear_program(fitted.linear.program, Point(far, fitted.linear.point.nodes)))
    for known in (fitted, moved):
        found = fitted_without(known, [0])
        turns = found[own] / PERIOD - phases["a"] / (2.0 * np.pi)
        assert turns == pytest.approx(round(turns), abs=0.01)
        assert found[others] == pytest.approx(fitted.theta[others], rel=0.05)
