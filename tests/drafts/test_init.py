"""`init`: drafts of problem files that `check` accepts, from templates, models and answers."""

from __future__ import annotations

import builtins
import math
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml

from friction_ocp.cli import DONE, WRONG_INPUT, main
from friction_ocp.drafts.axis import TEMPLATES
from friction_ocp.drafts.draft import init
from friction_ocp.drafts.model_joint import axis_of_joint
from friction_ocp.drafts.questions import axis_of_answers
from friction_ocp.errors import FrictionOcpError
from friction_ocp.problem_file.check import check_file
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

TIME = 0.01 * np.arange(300)
ARM = """
<mujoco><compiler angle="radian"/><worldbody><body name="upper">
  <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.7" frictionloss="0.8" armature="0.8"/>
  <inertial pos="0.3 0 -0.4" mass="2" diaginertia="0.5 0.5 0.5"/>
  <body pos="0 0 -1"><joint name="elbow" type="hinge" axis="0 1 0"/><joint name="lift" type="slide" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/></body>
</body></worldbody>
<actuator><motor name="m" joint="shoulder" gear="50"/></actuator></mujoco>
"""
URDF = """<robot name="arm"><link name="base"/><link name="upper">
  <inertial><origin xyz="0.3 0 -0.4"/><mass value="2"/>
  <inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><mesh filename="package://nowhere/upper.stl"/></geometry></visual></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
  <dynamics damping="0.7" friction="0.8"/></joint></robot>"""


def record(folder: Path, name: str = "run", **units: str) -> Path:
    """Write a recording of waves with the given channels and units."""
    folder.mkdir(parents=True, exist_ok=True)
    channels = {key: Channel(key, TIME, np.sin(TIME + k), unit) for k, (key, unit) in enumerate(units.items())}
    write_recording(Recording(name, channels), folder / f"{name}.h5")
    return folder


@pytest.fixture
def rotary(tmp_path: Path) -> Path:
    return record(tmp_path / "data", current="A", motor_position="rad", ambient="degC")


def drafted(path: Path) -> dict:
    problem = load_problem(path)
    assert check_file(problem) == ()
    return yaml.safe_load(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", [name for name, axis in TEMPLATES.items() if not (axis.linear or axis.held)])
def test_templates_pass_the_rules_about_files(tmp_path: Path, rotary: Path, name: str) -> None:
    """Every template of a rotary drive is a problem with the recordings there, by paths beside the file."""
    out = tmp_path / "problems" / "axis.yaml"
    assert main(["init", name, "--recordings", str(rotary), "--out", str(out)]) == DONE
    content = drafted(out)
    assert content["recordings"] == {"train": ["../data/run.h5"]}
    assert content["channels"]["current"] == {"measures": "motor.current", "role": "input"}
    assert content["channels"]["ambient"]["measures"] == "temperature"
    shaft = "servo" if name == "servo" else "motor"
    assert content["channels"]["motor_position"]["measures"] == f"{shaft}.theta"


@pytest.mark.parametrize(
    ("units", "motion", "measures"),
    [
        (
            {"normal": "N", "friction": "N", "position": "m"},
            "linear",
            {"position": "theta", "friction": "drive_torque"},
        ),
        ({"angle": "rad", "rate": "rad/s", "torque": "N m"}, "rotary", {"rate": "omega", "torque": "drive_torque"}),
    ],
)
def test_a_test_bench_is_told_its_motion(
    tmp_path: Path, units: dict[str, str], motion: str, measures: dict[str, str]
) -> None:
    """A tribometer's friction force, or a dynamometer's torque, is what the motion takes; sizes are as recorded."""
    folder = record(tmp_path / "data", **units)
    assert main(["init", "test_bench", "--recordings", str(folder), "--out", str(tmp_path / "a.yaml")]) == DONE
    content = drafted(tmp_path / "a.yaml")
    expected = {name: f"sample.{signal}" for name, signal in measures.items()}
    assert {name: item["measures"] for name, item in content["channels"].items()} == expected
    assert content["channels"][next(iter(measures))]["role"] == "input"
    (shaft,) = content["drive"]["shafts"]
    assert shaft.get("motion", "rotary") == motion and "motors" not in content["drive"]
    assert 0.3 < shaft["friction"]["tau_c"]["guess"] < 1.0


def test_a_force_drives_no_rotary_motor(tmp_path: Path) -> None:
    """A tribometer's log is no feed drive, and what it is instead is said."""
    folder = record(tmp_path / "data", friction="N", position="m")
    with pytest.raises(FrictionOcpError, match=r"no channel drives the motor: they are friction \(N\), position \(m\)"):
        init("feed_drive", folder, tmp_path / "a.yaml")
    with pytest.raises(FrictionOcpError, match="or take the template test_bench"):
        init("feed_drive", folder, tmp_path / "a.yaml")
    with pytest.raises(FrictionOcpError, match="a motion and what it takes are not both there"):
        init("test_bench", record(tmp_path / "other", friction="N", angle="rad"), tmp_path / "a.yaml")


def test_a_linear_drive_keeps_its_units_apart(tmp_path: Path) -> None:
    """Of a feed drive, metres are of the table and radians of the screw."""
    folder = record(tmp_path / "data", force="N", current="A", table_position="m", screw="rad/s")
    assert main(["init", "feed_drive", "--recordings", str(folder), "--out", str(tmp_path / "a.yaml")]) == DONE
    measures = {name: item["measures"] for name, item in drafted(tmp_path / "a.yaml")["channels"].items()}
    assert measures == {"current": "motor.current", "table_position": "table.theta", "screw": "motor.omega"}


@pytest.mark.parametrize(("units", "driven"), [({"u": "V"}, "voltage"), ({"tau": "N m"}, "torque")])
def test_motors_are_driven_by_what_is_recorded(tmp_path: Path, units: dict[str, str], driven: str) -> None:
    """Voltage needs a resistance, torque no torque constant; a supply drives nothing."""
    folder = record(tmp_path / "data", supply="V", **units, angle="rad")
    assert main(["init", "servo", "--recordings", str(folder), "--out", str(tmp_path / "a.yaml")]) == DONE
    content = drafted(tmp_path / "a.yaml")
    motor = content["drive"]["motors"][0]
    assert next(iter(content["channels"].values()))["measures"] == f"motor.{driven}"
    assert ("resistance" in motor, "torque_constant" in motor) == (driven == "voltage", driven != "torque")


def test_recordings_are_split_to_fit_and_to_judge(tmp_path: Path) -> None:
    """Names that say so judge; else every fourth, or the last of several. Channels that some lack are not used."""
    for name in ("a", "b", "c", "d", "e"):
        record(tmp_path / "many", name, current="A", angle="rad")
    record(tmp_path / "many", "f", current="A", angle="rad", other="1")
    for name in ("fit", "check_run"):
        record(tmp_path / "named", name, current="A", angle="rad")
    for folder, judged in (("many", ["d"]), ("named", ["check_run"])):
        out = tmp_path / f"{folder}.yaml"
        assert main(["init", "servo", "--recordings", str(tmp_path / folder), "--out", str(out)]) == DONE
        assert [Path(item).stem for item in drafted(out)["recordings"]["validation"]] == judged
    assert "# Channels of the recordings that are not used: other." in (tmp_path / "many.yaml").read_text()


@pytest.mark.parametrize(("name", "text"), [("arm.xml", ARM), ("arm.urdf", URDF)])
def test_a_joint_of_a_model_is_the_axis(tmp_path: Path, rotary: Path, name: str, text: str) -> None:
    """Inertia with armature, damping, friction, and the gravity of 2 kg at 0.5 m: g sin(theta + phase)."""
    (tmp_path / name).write_text(text)
    axis = axis_of_joint(tmp_path / name, "shoulder")
    armature = 0.8 if name == "arm.xml" else 0.0
    assert axis.load_inertia == pytest.approx(0.5 + 2 * 0.25 + armature, rel=1e-4)
    assert (axis.viscous, axis.tau_c) == pytest.approx((0.7, 0.8))
    assert axis.gravity is not None
    assert axis.gravity[0] == pytest.approx(9.81, rel=1e-4)
    assert axis.gravity[1] == pytest.approx(-math.atan2(0.3, 0.4), rel=1e-4)
    arguments = ["init", str(tmp_path / name), "--joint", "shoulder", "--recordings", str(rotary)]
    assert main([*arguments, "--out", str(tmp_path / "a.yaml")]) == DONE
    assert drafted(tmp_path / "a.yaml")["drive"]["shafts"][0]["friction"]["tau_c"]["guess"] == 0.8


@pytest.mark.parametrize(
    "other",
    [
        "soll_lage",
        "Lagesollwert",
        "set_angle",
        "angleSP",
        "position_error",
        "posErr",
        "schleppfehler",
        "Regelabweichung",
    ],
)
def test_set_points_and_their_errors_are_no_sensors(tmp_path: Path, other: str) -> None:
    """A following error moves unlike the shaft, and a set point like it: neither is a second sensor of it."""
    folder = record(tmp_path / "logs", current="A", spindle_angle="rad", offset_speed="rad/s", **{other: "rad"})
    init("servo", folder, tmp_path / "axis.yaml")
    assert list(drafted(tmp_path / "axis.yaml")["channels"]) == ["current", "spindle_angle", "offset_speed"]


def test_a_spoilt_recording_is_named(tmp_path: Path, rotary: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One that lost a unit is not passed over in silence, neither on the terminal nor in the draft."""
    record(rotary, "spoilt", current="A", motor_position="rad")
    with h5py.File(rotary / "spoilt.h5", "a") as file:
        del file["channels/current"].attrs["unit"]
    out = tmp_path / "axis.yaml"
    assert main(["init", "servo", "--recordings", str(rotary), "--out", str(out)]) == DONE
    assert "warning: not read: " in (said := capsys.readouterr().err) and "spoilt.h5" in said
    head = out.read_text(encoding="utf-8").split("format:")[0]
    assert "Not read: " in head and "spoilt.h5" in head


def test_a_slide_is_a_linear_axis(tmp_path: Path) -> None:
    """A sliding joint has no gravity torque, and what its model leaves at zero gets a small guess."""
    (tmp_path / "arm.xml").write_text(ARM)
    axis = axis_of_joint(tmp_path / "arm.xml", "lift")
    assert (axis.linear, axis.gravity) == (True, None)
    assert axis.tau_c > 0 and axis.viscous > 0


def test_questions_take_what_is_typical_for_an_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Empty answers are the template; numbers that are none, or not above 0, are asked for again."""
    assert axis_of_answers(lambda question: "") == TEMPLATES["robot_joint"]
    replies = iter(["telescope_axis", "many", "-5", "12000", "", "elastic", "7e7", "", "", "lugre"])
    monkeypatch.setattr(builtins, "input", lambda question: next(replies))
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    folder = record(tmp_path / "data", current="A", encoder="rad")
    assert main(["init", "--recordings", str(folder), "--out", str(tmp_path / "a.yaml")]) == DONE
    content = drafted(tmp_path / "a.yaml")
    (joint,) = content["drive"]["transmissions"]
    assert (joint["ratio"], float(joint["stiffness"]["guess"])) == (12000.0, 7e7)
    assert content["drive"]["shafts"][0]["friction"]["law"] == "lugre"
    assert content["constraints"] == ["motor.friction.tau_s >= motor.friction.tau_c"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["rocket"],
            "init: there is no template 'rocket'; templates: telescope_axis, servo, robot_joint, feed_drive, test_",
        ),
        (["servo", "--joint", "a"], "init: --joint stands beside a template"),
        ([], "init: nothing is named, and there is no terminal to ask on; a template (telescope_axis,"),
        (["nowhere.xml"], "nowhere.xml: there is no such file"),
        (
            ["arm.xml"],
            "arm.xml: the model has 3 joints that turn or slide; joints: shoulder, elbow, lift; choose one with",
        ),
        (["arm.xml", "--joint", "wrist"], "arm.xml: there is no joint 'wrist' that turns or slides; joints: shoulder"),
        (["broken.xml"], "broken.xml: MuJoCo cannot read it ("),
        (["bomb.urdf"], "bomb.urdf: it declares entities"),
        (["servo", "--recordings", "empty"], "empty: there are no recordings; *.h5; turn logs into recordings with"),
        (["servo", "--recordings", "blind"], "blind: no channel sees the motion: they are current (A); an angle"),
        (["servo", "--recordings", "idle"], "idle: no channel drives the motor: they are angle (rad); a current (A)"),
        (["servo", "--recordings", "data", "--out", "arm.xml"], "arm.xml: there is a file already; give another --out"),
    ],
)
def test_what_is_missing_is_told(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    """Each finding names what there is; nothing is written."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody>")
    (tmp_path / "bomb.urdf").write_text('<!DOCTYPE r [<!ENTITY a "aa">]><robot name="&a;"/>')
    (tmp_path / "empty").mkdir()
    record(tmp_path / "data", current="A", angle="rad")
    record(tmp_path / "blind", current="A")
    record(tmp_path / "idle", angle="rad")
    before = sorted(tmp_path.rglob("*"))
    assert main(["init", *arguments]) == WRONG_INPUT
    assert message in capsys.readouterr().err
    assert sorted(path for path in tmp_path.rglob("*") if path.name != "MUJOCO_LOG.TXT") == before


def test_models_need_mujoco(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without MuJoCo the install command is given."""
    (tmp_path / "arm.xml").write_text(ARM)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    from friction_ocp.errors import FrictionOcpError

    with pytest.raises(FrictionOcpError, match=r"pip install 'friction-ocp\[mujoco\]'"):
        axis_of_joint(tmp_path / "arm.xml", "shoulder")
