"""The command line: exit statuses, what goes to which stream, and what is left on disk."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
import yaml
from servo_problem import servo_document, write_problem, write_servo

from friction_ocp.cli import DONE, INTERRUPTED, NOT_CONVERGED, WRONG_INPUT, main
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.progress import Report
from friction_ocp.progress_bar import progress_bar
from friction_ocp.recording.hdf5 import read_recording

SAME_SIMULATION = 1e-9
"""Relative: the fitted values are written with all their digits."""


@dataclass(frozen=True)
class Ran:
    """What a command gave back."""

    status: int
    out: str
    err: str
    folder: Path

    @property
    def result(self) -> dict[str, Any]:
        return strict_json((self.folder / "result.json").read_text(encoding="utf-8"))


def strict_json(text: str) -> Any:
    """Parse JSON; NaN and Infinity are none."""

    def refuse(constant: str) -> NoReturn:
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(text, parse_constant=refuse)


def run(*arguments: str | Path, folder: Path = Path()) -> Ran:
    """Run a command in this process."""
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            status = main([str(argument) for argument in arguments])
        except SystemExit as stopped:
            status = int(stopped.code or 0)
    return Ran(status, out.getvalue(), err.getvalue(), folder)


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    """The servo identified with --json."""
    folder = tmp_path_factory.mktemp("identified")
    return run("identify", write_servo(folder), "--json", "--out", folder / "out", folder=folder / "out")


def test_identify_leaves_every_result(identified: Ran) -> None:
    """A fit that converged exits with 0 and leaves all its files, none of them temporary."""
    assert identified.status == DONE
    files = {path.relative_to(identified.folder).as_posix() for path in identified.folder.rglob("*")}
    assert {"result.json", "result.h5", "report.html", "fitted.yaml"} <= files
    assert {"figures/parameters.png", "figures/traces-sin_sin-kp100.svg", "figures/friction-servo.png"} <= files
    assert not [name for name in files if name.endswith(".tmp")]


def test_identify_predicts_what_compensation_buys(identified: Ran) -> None:
    """A drive that follows a reference: its tracking error, measured and simulated, in result and page."""
    found = identified.result["friction_compensation"]
    assert found["shaft"] == "servo"
    (tracking,) = found["tracking_rms"].values()
    assert tracking["before"] == pytest.approx(tracking["measured"], rel=0.2)
    assert tracking["gain"] == pytest.approx(1.0 - tracking["after"] / tracking["before"])
    page = (identified.folder / "report.html").read_text(encoding="utf-8")
    assert "What friction compensation buys" in page
    assert "off the tracking error" in page


def test_json_is_the_result_and_nothing_else(identified: Ran) -> None:
    """--json prints result.json, letter by letter."""
    assert identified.out.rstrip("\n") == (identified.folder / "result.json").read_text(encoding="utf-8").rstrip("\n")
    assert strict_json(identified.out)["status"] == "converged"


def test_progress_off_a_terminal_is_plain_lines(identified: Ran) -> None:
    """Standard error gets whole lines with phase, iteration, objective and time left, and no control characters."""
    lines = [line for line in identified.err.splitlines() if "iteration" in line]
    assert lines
    assert all("objective" in line and "s left" in line for line in lines)
    assert identified.err.replace("\n", "").isprintable()


def test_simulating_the_answer_repeats_its_errors(identified: Ran, tmp_path: Path) -> None:
    """`simulate fitted.yaml` has the errors that identify reported, on training and on validation."""
    simulated = run("simulate", identified.folder / "fitted.yaml", "--out", tmp_path, folder=tmp_path)
    assert simulated.status == DONE
    for part in ("train", "validation"):
        before, after = (ran.result["fit"][part]["position"] for ran in (identified, simulated))
        assert after["mae"] == pytest.approx(before["mae"], rel=SAME_SIMULATION)
        assert after["rms"] == pytest.approx(before["rms"], rel=SAME_SIMULATION)
    assert "mean absolute" in simulated.out


def test_the_folder_is_named_after_problem_and_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without --out the results are in results/<problem stem>-<command>."""
    monkeypatch.chdir(tmp_path)
    assert run("simulate", write_servo(tmp_path)).status == DONE
    assert (tmp_path / "results" / "servo-simulate" / "report.html").exists()


def test_an_iteration_limit_is_status_2_with_a_warning_first(tmp_path: Path) -> None:
    """A fit that did not converge says so before anything else, here and on standard error, and has no intervals."""
    ran = run(
        "identify",
        write_servo(tmp_path, loss="squares", max_iterations=1),
        "--out",
        tmp_path / "out",
        folder=tmp_path / "out",
    )
    assert ran.status == NOT_CONVERGED
    assert ran.result["status"] == "not_converged"
    assert "did not converge" in ran.result["warnings"][0]
    assert all(item["std_error"] is None and item["interval95"] is None for item in ran.result["parameters"].values())
    assert all(value is None for curve in ran.result["friction_curves"] for value in curve["lower"])
    assert not re.search(r"^servo\.\S+ .* ok$", ran.out, re.MULTILINE)
    assert ran.err.splitlines()[-1].startswith("identify: iteration limit")


def spoilt(folder: Path) -> Path:
    """Write a problem with three faults."""
    document = servo_document()
    document["drive"]["shafts"][0]["friction"]["law"] = "colomb"
    document["drive"]["shafts"][0]["colour"] = "red"
    document["recordings"]["validation"] = ["nowhere.h5"]
    return write_problem(folder / "spoilt.yaml", document)


@pytest.mark.parametrize("command", ["identify", "simulate"])
def test_bad_input_is_status_1_and_writes_nothing(command: str, tmp_path: Path) -> None:
    """Every fault has its own line on standard error; no output folder is made."""
    ran = run(command, spoilt(tmp_path), "--json", "--out", tmp_path / "out")
    assert ran.status == WRONG_INPUT
    assert ran.out == ""
    lines = ran.err.splitlines()
    for fault in ("'colomb'", "'colour'", "nowhere.h5"):
        assert sum(fault in line for line in lines) == 1
    assert all(line.startswith(str(tmp_path / "spoilt.yaml")) for line in lines)
    assert not (tmp_path / "out").exists()


def test_check_lists_findings(tmp_path: Path) -> None:
    """`check` exits with 1 and lists what is wrong; as JSON it lists the same."""
    plain, structured = (run("check", spoilt(tmp_path), *options) for options in ([], ["--json"]))
    assert plain.status == structured.status == WRONG_INPUT
    findings = strict_json(structured.out)
    assert len(findings) == len(plain.out.splitlines()) == 3
    assert {finding["severity"] for finding in findings} == {"error"}
    assert all(
        line.startswith(finding["where"]) for line, finding in zip(plain.out.splitlines(), findings, strict=True)
    )


def test_check_of_a_sound_problem(tmp_path: Path) -> None:
    """Nothing found is status 0, and what was read is said."""
    ran = run("check", write_servo(tmp_path))
    assert ran.status == DONE
    what, *parts = ran.out.strip().split("; ")
    assert what.endswith("nothing is wrong with it")
    assert parts[0] == "read: shafts: servo (coulomb_viscous), pendulum (none)" and parts[2] == "out: pendulum.theta"
    assert parts[3].startswith("fitted: ") and "servo.friction.tau_c" in parts[3]
    assert parts[4].endswith("to train") and parts[5].endswith("to validate")


@pytest.mark.parametrize("command", ["check", "identify", "simulate"])
def test_a_missing_problem_is_named(command: str, tmp_path: Path) -> None:
    """A path without a file is wrong input."""
    ran = run(command, tmp_path / "none.yaml")
    assert ran.status == WRONG_INPUT
    assert "none.yaml" in ran.out + ran.err


@pytest.mark.parametrize("arguments", [[], ["identfy", "x.yaml"], ["identify"], ["identify", "x.yaml", "--speed"]])
def test_a_wrong_command_is_wrong_input(arguments: list[str]) -> None:
    """Status 2 is kept for solvers that did not converge."""
    ran = run(*arguments)
    assert ran.status == WRONG_INPUT
    assert ran.err.startswith("usage: friction-ocp")


def test_an_output_folder_that_is_a_file_is_refused_first(tmp_path: Path) -> None:
    """No fit is made whose result could not be written."""
    blocked = tmp_path / "blocked"
    blocked.touch()
    ran = run("identify", write_servo(tmp_path), "--out", blocked / "out")
    assert ran.status == WRONG_INPUT
    assert ran.err == f"{blocked / 'out'}: {blocked} is a file; a folder, made where there is none\n"


def test_interrupt_leaves_the_last_iterate(tmp_path: Path) -> None:
    """Ctrl-C during a fit is status 3; what it had reached is on disk and called not converged."""
    path, folder = write_servo(tmp_path, "stribeck_load"), tmp_path / "out"
    command = [sys.executable, "-m", "friction_ocp", "identify", str(path), "--out", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert any("iteration 1" in line for line in process.stderr)
        os.kill(process.pid, signal.SIGINT)
        out, _ = process.communicate(timeout=60)
    result = Ran(process.returncode, out, "", folder).result
    assert process.returncode == INTERRUPTED
    assert result["status"] == "not_converged"
    assert "interrupted" in result["message"]
    assert "interrupted" in result["warnings"][0]
    assert (folder / "report.html").exists()


def test_interrupt_before_the_fit_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while the problem is read is status 3 and leaves no folder."""

    def interrupted(path: Path) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr("friction_ocp.problem_file.load.load_problem", interrupted)
    ran = run("identify", write_servo(tmp_path), "--out", tmp_path / "out")
    assert ran.status == INTERRUPTED
    assert ran.err == "identify: interrupted\n"
    assert not (tmp_path / "out").exists()


def test_the_module_is_the_command(tmp_path: Path) -> None:
    """`python -m friction_ocp` does what `friction-ocp` does."""
    command = [sys.executable, "-m", "friction_ocp", "check", str(spoilt(tmp_path))]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    ran = run("check", tmp_path / "spoilt.yaml")
    assert (process.returncode, process.stdout) == (ran.status, ran.out)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A CSV log with its map beside it."""
    time = 0.01 * np.arange(50)
    rows = [f"{t:.3f},{np.degrees(np.sin(t)):.6f},{1000 * np.cos(t):.3f}" for t in time]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,angle,current", *rows, ""]), encoding="utf-8")
    channels = {"position": {"column": "angle", "unit": "deg"}, "current": {"column": "current", "unit": "mA"}}
    content = {"format": "friction-ocp-map/1", "time": {"column": "time", "unit": "s"}, "channels": channels}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def test_import_writes_a_recording_in_si_units(log: Path) -> None:
    """A log and a map become a recording."""
    out = log.with_name("log.h5")
    assert run("import", log, "--map", log.with_name("map.yaml"), "--out", out).status == DONE
    channels = read_recording(out).channels
    assert {name: channel.unit for name, channel in channels.items()} == {"position": "rad", "current": "A"}
    assert channels["current"].values[0] == pytest.approx(1.0)


def test_import_does_not_write_over_what_it_reads(log: Path) -> None:
    """The log and the map stay; a folder is no file to write to."""
    before = log.read_bytes()
    for out in (log, log.with_name("map.yaml"), log.parent):
        done = run("import", log, "--map", log.with_name("map.yaml"), "--out", out)
        assert done.status == WRONG_INPUT and str(out) in done.err
    assert log.read_bytes() == before


def test_what_the_system_refuses_is_told(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk, or a place where nothing can be written, is no traceback."""

    def full(*_: object) -> NoReturn:
        raise OSError(28, "No space left on device", "a.h5")

    monkeypatch.setattr("friction_ocp.recording.hdf5.write_recording", full)
    done = run("import", log, "--map", log.with_name("map.yaml"), "--out", log.with_name("a.h5"))
    assert done.status == WRONG_INPUT and "a.h5: No space left on device" in done.err


def test_a_reader_that_has_enough_is_no_error(log: Path) -> None:
    """`friction-ocp ... | head` ends without a word."""
    command = [sys.executable, "-m", "friction_ocp", "import", str(log), "--inspect"]
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (DONE, "")


def test_inspecting_a_log_lists_its_columns_and_writes_nothing(log: Path) -> None:
    """--inspect needs neither map nor output."""
    before = sorted(log.parent.iterdir())
    ran = run("import", log, "--inspect")
    assert ran.status == DONE
    rows = [line.split() for line in ran.out.splitlines()[3:]]
    assert [row[1:3] for row in rows] == [["time", "50"], ["angle", "50"], ["current", "50"]]
    assert sorted(log.parent.iterdir()) == before


def test_import_says_what_is_missing(log: Path) -> None:
    """Without map and output both are asked for at once."""
    ran = run("import", log)
    assert ran.status == WRONG_INPUT
    assert [line.split(";")[0] for line in ran.err.splitlines()] == [
        "import: --map is missing",
        "import: --out is missing",
    ]


@pytest.mark.parametrize("name", ["log.csv", "map.yaml"])
def test_import_writes_over_nothing_that_it_reads(log: Path, name: str) -> None:
    """Log and map are left as they are, however --out spells them."""
    kept, before = log.with_name(name), log.with_name(name).read_bytes()
    ran = run("import", log, "--map", log.with_name("map.yaml"), "--out", log.parent / "." / name)
    assert ran.status == WRONG_INPUT
    assert ran.err.startswith(f"{kept}: --out is a file that this command reads")
    assert kept.read_bytes() == before


class _Terminal(StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_on_a_terminal_is_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    """A live bar names phase, iteration and objective, and is gone afterwards."""
    terminal = _Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with progress_bar() as progress:
        progress(Report("stage 1 of 2", 1, 4, 7, 12.5, Point(np.zeros(1), ())))
    shown = terminal.getvalue()
    assert "stage 1 of 2" in shown and "12.5" in shown
    assert shown.endswith("\x1b[2K")


def test_the_version_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """`--version` names the toolkit and the number that results carry."""
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == DONE
    assert capsys.readouterr().out.strip() == f"friction-ocp {version('friction-ocp')}"


def test_a_folder_is_no_problem_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a folder is taken for is said."""
    assert main(["check", str(tmp_path)]) == WRONG_INPUT
    assert "this is a folder; a problem file, such as axis.yaml" in "".join(capsys.readouterr())
