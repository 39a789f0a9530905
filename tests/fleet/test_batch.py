"""Batches from the command line: what is found, what is kept, and what is not done twice."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from simulated_fleet import Change, machine_name, write_axis, write_fleet

from friction_ocp.cli import DONE, WRONG_INPUT, main
from friction_ocp.report.fleet_words import fleet_summary

MACHINES, NIGHTS = 3, 7
GROWTH, DRIFTING = 0.3, 1


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a problem and the output folder of its batch: friction of the second machine grows by 30 %."""
    folder = tmp_path_factory.mktemp("fleet")
    files = write_fleet(folder / "nights", MACHINES, NIGHTS, (Change(DRIFTING, GROWTH),))
    problem = write_axis(folder / "axis.yaml", files[0])
    command = ["batch", str(problem), str(folder / "nights"), "--out", str(folder / "out"), "--workers", "1"]
    assert main(command) == DONE
    return problem, folder / "out"


def result_of(folder: Path) -> dict[str, Any]:
    """Return result.json."""
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


def count_of(folder: Path) -> int:
    """Return how many fits a store has; none where it is being made."""
    if not (folder / "fits.sqlite").exists():
        return 0
    try:
        return len(rows_of(folder))
    except sqlite3.OperationalError:
        return 0


def rows_of(folder: Path) -> dict[str, tuple[str, str]]:
    """Return when each recording of the store was fitted, and its document."""
    connection = sqlite3.connect(folder / "fits.sqlite")
    try:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        found = connection.execute("SELECT recording, created, document FROM fits").fetchall()
    finally:
        connection.close()
    return {recording: (created, document) for recording, created, document in found}


def test_a_planted_drift_is_found_and_nothing_else(fleet: tuple[Path, Path]) -> None:
    """The friction that grows is flagged with its size; machines that only scatter are not."""
    result = result_of(fleet[1])
    (flag,) = [item for item in result["drifts"] if item["flagged"]]
    assert (flag["machine"], flag["parameter"]) == (machine_name(DRIFTING), "motor.friction.tau_c")
    assert flag["adjusted_p_value"] <= result["false_alarm_rate"] / 2
    low, high = (end / flag["before"] for end in flag["interval95"])
    assert low < GROWTH < high
    assert result["outliers"] == []
    assert len(result["fits"]) == MACHINES * NIGHTS and result["status"] == "converged"


def test_the_store_has_a_row_a_fit_with_its_provenance(fleet: tuple[Path, Path]) -> None:
    """Each row names recording, checksum, versions and seed; parameters are rows that SQL can average."""
    for recording, (_, document) in rows_of(fleet[1]).items():
        provenance = json.loads(document)["provenance"]
        assert Path(recording).exists() and {"friction_ocp", "casadi", "seed"} <= provenance.keys()
    connection = sqlite3.connect(fleet[1] / "fits.sqlite")
    query = "SELECT count(*), avg(value) FROM parameters WHERE name = 'motor.inertia' AND verdict = 'ok'"
    count, mean = connection.execute(query).fetchone()
    connection.close()
    assert count == MACHINES * NIGHTS and mean == pytest.approx(0.002, rel=0.01)


def test_result_files_open_with_json_and_h5py_alone(fleet: tuple[Path, Path]) -> None:
    """Estimates over time, in seconds, with the level or drift that was found."""
    result = result_of(fleet[1])
    with h5py.File(fleet[1] / "result.h5") as file:
        for item in result["series"]:
            group = file[item["machine"]][item["parameter"]]
            np.testing.assert_allclose(group["measured"][()], item["value"])
            np.testing.assert_allclose(group["time"][()], 86400.0 * np.array(item["time"]))
            assert np.all(np.isfinite(group["simulated"][()]))


def test_page_and_figures_show_the_flag(fleet: tuple[Path, Path]) -> None:
    """The page says what moved, escapes what it shows, and every parameter has its figure."""
    page = (fleet[1] / "report.html").read_text(encoding="utf-8")
    assert "moves steadily by" in page and "1 parameter drifts, no fits stand out" in page
    names = {path.stem for path in (fleet[1] / "figures").glob("*.svg")}
    assert names == {"motor.inertia", "motor.friction.tau_c", "motor.friction.viscous"}
    assert "telescope-02: motor.friction.tau_c" in fleet_summary(result_of(fleet[1]))


def test_only_what_is_new_is_fitted(fleet: tuple[Path, Path], tmp_path: Path) -> None:
    """A recording more is one fit more, wherever the others lie now; the report is about all of them."""
    out = tmp_path / "out"
    shutil.copytree(fleet[1], out)
    before = rows_of(out)
    moved = tmp_path / "moved"
    shutil.copytree(fleet[0].parent / "nights", moved)
    (extra,) = write_fleet(tmp_path / "more", 1, 1, seed=9)
    assert main(["batch", str(fleet[0]), str(moved), str(extra), "--out", str(out), "--workers", "1"]) == DONE
    after = rows_of(out)
    assert len(after) == len(before) + 1
    assert sorted(before.values()) == sorted(value for path, value in after.items() if path != str(extra))
    assert all(Path(path).is_relative_to(tmp_path) for path in after)


def test_a_recording_that_cannot_be_fitted_stops_no_other(fleet: tuple[Path, Path], tmp_path: Path) -> None:
    """Its row says why; the others are fitted, and the page warns."""
    files = write_fleet(tmp_path / "nights", 1, 3)
    with h5py.File(files[1], "r+") as file:
        del file["channels/position"]
    assert main(["batch", str(fleet[0]), *map(str, files), "--out", str(tmp_path / "out"), "--workers", "1"]) == DONE
    result = result_of(tmp_path / "out")
    assert [item["status"] for item in result["fits"]] == ["converged", "failed", "converged"]
    assert any("night-02" in warning and "position" in warning for warning in result["warnings"])


def test_machines_are_told_apart_by_folder_or_attribute(fleet: tuple[Path, Path], tmp_path: Path) -> None:
    """Without the attribute the folder names the machine, and the names of the files give the order."""
    files = write_fleet(tmp_path / "nights", 2, 1)
    for file in files:
        with h5py.File(file, "r+") as content:
            del content.attrs["machine"], content.attrs["started"]
            content.attrs["joint"] = "elbow"
    assert main(["batch", str(fleet[0]), *map(str, files), "--out", str(tmp_path / "a"), "--workers", "1"]) == DONE
    assert set(result_of(tmp_path / "a")["machines"]) == {machine_name(0), machine_name(1)}
    again = ["batch", str(fleet[0]), *map(str, files), "--out", str(tmp_path / "a"), "--machine", "joint"]
    assert main([*again, "--workers", "1"]) == DONE
    result = result_of(tmp_path / "a")
    assert set(result["machines"]) == {"elbow"} and result["time"] == "number of the recording"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["nowhere.h5"], "there is no such file"),
        (["--false-alarms", "2"], "a probability between 0 and 0.5"),
        (["nights", "--machine", "joint"], "no attribute 'joint'"),
        (["nights", "--started", "title_of_it"], "no attribute 'title_of_it'"),
        (["empty"], "there is no recording in this folder"),
        (["nights", "--scheduler", "127.0.0.1:1"], "no scheduler answers"),
    ],
)
def test_wrong_input_is_told_before_anything_is_fitted(
    arguments: list[str],
    complaint: str,
    fleet: tuple[Path, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Status 1, and a line that says what is allowed."""
    monkeypatch.setattr("friction_ocp.execution.cluster.PATIENCE", 1.0)
    (tmp_path / "empty").mkdir()
    (tmp_path / "nights").symlink_to(fleet[0].parent / "nights")
    given = [
        str(tmp_path / item) if not item.startswith("-") and index == 0 else item
        for index, item in enumerate(arguments)
    ]
    assert main(["batch", str(fleet[0]), *given, "--out", str(tmp_path / "out")]) == WRONG_INPUT
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / "out" / "result.json").exists()


def test_a_time_that_is_none_is_refused(
    fleet: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The attribute is an ISO 8601 time or absent."""
    (file,) = write_fleet(tmp_path, 1, 1)
    with h5py.File(file, "r+") as content:
        content.attrs["started"] = "last Tuesday"
    assert main(["batch", str(fleet[0]), str(file), "--out", str(tmp_path / "out")]) == WRONG_INPUT
    assert "a time as in 2026-03-01T21:30:00Z" in capsys.readouterr().err


def test_a_killed_batch_goes_on(fleet: tuple[Path, Path], tmp_path: Path) -> None:
    """After kill -9 the fits that had ended are in the store, and the next run ends as an undisturbed one."""
    out = tmp_path / "out"
    command = ["batch", str(fleet[0]), str(fleet[0].parent / "nights"), "--out", str(out), "--workers", "1"]
    with subprocess.Popen([sys.executable, "-m", "friction_ocp", *command], stderr=subprocess.DEVNULL) as process:
        patience = time.monotonic() + 60
        while count_of(out) < 3:
            assert time.monotonic() < patience and process.poll() is None
            time.sleep(0.05)
        os.kill(process.pid, signal.SIGKILL)
    ended = rows_of(out)
    assert 3 <= len(ended) < MACHINES * NIGHTS
    assert main(command) == DONE
    assert ended.items() <= rows_of(out).items()
    ours, theirs = result_of(out), result_of(fleet[1])
    assert ours["drifts"] == theirs["drifts"] and ours["series"] == theirs["series"]
