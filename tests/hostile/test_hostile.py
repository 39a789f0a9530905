"""Hostile files: each is refused with its own message, at once, and nothing is run, written or opened elsewhere."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import asammdf  # noqa: F401  (loaded here, so that it takes none of the time that a file has)
import nptdms  # noqa: F401
import pyarrow.parquet  # noqa: F401
import pytest
import rosbags.highlevel  # noqa: F401
import scipy.io  # noqa: F401
from hostile_files import HOSTILE

from friction_ocp.cli import WRONG_INPUT, main
from friction_ocp.recording import probe

LONGEST = 10.0
"""Seconds of processor time, with all processes."""


def test_there_are_many() -> None:
    """At least forty, each with a message of its own words."""
    assert len(HOSTILE) >= 40
    assert all(len(message) > 15 for _, message in HOSTILE.values())


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command ends as wrong input does, says why, and leaves the folders as they were, also of temporary files."""
    make, message = HOSTILE[name]
    folder = tmp_path / "inside" / "work"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    if "has no end" in message:  # what ends may take as long as it is given, on a slow machine
        monkeypatch.setattr(probe, "SECONDS", 2)
    arguments = make(folder)
    before, began = sorted(tmp_path.rglob("*")), sum(os.times()[:4])
    status = main(arguments)
    said = capfd.readouterr()
    assert status == WRONG_INPUT
    assert message in said.err + said.out
    assert "Traceback" not in said.err + said.out
    assert sorted(tmp_path.rglob("*")) == before
    assert sum(os.times()[:4]) - began < LONGEST
