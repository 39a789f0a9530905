"""The fuzzer finds what it looks for, and readers survive a few of its inputs."""

from __future__ import annotations

from pathlib import Path

import fuzz
import mutations
import numpy as np
import pytest
import sound_files

FEW = 12


@pytest.mark.parametrize("reader", ["map", "problem", "recording", "csv", "matlab5"])
def test_readers_survive_spoilt_files(tmp_path: Path, reader: str) -> None:
    """A few inputs of each kind are read or refused."""
    tally = fuzz.fuzz(reader, FEW, 7, tmp_path / "kept")
    assert tally.sound
    assert sum(tally.outcomes.values()) == tally.inputs == FEW
    assert not (tmp_path / "kept").exists()


def test_sound_files_are_read(tmp_path: Path) -> None:
    """What is spoilt was sound: unspoilt, every format is read."""
    for reader, suffix in sound_files.SUFFIXES.items():
        work = tmp_path / reader / "work"
        work.mkdir(parents=True)
        source = sound_files.sound_files(reader, tmp_path / reader / "sound")[0]
        path = work / f"input.{reader}{suffix}"
        path.write_bytes(source)
        fuzz.READERS[reader](path)


def test_bad_ends_are_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tracebacks, crashes, hangs and files elsewhere are counted, and the inputs kept."""

    def traceback(path: Path) -> None:
        raise ZeroDivisionError

    def crash(path: Path) -> None:
        import os

        os.abort()

    def hang(path: Path) -> None:
        import time

        time.sleep(60)

    def elsewhere(path: Path) -> None:
        (path.parents[1] / "elsewhere.txt").write_text("x")

    monkeypatch.setattr(fuzz, "LONGEST", 0.1)
    for read, expected in ((traceback, "traceback"), (crash, "crash"), (hang, "hang"), (elsewhere, "read")):
        monkeypatch.setattr(fuzz, "READERS", {"map": read})
        monkeypatch.setattr(fuzz, "PATIENCE", 2.0 if expected == "hang" else 60.0)
        tally = fuzz.fuzz("map", 2, 1, tmp_path / expected)
        assert tally.outcomes == {expected: 2}
        assert not tally.sound
        assert tally.outside == (expected == "read")
        assert (tmp_path / expected).exists() == (expected != "read")


def test_inputs_are_the_same_in_every_run() -> None:
    """An input is known by its seed and number."""
    sources = [sound_files.MAP.encode()]
    first, again = (mutations.spoilt(sources, np.random.default_rng([1, 5]), True) for _ in range(2))
    assert first == again != sources[0]
