"""Fitted drives in other programs: the programs themselves say whether they are the same drives."""

from __future__ import annotations

import copy
import csv
import json
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from fitted_drives import ELASTIC, axis, servo
from servo_problem import REPOSITORY

from friction_ocp.cli import DONE, WRONG_INPUT, main
from friction_ocp.errors import FrictionOcpError
from friction_ocp.targets.c_source import CompiledModel, c_source, compensation_width
from friction_ocp.targets.fitted import Fitted, load_fitted
from friction_ocp.targets.fmu import write_fmu
from friction_ocp.targets.fmu_run import loaded_fmu
from friction_ocp.targets.joints import joint_drive
from friction_ocp.targets.mjcf import mjcf_text
from friction_ocp.targets.mujoco_run import MuJoCoRun
from friction_ocp.targets.price import price_table, price_text
from friction_ocp.targets.table import table_text
from friction_ocp.targets.tracking import tracking_gain
from friction_ocp.targets.urdf import urdf_losses, urdf_text

SAME_CODE = 1e-9
"""The same arithmetic, compiled by another call."""
COGGING = {"cosine": 0.1, "sine": 0.0, "period": 1.0}
ADDED = 0.02
"""Share of the free-run error that MuJoCo may add to a drive that it can express."""


def in_mujoco(fitted: Fitted) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(mjcf_text(joint_drive(fitted), fitted.name))
    return model, mujoco.MjData(model)


def test_mujoco_adds_next_to_nothing_to_coulomb_and_viscous_friction(tmp_path: Path) -> None:
    """The recorded servo in MuJoCo stays nearer to its free run here than 2 % of the error of that run."""
    fitted = load_fitted(servo(tmp_path))
    drive = joint_drive(fitted)
    assert [loss.term for loss in drive.losses] == ["controller"]
    rows = price_table(fitted, MuJoCoRun(fitted, drive, mjcf_text(drive, fitted.name), False).simulate)
    assert [row.recording for row in rows] == ["sin_sin-kp400"]
    assert 0.0 < rows[0].share < ADDED
    assert "sin_sin-kp400" in price_text(rows, "MuJoCo")


@pytest.mark.parametrize("gravity", [{"torque": 4.0, "phase": 0.4}, None])
def test_a_shaft_without_inertia_gets_that_of_its_neighbour(tmp_path: Path, gravity: dict[str, float] | None) -> None:
    """The rotor's inertia times the square of the ratio is that of the body, and no armature is left."""
    changes: dict[str, Any] = {"drive__shafts__1__inertia": 0.0, "drive__shafts__1__gravity": gravity}
    model, data = in_mujoco(load_fitted(axis(tmp_path, **changes)))
    mujoco.mj_forward(model, data)
    assert float(data.M[0]) == pytest.approx(0.002 * 400.0, rel=1e-9)
    assert model.dof_armature[0] == 0.0


def test_a_model_that_mujoco_refuses_is_a_finding(tmp_path: Path) -> None:
    """What MuJoCo says is told with the file of the drive."""
    fitted = load_fitted(axis(tmp_path))
    with pytest.raises(FrictionOcpError, match=r"axis.yaml: MuJoCo refuses the model"):
        MuJoCoRun(
            fitted, joint_drive(fitted), "<mujoco><worldbody><body name='a'><joint/></body></worldbody></mujoco>", False
        )


def test_a_dead_time_cannot_be_expressed(tmp_path: Path) -> None:
    """A joint model acts at once: the dead time of the motor is a loss that is named."""
    motor = {"torque_constant": 0.5, "dead_time": 0.008}
    losses = joint_drive(load_fitted(axis(tmp_path, drive__motor=motor))).losses
    assert [loss.term for loss in losses] == ["motor.dead_time"]


def test_a_share_of_the_command_and_a_lag_are_named(tmp_path: Path) -> None:
    """Whoever feeds it the recorded current would get 1 / 0.6 of the torque, and in URDF too soon."""
    drive = joint_drive(load_fitted(axis(tmp_path, drive__motor={"torque_constant": 0.5, "share": 0.6, "lag": 0.02})))
    assert [str(loss) for loss in drive.losses] == ["motor.share: left out: it takes 0.6 x what was recorded"]
    assert "motor.lag: left out: the torque follows within 0.02 s" in [str(loss) for loss in urdf_losses(drive)]


@pytest.mark.parametrize("angle", [-2.0, 0.0, 1.3])
def test_inertia_gravity_and_actuator_are_those_of_the_drive(tmp_path: Path, angle: float) -> None:
    """Through a ratio of -20: the inertia of the rotor times 400, its friction times 20, torque with its sign."""
    model, data = in_mujoco(load_fitted(axis(tmp_path)))
    data.qpos[:], data.ctrl[:] = angle, 0.8
    mujoco.mj_forward(model, data)
    assert float(data.M[0]) == pytest.approx(1.5 + 400.0 * 0.002, rel=1e-9)
    assert -data.qfrc_bias[0] == pytest.approx(-4.0 * np.sin(angle + 0.4), abs=1e-9)
    assert data.qfrc_actuator[0] == pytest.approx(-20.0 * 0.5 * 0.8)
    assert (model.dof_damping[0], model.dof_frictionloss[0]) == pytest.approx((0.7, 0.2 + 20.0 * 0.03))


def test_a_held_joint_hardly_creeps(tmp_path: Path) -> None:
    """Dry friction of the exported model sticks: below it, a second moves the joint by nothing that shows."""
    model, data = in_mujoco(load_fitted(axis(tmp_path, drive__shafts__1__gravity={"torque": 0.0})))
    data.ctrl[:] = 0.9 * 0.8 / 10.0
    for _ in range(2000):
        mujoco.mj_step(model, data)
    free_fall = 0.5 * (0.9 * 0.8) / 2.3
    assert abs(data.qpos[0]) < 1e-4 * free_fall


@pytest.mark.parametrize("play", [0.0, 0.02])
def test_springs_and_free_play_are_tendons(tmp_path: Path, play: float) -> None:
    """A twist at rest gives the torque of the transmission on both shafts, none within its play."""
    transmission = ELASTIC | ({"backlash": play} if play else {})
    model, data = in_mujoco(load_fitted(axis(tmp_path, drive__transmissions=[transmission])))
    for twist in (0.005, 0.05, -0.05):
        data.qpos[:] = 20.0 * twist, 0.0
        mujoco.mj_forward(model, data)
        torque = 900.0 * np.sign(twist) * max(abs(twist) - 0.5 * play, 0.0)
        assert data.qfrc_passive == pytest.approx([-torque / 20.0, torque], abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"drive__shafts__1__friction": {"law": "dahl", "tau_c": 1.0, "sigma0": 50.0}},
            "arm.friction.law = dahl: 1 + 0",
        ),
        (
            {"drive__shafts__1__friction": {"law": "coulomb", "tau_c": {"positive": 1.0, "negative": 3.0}}},
            "arm.friction by direction: 2 + 0 |speed|, the mean of both directions",
        ),
        (
            {"drive__shafts__0__friction": {"law": "coulomb", "tau_c": 0.1, "load": {"coulomb": 0.2}}},
            "motor.friction.load (coulomb = 0.2, stribeck = 0, viscous = 0): left out",
        ),
        (
            {"drive__motor": {"torque_constant": 0.5, "cogging": {"cosine": 0.1, "sine": 0.0, "period": 1.0}}},
            "motor.cogging: left",
        ),
        ({"drive__transmissions": [ELASTIC | {"stiffening": 5.0}]}, "motor-arm.stiffening: left out"),
        ({"drive__transmissions": [ELASTIC | {"backlash": 0.1}]}, "motor-arm.damping: acts within the free play too"),
    ],
)
def test_what_cannot_be_expressed_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, Any], expected: str
) -> None:
    """Each term that MJCF has no word for is a line of the output and of the comment in the file."""
    path = axis(tmp_path, **changes)
    assert main(["export", str(path), "--to", "mjcf", "--out", str(tmp_path / "a.xml"), "--no-price"]) == DONE
    assert f"Not expressed: {expected}" in capsys.readouterr().out
    assert f"Left out: {expected}" in (tmp_path / "a.xml").read_text(encoding="utf-8")


@pytest.mark.parametrize(("to", "out", "kept"), [("table", "fitted.yaml", "fitted.yaml"), ("c", "a.c", "a.h")])
def test_an_export_writes_over_nothing_that_it_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], to: str, out: str, kept: str
) -> None:
    """The problem of a result stays as it is, also where only the header beside the source has its name."""
    path = axis(tmp_path).rename(tmp_path / kept)
    source = path if path.suffix == ".yaml" else tmp_path / "axis.yaml"
    if source != path:
        source.symlink_to(path)
    before = path.read_bytes()
    assert main(["export", str(source), "--to", to, "--out", str(tmp_path / out), "--no-price"]) == WRONG_INPUT
    assert capsys.readouterr().err.startswith(f"{path}: --out is a file that this command reads")
    assert path.read_bytes() == before


def test_an_export_leaves_the_other_files_of_a_result_alone(tmp_path: Path) -> None:
    """Beside fitted.yaml, result.json cannot be the name of an export; a new name in the folder can."""
    path = axis(tmp_path).rename(tmp_path / "fitted.yaml")
    (tmp_path / "result.json").write_text("{}", encoding="utf-8")
    command = ["export", str(path), "--to", "table", "--no-price", "--out"]
    assert main([*command, str(tmp_path / "result.json")]) == WRONG_INPUT
    assert (tmp_path / "result.json").read_text(encoding="utf-8") == "{}"
    assert main([*command, str(tmp_path / "table.csv")]) == DONE
    assert main([*command, str(tmp_path / "table.csv")]) == DONE


def _result(path: Path, **changes: Any) -> None:
    """Write the result.json of a fit that gave the guess of an axis as its answer."""
    found = {"value": 0.002, "verdict": "ok"} | changes.pop("inertia", {})
    content = {"format": "friction-ocp-result/1", "status": "converged", "parameters": {"motor.inertia": found}}
    (path.parent / "result.json").write_text(json.dumps(content | changes), encoding="utf-8")


GUESSED = "motor.inertia: guesses, no result beside the problem says that they were fitted"
DOUBTS: dict[str, tuple[dict[str, Any] | None, str]] = {
    "problem without a result": (None, GUESSED),
    "changed since the fit": ({"inertia": {"value": 0.003}}, GUESSED),
    "no mapping": ({"parameters": [1, 2]}, GUESSED),
    "no numbers": ({"inertia": {"value": None}}, GUESSED),
    "not converged": (
        {"status": "not_converged", "message": "Not converged: iteration limit reached. What follows is"},
        "the fit did not converge (iteration limit reached): its last iterate is not an answer",
    ),
    "not told": ({"inertia": {"verdict": "not_identifiable"}}, "motor.inertia: the recordings do not tell them"),
}


@pytest.mark.parametrize("name", DOUBTS)
@pytest.mark.parametrize("to", ["mjcf", "urdf", "fmu", "c", "table"])
def test_numbers_that_are_no_answer_are_told(
    name: str, to: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the terminal and in the file, where that has room for words; nothing is refused."""
    stated, expected = DOUBTS[name]
    path = axis(tmp_path)
    if stated is not None:
        _result(path, **copy.deepcopy(stated))
    out = tmp_path / ("a.c" if to == "c" else f"a.{to}")
    assert main(["export", str(path), "--to", to, "--out", str(out), "--no-price"]) == DONE
    assert f"Doubtful: {expected}\n" in capsys.readouterr().out
    if to == "fmu":
        text = zipfile.ZipFile(out).read("modelDescription.xml").decode()
    elif to == "table":
        assert out.read_text(encoding="utf-8").startswith("shaft,")
        return
    else:
        text = (out.with_suffix(".h") if to == "c" else out).read_text(encoding="utf-8")
    assert f"Doubtful: {expected}." in text


@pytest.mark.parametrize("to", ["mjcf", "urdf", "fmu", "c"])
def test_an_answer_is_not_doubted(to: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a fit that converged gave is exported without a word, as are the problems of a diagnosis."""
    path = axis(tmp_path)
    _result(path)
    out = tmp_path / ("a.c" if to == "c" else f"a.{to}")
    assert main(["export", str(path), "--to", to, "--out", str(out), "--no-price"]) == DONE
    _result(path, format="friction-ocp-diagnosis/1", parameters={})
    assert load_fitted(path).doubts == ()
    assert "Doubtful" not in capsys.readouterr().out


def test_the_price_of_what_is_lost_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A servo whose friction grows with its load is told to be dear in MJCF."""
    path = servo(tmp_path, "load_dependent")
    assert main(["export", str(path), "--to", "mjcf", "--out", str(tmp_path / "a.xml")]) == DONE
    printed = capsys.readouterr().out
    share = float(printed.split("sin_sin-kp400")[1].split("%")[0].split()[-1])
    assert share > 10.0
    assert "The gap is large: fit a model that mjcf can express" in printed


def test_urdf_is_the_same_pendulum(tmp_path: Path) -> None:
    """MuJoCo reads the URDF and finds the inertia, gravity, damping and friction of the drive."""
    drive = joint_drive(load_fitted(axis(tmp_path)), elastic=False)
    text = urdf_text(drive, "axis")
    dynamics = ElementTree.fromstring(text).find("joint/dynamics")
    assert dynamics is not None
    assert [float(dynamics.attrib[key]) for key in ("damping", "friction")] == pytest.approx([0.7, 0.8])
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = 1.3
    mujoco.mj_forward(model, data)
    assert float(data.M[0]) == pytest.approx(2.3, rel=1e-9)
    assert -data.qfrc_bias[0] == pytest.approx(-4.0 * np.sin(1.7), abs=1e-9)


def test_urdf_of_an_elastic_drive_turns_as_one(tmp_path: Path) -> None:
    """Springs are lost to URDF, which is named; what they carry is one link."""
    drive = joint_drive(load_fitted(axis(tmp_path, drive__transmissions=[ELASTIC])), elastic=False)
    assert [joint.name for joint in drive.joints] == ["arm"]
    assert str(drive.losses[0]) == "motor-arm.stiffness = 900: the shafts turn as one"


@pytest.mark.parametrize("changes", [{}, {"drive__transmissions": [ELASTIC]}], ids=["rigid", "elastic"])
def test_c_is_the_same_simulation(tmp_path: Path, changes: dict[str, Any]) -> None:
    """Compiled as C99 without a warning, the exported step gives the free run of this package."""
    fitted = load_fitted(axis(tmp_path, **changes))
    compiled = CompiledModel(fitted, c_source(fitted), tmp_path / "cache")
    for run in fitted.runs():
        np.testing.assert_allclose(compiled.simulate(run), run.free.simulated, rtol=SAME_CODE, atol=SAME_CODE)


def test_c_files_compile_as_they_lie_there(tmp_path: Path) -> None:
    """Source and header of an export satisfy a strict compiler, whatever the title tries to break."""
    path = axis(tmp_path, title='*/ #error "title" /*')
    assert main(["export", str(path), "--to", "c", "--out", str(tmp_path / "arm.c"), "--no-price"]) == DONE
    flags = ["-std=c99", "-pedantic", "-Wall", "-Werror", "-Wno-unused"]
    subprocess.run(["cc", *flags, "-c", "arm.c", "-o", "arm.o"], cwd=tmp_path, check=True)


def test_the_compensation_is_the_friction_of_all_shafts_at_the_motor(tmp_path: Path) -> None:
    """At the motor's speed v the arm turns at -v / 20: its friction, Coulomb and viscous, comes back as a twentieth."""
    fitted = load_fitted(axis(tmp_path))
    compiled = CompiledModel(fitted, c_source(fitted), tmp_path / "cache")
    numbers = fitted.runs()[0].numbers
    width = compensation_width(fitted)
    assert compiled.compensate(0.0, width, numbers) == 0.0
    for speed in (-30.0, -2.0, 5.0, 40.0):
        expected = np.sign(speed) * (0.03 + (0.2 + 0.7 * abs(speed) / 20.0) / 20.0)
        assert compiled.compensate(speed, 1e-9, numbers) == pytest.approx(expected, rel=1e-9)


def test_the_compensation_is_told_without_a_price_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Name, arguments, whose friction it cancels, and what of the drive it does not."""
    ripple = {"cosine": 0.1, "sine": 0.0, "period": 1.0}
    lugre = {"law": "lugre", "tau_c": 0.03, "tau_s": 0.04, "omega_s": 0.1, "sigma0": 100.0, "load": {"coulomb": 0.02}}
    rough = {"law": "coulomb", "tau_c": 0.2, "ripple": ripple}
    path = axis(tmp_path, drive__shafts__0__friction=lugre, drive__shafts__1__friction=rough)
    assert main(["export", str(path), "--to", "c", "--out", str(tmp_path / "a.c"), "--no-price"]) == DONE
    printed = capsys.readouterr().out
    width = f"{compensation_width(load_fitted(path)):.3g}"
    for expected in (
        "Compensation: axis_compensate(speed, width, axis_identified) returns the torque, N m, at motor that cancels "
        "the friction of motor, arm in steady motion",
        "  speed: wanted, of motor, rad/s",
        f"  width: rad/s, within which it goes through zero; {width} suits the recordings",
        "  left out: presliding of motor: its level once it slides is taken at once",
        "  left out: growth of the friction of motor with the load: it is that without load",
        "  left out: ripple of the friction of arm: its mean over the angle is taken",
        "  left out: gravity on arm, which is no friction",
    ):
        assert f"{expected}\n" in printed
    header = (tmp_path / "a.h").read_text(encoding="utf-8")
    assert "   Left out: gravity on arm, which is no friction.\n" in header
    assert main(["export", str(path), "--to", "urdf", "--out", str(tmp_path / "a.urdf"), "--no-price"]) == DONE
    assert "Compensation" not in capsys.readouterr().out


def test_compensation_is_predicted_to_shrink_the_tracking_error(tmp_path: Path) -> None:
    """On the servo, which lags behind for other reasons too, the closed loop comes nearer to its reference."""
    (row,) = tracking_gain(load_fitted(servo(tmp_path)))
    assert (row.recording, row.unit) == ("sin_sin-kp400", "rad")
    assert 0.0 < row.after < row.before


def test_without_compensation_the_loop_is_the_free_run(tmp_path: Path) -> None:
    """What the prediction starts from is the closed loop as the sweep simulates it, while the motor is on."""
    fitted = load_fitted(servo(tmp_path))
    (row,), (run,) = tracking_gain(fitted), fitted.runs()
    signals = dict(zip(fitted.model.drive.input_names, run.item.grid.at_node.T, strict=True))
    channels = {item.measures: item.name for item in fitted.drive.inputs}
    on = signals[channels["servo.enable"]] > 0.5 if "servo.enable" in channels else slice(None)
    error = (run.free.simulated[:, 0] - signals[channels["reference.theta"]])[on]
    assert row.before == pytest.approx(float(np.sqrt(np.mean(error**2))), rel=1e-9)
    measured = (run.free.measured[:, 0] - signals[channels["reference.theta"]])[on]
    assert row.measured == pytest.approx(float(np.sqrt(np.nanmean(measured**2))), rel=1e-9)


def test_without_a_reference_nothing_is_predicted(tmp_path: Path) -> None:
    """A drive under a measured current follows nothing."""
    assert tracking_gain(load_fitted(axis(tmp_path))) == ()


@pytest.mark.parametrize("which", ["servo", "elastic"])
def test_the_fmu_is_valid_and_the_same_simulation(tmp_path: Path, which: str) -> None:
    """FMPy finds nothing against the FMU, and its free run is that of this package."""
    fitted = load_fitted(servo(tmp_path) if which == "servo" else axis(tmp_path, drive__transmissions=[ELASTIC]))
    write_fmu(fitted, tmp_path / "drive.fmu")
    with loaded_fmu(fitted, tmp_path / "drive.fmu") as fmu:
        for run in fitted.runs():
            np.testing.assert_allclose(fmu.simulate(run), run.free.simulated, rtol=SAME_CODE, atol=SAME_CODE)


def test_fmpy_runs_the_fmu_by_its_own_master(tmp_path: Path) -> None:
    """Alone, without this package, the FMU falls from its start angle to where gravity and friction leave it."""
    import fmpy

    write_fmu(load_fitted(axis(tmp_path)), tmp_path / "drive.fmu")
    starts = {"start of motor.theta": -20.0 * 1.0}
    result = fmpy.simulate_fmu(str(tmp_path / "drive.fmu"), stop_time=20.0, start_values=starts, output_interval=0.01)
    assert result["position"][0] == pytest.approx(1.0)
    assert abs(4.0 * np.sin(result["position"][-1] + 0.4)) <= 0.8
    assert np.ptp(result["position"][-100:]) < 1e-12


@pytest.mark.slow
def test_a_sampled_controller_ticks_in_c_and_fmu(tmp_path: Path) -> None:
    """The two-mass axis with its cascade: both exports run it as it runs here."""
    fitted = load_fitted(REPOSITORY / "problems" / "two_mass" / "joint.yaml")
    compiled = CompiledModel(fitted, c_source(fitted), tmp_path / "cache")
    write_fmu(fitted, tmp_path / "drive.fmu")
    with loaded_fmu(fitted, tmp_path / "drive.fmu") as fmu:
        for run in fitted.runs():
            scale = np.std(run.free.simulated, axis=0)
            for there in (compiled.simulate(run), fmu.simulate(run)):
                assert np.max(np.abs(there - run.free.simulated)[:-1] / scale) < 1e-6


def test_the_table_holds_the_law(tmp_path: Path) -> None:
    """Rows of speed and torque are the friction law; without a covariance beside it there is no band."""
    rows = list(csv.DictReader(table_text(load_fitted(axis(tmp_path))).splitlines()))
    arm = [row for row in rows if row["shaft"] == "arm"]
    speed, torque = (np.array([float(row[key]) for row in arm]) for key in ("speed", "torque"))
    np.testing.assert_allclose(torque[speed != 0], (np.sign(speed) * 0.2 + 0.7 * speed)[speed != 0], rtol=1e-7)
    assert {row["lower95"] for row in rows} == {""}
    assert {row["torque_unit"] for row in rows} == {"N m"}


def test_results_are_found_by_folder_and_by_file(tmp_path: Path) -> None:
    """A result folder, its result.json and its fitted.yaml are the same result; the rest is told."""
    path = servo(tmp_path)
    (tmp_path / "result.json").write_text("{}")
    assert {load_fitted(item).source for item in (tmp_path, tmp_path / "result.json", path)} == {path}
    (tmp_path / "empty").mkdir()
    for wrong, message in (
        (tmp_path / "nothing", "there is no such result"),
        (tmp_path / "empty", "run identify first"),
        (shutil.copy(path, tmp_path / "x.txt"), "this is no result"),
    ):
        with pytest.raises(FrictionOcpError, match=message):
            load_fitted(wrong)


def test_a_drive_that_is_moved_has_no_joint_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A shaft whose motion is an input is refused, and nothing is written."""
    channels = {"position": {"measures": "arm.theta", "role": "input"}, "current": {"measures": "motor.current"}}
    path = axis(tmp_path, channels=channels | {"current": {"measures": "motor.torque"}})
    status = main(["export", str(path), "--to", "mjcf", "--out", str(tmp_path / "a.xml")])
    assert status == WRONG_INPUT
    assert not (tmp_path / "a.xml").exists()
    assert capsys.readouterr().err
