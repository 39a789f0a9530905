"""How far torque noise moves a shaft: held by its bristles at rest, free of them where it slides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, ENCODER_STEP, INERTIA, VISCOUS, axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.excess import DOUBTED
from friction_ocp.diagnosis.footing import Footing, footing, pieces
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.estimation.drive_noise import NUMERICAL_INPUT, input_noise, torque_noise
from friction_ocp.estimation.gap import start_weight
from friction_ocp.estimation.gathered_noise import slopes_about, unit_covariances
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.node_gaps import still_gaps
from friction_ocp.problem_file.load import load_problem

STIFFNESS, DAMPING = 200.0, 0.1


@pytest.fixture(scope="module")
def bristled(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """Return an axis whose model has a bristle, at its guesses."""
    path = write_case(tmp_path_factory.mktemp("bristled"), axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    shaft: dict[str, Any] = document["drive"]["shafts"][0]
    shaft["inertia"] = INERTIA
    numbers = {"tau_c": {"guess": COULOMB, "min": 0}, "tau_s": 1.5 * COULOMB, "omega_s": 2.0, "delta": 0.85}
    shaft["friction"] = {"law": "lugre", **numbers, "sigma0": STIFFNESS, "sigma1": DAMPING, "sigma2": VISCOUS}
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return prepare(load_problem(path))


def covariance(model: Model, span: float, omega: float, bent: float) -> np.ndarray:
    """Return what unit acceleration noise gathers in angle, speed and deflection over a span, s."""
    at = np.array([[0.0, omega, bent]])
    slopes = slopes_about(model, model.space.numbers(model.space.guess, "a"), at)
    return unit_covariances(model, slopes, np.array([span]))[0, 0]


def test_at_rest_the_bristle_holds_the_shaft(bristled: Model) -> None:
    """The variance of an oscillator under white noise: J^2 / (2 c k) of the angle, J / (2 c) of the speed."""
    found, damping = covariance(bristled, 20.0, 0.0, 0.0), DAMPING + VISCOUS
    assert found[0, 0] == pytest.approx(INERTIA**2 / (2.0 * damping * STIFFNESS), rel=0.01)
    assert found[1, 1] == pytest.approx(INERTIA / (2.0 * damping), rel=0.01)


@pytest.mark.parametrize("span", [0.01, 0.1, 10.0])
def test_where_it_slides_only_drag_does(span: float, bristled: Model) -> None:
    """The speed wanders as under viscous friction alone, however fast the bristle forgets over however long a span."""
    omega = 50.0
    found, rate = covariance(bristled, span, omega, 1.5 * COULOMB / STIFFNESS), VISCOUS / INERTIA
    assert found[1, 1] == pytest.approx((1.0 - np.exp(-2.0 * rate * span)) / (2.0 * rate), rel=0.02)
    assert found[2, 2] < 1e-3 * found[0, 0] + 1e-12


def test_a_deflection_may_jump_by_what_torque_noise_makes_of_its_torque(bristled: Model) -> None:
    """Over a span T torque noise of density q is a torque q / sqrt(T), and that is the bristle's at rest over its
    stiffness; it jumps by no less than other states and by no more than a share of its size."""
    states, span, density = len(bristled.drive.state_names), 0.02, 1e-6
    slopes = slopes_about(bristled, bristled.space.numbers(bristled.space.guess, "a"), np.zeros((1, states)))[0]
    foot, at, scale = footing(bristled, bristled.space.guess), states - 1, bristled.state_scale[states - 1]
    found = [
        still_gaps(bristled, replace(foot, density={"motor": each}), "a", span, slopes)[at]
        for each in (0.0, density, 1.0)
    ]
    assert found == pytest.approx([1e-5 * scale, density / np.sqrt(span) / STIFFNESS, 1e-3 * scale], rel=1e-3)
    assert found[0] < found[1] < found[2]


def test_noise_of_a_channel_with_a_gain_is_that_of_the_motor_over_it(bristled: Model) -> None:
    """A gain of the current and a torque constant are traded for one another, noise included."""
    known = {"motor.torque_constant": 0.3}
    plain, shown = (torque_noise(bristled, known | gain)["motor"] for gain in ({}, {"current.gain": 0.5}))
    assert shown == pytest.approx(2.0 * plain)
    assert shown == pytest.approx(torque_noise(bristled, {"motor.torque_constant": 0.6})["motor"])


def test_an_angle_may_be_shown_of_the_other_side_of_a_gear(tmp_path: Path) -> None:
    """A motor's encoder whose log is of the output: the same noise, as long segments, and no other power of a fit."""
    found = list[tuple[Model, Footing, float]]()
    for name, gain in (("motor", 1.0), ("output", -0.01)):
        (tmp_path / name).mkdir()
        path = write_case(tmp_path / name, axis())
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
        document["channels"]["position"] |= {"gain": gain, "resolution": ENCODER_STEP * abs(gain)}
        path.write_text(yaml.safe_dump(document), encoding="utf-8")
        for each in "abc":
            with h5py.File(tmp_path / name / f"{each}.h5", "r+") as file:
                angle: Any = file["channels/position"]
                angle[...] = gain * angle[:]
        model = prepare(load_problem(path))
        fitted = fit_base(model)
        found.append((model, fitted.footing, innovations(fitted).ratio))
    (first, plain, power), (second, shown, other) = found
    assert shown.noise == pytest.approx(0.01 * plain.noise)
    assert shown.segment_s == plain.segment_s and other == pytest.approx(power, rel=1e-3)
    slopes = np.zeros((len(first.drive.state_names),) * 2)
    gaps = [still_gaps(model, foot, "a", 0.02, slopes) for model, foot in ((first, plain), (second, shown))]
    assert gaps[1] == pytest.approx(gaps[0])


def test_noise_of_a_current_within_long_segments_is_no_gap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a recording has fewer segments than its noisy current asks for, what gathers in each is counted."""
    monkeypatch.setattr("friction_ocp.diagnosis.footing.MOST_SEGMENTS", 40)
    fitted = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    found = innovations(fitted)
    assert fitted.linear.program.segments[0].count <= 45
    assert 0.1 < found.ratio < DOUBTED
    assert not found.significant(0.01)


def test_warmth_is_known_where_a_recording_starts(tmp_path: Path) -> None:
    """It is counted from there; a piece that begins later begins as warm as may be."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    warm = {"amplitude": {"guess": -0.1}, "time_constant": 1.0, "loss_share": 1.0, "power": 5.0}
    document["drive"]["shafts"][0]["friction"]["warm_up"] = warm
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    model = prepare(load_problem(path))
    at = model.drive.state_names.index("motor.friction.warmth")
    whole, later = model.train[0], pieces(model.train[0], 2)[1]
    usual = 1.0 / model.state_scale
    assert start_weight(model, whole)[at] == pytest.approx(1e4 * usual[at])
    assert start_weight(model, later) == pytest.approx(usual)
    assert np.delete(start_weight(model, whole), at) == pytest.approx(np.delete(usual, at))


@pytest.mark.parametrize(("thrown", "told"), [(True, NUMERICAL_INPUT), (False, 1.0)])
def test_an_input_thrown_to_and_fro_by_its_loop_is_no_noise(thrown: bool, told: float, tmp_path: Path) -> None:
    """A current that changes sign at every sample moves the drive; of one that is all noise all of it is noise."""
    path = write_case(tmp_path, axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    del document["channels"]["current"]["noise_std"]
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    rng = np.random.default_rng(1)
    for name in "abc":
        with h5py.File(tmp_path / f"{name}.h5", "r+") as file:
            current: Any = file["channels/current"]
            size = current.shape[0]
            current[...] = (-1.0) ** np.arange(size) if thrown else rng.standard_normal(size)
    model = prepare(load_problem(path))
    (channel,) = model.problem.drive.inputs
    assert input_noise(model, channel)[0] == pytest.approx(told, rel=0.1)
