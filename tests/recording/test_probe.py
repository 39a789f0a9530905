"""A file that a reader refuses is not read a second time in the process that asked."""

from __future__ import annotations

import os
import signal
import tempfile
from pathlib import Path

import pytest

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.recording.probe import probed

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
FINDINGS = [Finding("a.mdf", "this is damaged", "a sound file", "copy it again"), Finding("b", "10 \N{DEGREE SIGN}C")]


def test_what_a_reader_says_in_the_child_is_the_answer(tmp_path: Path) -> None:
    """All its findings, word by word; the library that met the damage does not meet it again."""
    home = os.getpid()

    @probed
    def read(path: str | Path) -> None:
        assert os.getpid() != home
        raise FrictionOcpError(FINDINGS)

    with pytest.raises(FrictionOcpError) as caught:
        read(tmp_path)
    assert list(caught.value.findings) == FINDINGS


def test_a_reader_that_dies_is_a_finding(tmp_path: Path) -> None:
    """With the signal that ended it."""

    @probed
    def read(path: str | Path) -> None:
        os.kill(os.getpid(), signal.SIGSEGV)

    with pytest.raises(FrictionOcpError, match="ends with signal 11"):
        read(tmp_path)


def test_a_sound_file_is_read_here(tmp_path: Path) -> None:
    """Its content is that of the process that asked."""

    @probed
    def read(path: str | Path) -> int:
        return os.getpid()

    assert read(tmp_path) == os.getpid()


def test_temporary_files_of_a_failing_library_are_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed in the midst of one, or having left a copy of the file behind."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "scratch"))
    (tmp_path / "scratch").mkdir()

    @probed
    def read(path: str | Path) -> None:
        file, _ = tempfile.mkstemp()
        os.write(file, b"half of it")
        os.kill(os.getpid(), signal.SIGKILL)

    with pytest.raises(FrictionOcpError):
        read(tmp_path)
    assert not list((tmp_path / "scratch").iterdir())
