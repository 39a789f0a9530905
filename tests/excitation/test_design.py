"""A designed motion keeps its limits, and tells what it promises when the plant makes it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import axis, write_case
from plant import Trajectory
from servo_problem import REPOSITORY

from friction_ocp.cli import WRONG_INPUT, main
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.footing import footing
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.drive.values import bind_drive
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import prepare, prepare_fit
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.excitation.design import Design, design, sharpening
from friction_ocp.excitation.worth import evidence
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import read_recording
from friction_ocp.recording.recording import Channel, Recording

SPEED = 30.0
"""Limit that the problem states, rad/s: below what the recordings reach."""

LIMIT = "a positive number in SI units, of the first shaft"


def silent(what: str, share: float) -> None:
    """Say nothing."""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the problem file of an axis with a limit of speed."""
    path = write_case(tmp_path_factory.mktemp("axis"), axis())
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["limits"] = {"speed": SPEED}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def sharper(path: Path) -> Design:
    """Return the design that sharpens the parameters of the axis."""
    return design(load_problem(path), "D", [], silent)


def test_motions_keep_the_limits(sharper: Design) -> None:
    """No motion exceeds the stated speed, nor the torque and travel that the recordings reached, by more than 5 %."""
    assert sharper.limits.stated == ("speed",)
    assert len(sharper.options) >= 6
    for option in sharper.options:
        for key, limit in (("speed", SPEED), ("torque", sharper.limits.torque), ("travel", sharper.limits.travel)):
            assert option.run.peaks[key] <= 1.05 * limit


def test_the_plant_confirms_the_expected_standard_errors(sharper: Design) -> None:
    """The information in the best motion, made by the plant, is what the design expects, within a fifth."""
    option, fitted = sharper.options[0], sharper.fitted
    current = option.run.recording.channels["current"]
    inputs = {"motor.current": Trajectory(current.time, current.values, "zero")}
    run = axis().simulate(float(current.time[-1]), inputs, np.random.default_rng(3))
    made = Recording("made", {key: Channel(key, *run.channels[key], unit) for key, unit in UNITS.items()})
    problem = replace(fitted.model.problem, train=(RecordingUse(made),), validation=())
    model = prepare(problem)
    program = footing(model, fitted.theta).program(model, model.train)
    linear = linear_program(program, solve_nodes(program, suggested_point(program, fitted.theta)))
    known = fitted.linear.rows.jacobian
    both = known.T @ known + linear.rows.jacobian.T @ linear.rows.jacobian
    assert option.std_errors is not None
    np.testing.assert_allclose(np.sqrt(np.diag(np.linalg.inv(both))), option.std_errors, rtol=0.2)


UNITS = {"position": "rad", "current": "A"}


def test_what_the_recordings_do_not_tell_is_not_called_known(path: Path, tmp_path: Path) -> None:
    """An offset of the current and a constant torque are the same to every recording, and further ones lose nothing."""
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["shafts"][0]["external_torque"] = {"constant": {"guess": 0.0, "min": -1.0, "max": 1.0}}
    document["channels"]["current"]["offset"] = {"guess": 0.0, "min": -1.0, "max": 1.0}
    document["recordings"] = {"train": [str(path.parent / name) for name in document["recordings"]["train"]]}
    (tmp_path / "problem.yaml").write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    found = sharpening(fit_base(prepare_fit(load_problem(tmp_path / "problem.yaml"))), "D")
    traded = [name.endswith(("constant", "offset")) for name in found.fitted.model.space.names]
    assert sum(traded) == 2
    told, size = np.logical_not(traded), np.abs(found.fitted.theta)
    assert np.all(found.std_errors[traded] > 1.0)
    assert np.all(found.std_errors[told] < 0.1 * size[told])
    for option in found.options:
        assert option.std_errors is not None
        assert np.all(option.std_errors[traded] > 1.0)
        assert option.worth > 0.0


def test_a_model_has_no_evidence_against_itself(sharper: Design) -> None:
    """What a model made separates it from itself by less than a hundredth of a noise floor squared."""
    for option in sharper.options[:3]:
        assert evidence(sharper.fitted, option.run.recording).separation < 0.01


@pytest.mark.slow
def test_rivals_are_separated_by_the_best_motion(path: Path) -> None:
    """Stribeck friction and quadratic drag, refitted, are told apart better by the first motion than by the last."""
    problem = load_problem(write_case(path.parent, axis(law="stribeck", tau_s=0.15, omega_s=6.0)))
    found = design(problem, "D", [("stribeck", "motor"), ("quadratic_drag", "motor")], silent)
    assert found.options[0].power is not None
    assert found.options[0].power > 0.99
    assert found.options[0].worth > 2.0 * found.options[-1].worth


def test_the_command_leaves_a_recording_that_can_be_played(path: Path, tmp_path: Path) -> None:
    """`design` writes result, page and a recording with the channels of the problem; A is another criterion."""
    assert main(["design", str(path), "--criterion", "A", "--out", str(tmp_path)]) == 0
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert result["criterion"] == "A"
    assert set(read_recording(tmp_path / result["recording"]).channels) == {"current", "position"}
    assert result["options"][0]["sentence"] in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_candidates_that_there_are_not_are_named(path: Path) -> None:
    """A wrong candidate is refused with those that there are."""
    with pytest.raises(FrictionOcpError, match="stribeck@motor"):
        design(load_problem(path), "D", [("stribeck", "load"), ("asymmetry", "motor")], silent)


@pytest.mark.parametrize(
    ("between", "limits", "where"),
    [
        ([("stribek", "motor"), ("asymmetry", "motor")], {}, "--between stribek@motor: there is no such candidate"),
        ([("stribeck", "motor")], {}, "--between: one candidate has nothing to be told from"),
        ([], {"speed": -1}, "limits.speed: this is -1"),
    ],
)
def test_what_cannot_be_asked_is_refused_before_the_fit(
    path: Path, between: list[tuple[str, str]], limits: dict[str, float], where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody waits for a fit to be told of a slip."""

    def fitted(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("friction_ocp.excitation.design.fit_base", fitted)
    with pytest.raises(FrictionOcpError, match=where):
        design(replace(load_problem(path), limits=limits), "D", between, silent)


@pytest.mark.parametrize("command", ["diagnose", "design"])
def test_limits_are_read_before_any_work(
    command: str, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A diagnosis is not lost to the limits of the experiment that would follow it."""
    copy = path.with_name(f"{command}.yaml")
    copy.write_text(path.read_text(encoding="utf-8").replace("speed: 30.0", "speed: -30.0"), encoding="utf-8")
    assert main([command, str(copy), "--out", str(tmp_path / "out")]) == WRONG_INPUT
    assert capsys.readouterr().err == f"{copy}: limits.speed: this is -30.0; {LIMIT}\n"
    assert not (tmp_path / "out").exists()


def test_candidates_that_the_recordings_hardly_show_are_named(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Candidates without a size to begin with are refused, not sought among no motions."""
    monkeypatch.setattr("friction_ocp.excitation.design.screen", lambda *arguments: None)
    with pytest.raises(FrictionOcpError) as caught:
        design(load_problem(path), "D", [("stribeck", "motor"), ("asymmetry", "motor")], silent)
    assert [finding.where for finding in caught.value.findings] == [
        "--between stribeck@motor",
        "--between asymmetry@motor",
    ]
    assert caught.value.findings[0].what == "the recordings give no size to begin with"


def test_a_current_of_the_other_sign_is_led_as_well(path: Path, tmp_path: Path) -> None:
    """A negative torque constant leaves a current within the limits, and the same motions."""
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["drive"]["motor"]["torque_constant"] *= -1.0
    document["channels"]["current"]["gain"] = -1.0
    document["recordings"] = {"train": [str(path.parent / "a.h5"), str(path.parent / "b.h5")]}
    (tmp_path / "turned.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    assert len(design(load_problem(tmp_path / "turned.yaml"), "D", [], silent).options) >= 6


def test_a_motion_that_is_an_input_is_not_designed() -> None:
    """The telescope whose motors are led by their speed has no command that a design could change."""
    problem = load_problem(REPOSITORY / "problems" / "lto" / "joint.yaml")
    with pytest.raises(FrictionOcpError, match="no input: where the motion itself is an input"):
        design(problem)


def test_nothing_to_fit_is_nothing_to_sharpen(path: Path) -> None:
    """A problem of plain numbers alone is refused in words."""
    problem = load_problem(path)
    known = {"motor.inertia": 0.002, "motor.friction.tau_c": 0.1, "motor.friction.viscous": 0.001}
    with pytest.raises(FrictionOcpError, match="nothing to fit"):
        design(replace(problem, drive=bind_drive(problem.drive, known)))


@pytest.mark.slow
def test_a_motor_that_was_mostly_off_is_switched_on() -> None:
    """The servo is free for most of its first recording; a designed motion drives it all the same."""
    found = design(load_problem(REPOSITORY / "problems" / "xl330" / "coulomb_viscous.yaml"))
    assert found.options[0].run.peaks["travel"] > 0.1
    assert found.options[0].worth > 0.1
