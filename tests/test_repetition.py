"""A result says how it was made; made again, its numbers are the same, and what changed is named."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import pytest
from servo_problem import write_servo

import friction_ocp as fo
from friction_ocp import repetition
from friction_ocp.cli import DONE, INTERRUPTED, WRONG_INPUT, main
from friction_ocp.parameters import Free

sys.path.insert(0, str(Path(__file__).parent / "fleet"))
sys.path.insert(0, str(Path(__file__).parent / "diagnosis"))

from diagnosis_cases import axis, write_case
from simulated_fleet import write_axis, write_fleet

pytestmark = pytest.mark.usefixtures("without_figures")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with nights of one machine, the problem about the first, and its identification."""
    folder = tmp_path_factory.mktemp("made")
    files = write_fleet(folder / "nights", 1, 2)
    problem = write_axis(folder / "axis.yaml", files[0])
    assert main(["identify", str(problem), "--out", str(folder / "out")]) == DONE
    return folder


@pytest.fixture
def copied(made: Path, tmp_path: Path) -> Path:
    """Return a copy of the same, with the result naming the copy, to be changed at will."""
    folder = tmp_path / "copy"
    shutil.copytree(made, folder)
    problem = write_axis(folder / "axis.yaml", folder / "nights" / "telescope-01" / "night-01.h5")
    assert main(["identify", str(problem), "--out", str(folder / "out")]) == DONE
    return folder


def rerun(folder: Path, *more: str) -> tuple[int, dict[str, Any]]:
    """Make a result again and return the exit status and rerun.json."""
    out = folder / "again"
    status = main(["rerun", str(folder / "out"), "--out", str(out), "--workers", "1", *more])
    return status, json.loads((out / "rerun.json").read_text(encoding="utf-8"))


def test_a_result_says_all_that_it_was_made_from(made: Path) -> None:
    """Versions, command, the problem word for word, checksums, options and seed."""
    found = json.loads((made / "out" / "result.json").read_text(encoding="utf-8"))["provenance"]
    assert {"friction_ocp", "casadi", "numpy", "scipy", "python", "code", "seed", "created"} <= found.keys()
    assert found["command"] == {"name": "identify", "options": {}}
    assert found["problems"][0]["text"] == (made / "axis.yaml").read_text(encoding="utf-8")
    assert found["options"]["fit"] == "simulation" and found["options"]["max_iterations"] == 100
    assert all(len(digest) == 64 for digest in found["recordings"].values())


def test_results_open_without_this_package(made: Path) -> None:
    """json and h5py read everything: no pickle, no type of our own."""
    result = json.loads((made / "out" / "result.json").read_text(encoding="utf-8"))
    with h5py.File(made / "out" / "result.h5") as file:
        channel = file["night-01/position"]
        assert channel["time"].shape == channel["measured"].shape == channel["simulated"].shape
        assert channel["measured"].attrs["unit"] == result["channel_units"]["position"] == "rad"


def test_nothing_changed_is_the_same_numbers(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Status 0, no input changed, every number compared; the repetition leaves a result of its own."""
    status, found = rerun(copied)
    assert status == DONE and found["agrees"] and found["changed"] == [] and found["compared"] > 20
    assert "all agree" in capsys.readouterr().out
    assert (copied / "again" / "report.html").exists()


COMMANDS = {
    "simulate": [],
    "multistart": ["--starts", "2", "--workers", "1"],
    "bootstrap": ["--draws", "20", "--workers", "1"],
    "profile": ["--parameter", "motor.inertia", "--workers", "1"],
}
QUICK = ("simulate", "multistart")
"""Those that every run of the tests repeats."""


@pytest.mark.parametrize(
    "command", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS]
)
def test_other_results_are_made_again_with_their_options(command: str, made: Path, tmp_path: Path) -> None:
    """The command and its options are in the result."""
    assert main([command, str(made / "axis.yaml"), "--out", str(tmp_path / "out"), *COMMANDS[command]]) == DONE
    status, found = rerun(tmp_path)
    assert (status, found["differences"], found["changed"]) == (DONE, [], [])
    document = json.loads((tmp_path / "again" / "result.json").read_text(encoding="utf-8"))
    first = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert document["provenance"]["command"] == first["provenance"]["command"]
    assert not (tmp_path / "again" / "tasks").exists()


def test_a_comparison_is_made_again(made: Path, tmp_path: Path) -> None:
    """All of its problems are in the result."""
    text = (made / "axis.yaml").read_text(encoding="utf-8")
    (made / "fixed.yaml").write_text(text.replace("guess: 0.003", "guess: 0.002"), encoding="utf-8")
    problems = [str(made / name) for name in ("axis.yaml", "fixed.yaml")]
    assert main(["compare", *problems, "--out", str(tmp_path / "out"), "--workers", "1"]) == DONE
    status, found = rerun(tmp_path)
    assert (status, found["differences"]) == (DONE, [])


def test_a_batch_is_made_again(made: Path, tmp_path: Path) -> None:
    """Its fits are made anew, not taken from the store."""
    command = ["batch", str(made / "axis.yaml"), str(made / "nights"), "--out", str(tmp_path / "out"), "--workers", "1"]
    assert main(command) == DONE
    status, found = rerun(tmp_path)
    assert (status, found["differences"], found["changed"]) == (DONE, [], [])


@pytest.fixture(scope="module")
def fleet(made: Path) -> Path:
    """Return a folder in which a batch was run with paths relative to it."""
    folder = made / "fleet"
    shutil.copytree(made / "nights", folder / "nights")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        write_axis(Path("axis.yaml"), Path("nights") / "telescope-01" / "night-01.h5")
        assert main(["batch", "axis.yaml", "nights", "--out", "results/batch", "--workers", "1"]) == DONE
    return folder


@pytest.mark.parametrize("where", ["elsewhere", "moved", "decoy"])
def test_a_batch_is_made_again_from_another_folder(
    where: str, fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recordings are found as the problem file is; one of the same name that is another file is not taken for it."""
    source = fleet
    if where == "moved":
        source = tmp_path / "new home"
        shutil.copytree(fleet, source)
        shutil.move(source / "results" / "batch", tmp_path / "batch")
        result, more = tmp_path / "batch", ["--problem", str(source / "axis.yaml")]
    else:
        result, more = source / "results" / "batch", []
    if where == "decoy":
        shutil.copytree(fleet / "nights", tmp_path / "nights")
        write_axis(tmp_path / "axis.yaml", Path("nights") / "telescope-01" / "night-02.h5")
        with h5py.File(tmp_path / "nights" / "telescope-01" / "night-02.h5", "r+") as file:
            file["channels/position"][...] *= 1.1
    monkeypatch.chdir(tmp_path)
    assert main(["rerun", str(result), "--out", "again", "--workers", "1", *more]) == DONE
    found = json.loads((tmp_path / "again" / "rerun.json").read_text(encoding="utf-8"))
    assert (found["differences"], found["changed"]) == ([], [])


def test_a_recording_of_a_batch_that_is_gone_is_named(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before any work, with what to do."""
    shutil.copytree(fleet / "results" / "batch", tmp_path / "batch")
    monkeypatch.chdir(tmp_path)
    assert main(["rerun", "batch", "--out", "again"]) == WRONG_INPUT
    assert "nights/telescope-01/night-01.h5: this recording is gone; " in capsys.readouterr().err
    assert not (tmp_path / "again").exists()


def test_a_changed_problem_file_is_named_and_not_used(copied: Path) -> None:
    """The result holds the problem that made it."""
    path = copied / "axis.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace("0.35", "0.4"), encoding="utf-8")
    status, found = rerun(copied)
    assert status == DONE and found["agrees"]
    assert found["changed"] == [f"{path} is another file now; the copy in the result was used"]


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_problem_file_that_is_gone_is_not_missed(command: str, tmp_path: Path) -> None:
    """The result holds it; recordings are found from where it lay, and fitted problems are written from the copy."""
    problem = write_case(tmp_path, axis())
    options = [] if command == "identify" else ["--workers", "1"]
    assert main([command, str(problem), "--out", str(tmp_path / "out"), *options]) == DONE
    problem.unlink()
    status, found = rerun(tmp_path)
    assert (status, found["differences"]) == (DONE, [])
    assert found["changed"] == [f"{problem} is gone; the copy in the result was used"]
    name = "fitted.yaml" if command == "identify" else "base.yaml"
    ours, theirs = ((tmp_path / out / name).read_text(encoding="utf-8") for out in ("again", "out"))
    assert ours == theirs


def test_a_changed_recording_is_named_and_the_numbers_differ(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Status 1; what differs is listed with both values."""
    with h5py.File(copied / "nights" / "telescope-01" / "night-01.h5", "r+") as file:
        file["channels/position"][...] *= 1.1
    status, found = rerun(copied)
    assert status == WRONG_INPUT and not found["agrees"]
    assert found["changed"] == ["recording night-01 is another file now"]
    assert "parameters.motor.inertia.value" in {item["where"] for item in found["differences"]}
    assert "parameters.motor.inertia.value: was" in capsys.readouterr().err


def test_a_version_is_named(copied: Path) -> None:
    """What other code made is told, whether or not it matters."""
    path = copied / "out" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    result["provenance"]["casadi"] = "3.0.0"
    path.write_text(json.dumps(result), encoding="utf-8")
    status, found = rerun(copied)
    assert status == DONE and [text[:19] for text in found["changed"]] == ["casadi was 3.0.0, i"]


def test_a_problem_that_moved_is_found_where_it_is_said_to_lie(copied: Path) -> None:
    """Recordings are found from the new place of the problem file."""
    moved = copied.with_name("elsewhere")
    copied.rename(moved)
    moved_problem = write_axis(moved / "axis.yaml", Path("nights") / "telescope-01" / "night-01.h5")
    result = json.loads((moved / "out" / "result.json").read_text(encoding="utf-8"))
    result["provenance"]["problems"][0]["text"] = moved_problem.read_text(encoding="utf-8")
    (moved / "out" / "result.json").write_text(json.dumps(result), encoding="utf-8")
    status, found = rerun(moved, "--problem", str(moved_problem))
    assert status == DONE and found["agrees"]


def test_a_problem_changed_in_python_is_told(copied: Path) -> None:
    """The file in the result is then not what was fitted."""
    problem = fo.load_problem(copied / "axis.yaml")
    (shaft,) = problem.drive.shafts
    drive = replace(problem.drive, shafts=(replace(shaft, inertia=Free(0.002, 0.0015, 0.0018)),))
    fo.save(fo.identify(replace(problem, drive=drive)), copied / "out")
    status, found = rerun(copied)
    assert status == WRONG_INPUT
    assert "the problem had been changed in Python after its file was read" in found["changed"]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("{", "cannot be read as a result"),
        ("[]", "this is not a result"),
        ('{"format": "friction-ocp-result/1"}', "it does not say how it was made"),
        (
            '{"format": "friction-ocp-result/1", "provenance": {"command": {"name": "identify"}, "problems": [null]}}',
            "its problem was made in Python",
        ),
        (
            '{"format": "friction-ocp-result/1", "provenance": {"command": {"name": "rm"}, "problems": []}}',
            "it does not say how it was made",
        ),
    ],
)
def test_what_is_no_result_is_wrong_input(
    text: str, complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 1 and a reason, whatever the file holds."""
    (tmp_path / "result.json").write_text(text, encoding="utf-8")
    assert main(["rerun", str(tmp_path), "--out", str(tmp_path / "again")]) == WRONG_INPUT
    assert complaint in capsys.readouterr().err


def test_a_result_is_not_overwritten_by_its_repetition(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The folder of the result is refused as output."""
    assert main(["rerun", str(made / "out"), "--out", str(made / "out")]) == WRONG_INPUT
    assert "give another --out" in capsys.readouterr().err


def test_the_servo_is_the_same_again(tmp_path: Path) -> None:
    """A closed loop with two recordings, one of them held out."""
    assert main(["identify", str(write_servo(tmp_path)), "--out", str(tmp_path / "out")]) == DONE
    status, found = rerun(tmp_path)
    assert (status, found["differences"], found["changed"]) == (DONE, [], [])


def edited(folder: Path, edit: Callable[[dict[str, Any]], None]) -> None:
    """Change what the first result of a folder says."""
    path = folder / "out" / "result.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    edit(document)
    path.write_text(json.dumps(document), encoding="utf-8")


def test_what_a_diagnosis_found_afterwards_is_compared(tmp_path: Path) -> None:
    """The gap that is left differs, and so does what follows from it."""
    command = ["diagnose", str(write_case(tmp_path, axis())), "--out", str(tmp_path / "out"), "--workers", "1"]
    assert main(command) == DONE

    def halve(document: dict[str, Any]) -> None:
        for found in document["gap"]["after"].values():
            found["rms"] *= 0.5

    edited(tmp_path, halve)
    status, found = rerun(tmp_path)
    assert status == WRONG_INPUT
    assert {item["where"] for item in found["differences"]} == {"gap.after.position.rms"}


@pytest.mark.parametrize(("share", "expected"), [(0.005, DONE), (0.02, WRONG_INPUT)])
def test_a_parameter_may_differ_by_a_share_of_its_standard_error(copied: Path, share: float, expected: int) -> None:
    """That share is 1 %, whatever the tolerance of all other numbers is."""

    def shift(document: dict[str, Any]) -> None:
        inertia = document["parameters"]["motor.inertia"]
        inertia["value"] += share * inertia["std_error"]

    edited(copied, shift)
    status, found = rerun(copied, "--tolerance", "1e-9")
    places = [] if expected == DONE else ["parameters.motor.inertia.value"]
    assert (status, [item["where"] for item in found["differences"]]) == (expected, places)


def test_the_store_of_a_fleet_is_not_lost(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder with the work of another command is refused before anything is done, and left as it is."""
    for kept in ("fits.sqlite", "tasks/start-1.json"):
        folder = tmp_path / Path(kept).stem
        (folder / kept).parent.mkdir(parents=True)
        (folder / kept).write_text("dear", encoding="utf-8")
        assert main(["rerun", str(made / "out"), "--out", str(folder)]) == WRONG_INPUT
        assert "the work of another command lies here" in capsys.readouterr().err
        assert (folder / kept).read_text(encoding="utf-8") == "dear"
        assert not (folder / "result.json").exists()


def test_an_interrupted_repetition_goes_on_in_its_folder(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it had finished is found again, whatever else is made again there is not, and at the end none is left."""
    finished = tmp_path / "tasks" / "start-1.json"

    def interrupted(*_: Any, **__: Any) -> None:
        finished.parent.mkdir()
        finished.write_text("{}", encoding="utf-8")
        raise KeyboardInterrupt

    command = ["rerun", str(made / "out"), "--out", str(tmp_path), "--workers", "1"]
    with monkeypatch.context() as patch:
        patch.setattr(repetition, "identify", interrupted)
        assert main(command) == INTERRUPTED
    found: list[bool] = []
    real = repetition.identify

    def watched(*given: Any) -> Any:
        found.append(finished.exists())
        return real(*given)

    monkeypatch.setattr(repetition, "identify", watched)
    assert main(command) == DONE
    assert found == [True]
    assert {path.name for path in tmp_path.iterdir()} >= {"rerun.json", "result.json"}
    assert not finished.exists() and not (tmp_path / "rerun-under-way.txt").exists()


@pytest.mark.parametrize("command", ["rerun", "compare"])
def test_a_folder_is_named_after_the_whole_name_of_the_result(
    command: str, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two versions of a model do not share an output folder: what follows a dot is a part of the name."""
    monkeypatch.chdir(tmp_path)
    for name in ("arm.v1-identify", "arm.v2-identify"):
        shutil.copytree(made / "out", name)
    options = ["arm.v1-identify", *(["arm.v2-identify"] if command == "compare" else ["--workers", "1"])]
    assert main([command, *options]) == DONE
    assert [path.name for path in Path("results").iterdir()] == [f"arm.v1-identify-{command}"]
