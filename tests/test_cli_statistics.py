"""The statistics from the command line: what they leave, what they say, and how they go on after an interrupt."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from servo_problem import write_servo

from friction_ocp.cli import DONE, INTERRUPTED, WRONG_INPUT, main
from friction_ocp.report.text import summary

COMMANDS = {
    "multistart": (["--starts", "2"], "waterfall", "starts reach the best optimum"),
    "profile": (["--parameter", "servo.friction.tau_c"], "profiles", "finite likelihood interval"),
    "bootstrap": (["--draws", "20"], "bootstrap", "draws scatter by"),
    "compare": ([], "comparison", "by held-out likelihood"),
}


@pytest.fixture(scope="module")
def problems(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two models of the servo, quick to fit."""
    folder = tmp_path_factory.mktemp("problems")
    found = []
    for model in ("coulomb_viscous", "load_dependent"):
        written = write_servo(folder, model, loss="squares")
        found.append(written.rename(folder / f"{model}.yaml"))
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_a_statistic_leaves_every_result(
    command: str, problems: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Result, series, report with its picture, figures; the format names the command, and the sentence its finding."""
    options, figure, sentence = COMMANDS[command]
    asked = problems if command == "compare" else problems[:1]
    out = tmp_path / "out"
    status = main([command, *map(str, asked), "--out", str(out), "--workers", "1", "--json", *options])
    printed = capsys.readouterr()
    assert status == DONE, printed.err
    text = (out / "result.json").read_text(encoding="utf-8")
    assert printed.out.rstrip("\n") == text.rstrip("\n")
    document: dict[str, Any] = json.loads(text)
    assert document["format"] == f"friction-ocp-{command}/1"
    assert document[command]
    assert {"result.h5", "report.html", "tasks"} <= {path.name for path in out.iterdir()}
    assert {f"{figure}.png", f"{figure}.svg"} <= {path.name for path in (out / "figures").iterdir()}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert sentence in page and "data:image/svg+xml;base64," in page
    assert sentence in summary(document)


def test_an_interrupted_multistart_goes_on(problems: list[Path], tmp_path: Path) -> None:
    """Ctrl-C is status 3; the ends that were on disk are not fitted again by the same command."""
    command = ["multistart", str(problems[0]), "--starts", "5", "--out", str(tmp_path), "--workers", "2"]
    with subprocess.Popen(
        [sys.executable, "-m", "friction_ocp", *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        patience = time.monotonic() + 120
        while not list((tmp_path / "tasks").glob("start-*.json")):
            assert time.monotonic() < patience and process.poll() is None
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == INTERRUPTED
    assert f"what has ended is in {tmp_path / 'tasks'}" in err
    assert not (tmp_path / "result.json").exists()
    ended = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "tasks").glob("start-*.json")}
    assert 1 <= len(ended) < 5
    assert main(command) == DONE
    after = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "tasks").glob("start-*.json")}
    assert len(after) == 5 and ended.items() <= after.items()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["profile", "--parameter", "servo.mass"], "'servo.mass' is not fitted"),
        (["bootstrap", "--draws", "2"], "2 draws are too few"),
        (["multistart", "--starts", "0"], "0 is not positive"),
        (["compare"], "1 problem given; two or more"),
        (["compare", "--nested", "a"], "'a' names one model; SPECIAL:GENERAL"),
    ],
)
def test_wrong_options_are_wrong_input(
    arguments: list[str], complaint: str, problems: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 1, and a line that says what is allowed."""
    command, *options = arguments
    try:
        status = main([command, str(problems[0]), *options, "--workers", "1", "--out", str(tmp_path / "out")])
    except SystemExit as stopped:
        status = int(stopped.code or 0)
    assert status == WRONG_INPUT
    assert complaint in capsys.readouterr().err
