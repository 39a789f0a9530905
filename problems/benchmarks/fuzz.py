"""Every reader against spoilt files: no traceback, no hang over 10 s, no crash, no file outside the output folder.

python problems/benchmarks/fuzz.py [READER ...] [--inputs 20000] [--seed 1] [--keep FOLDER]

A reader runs in a process of its own with a limit on its memory, input by input. What it says is told by category;
inputs that it did not survive are kept in FOLDER. Seconds are of processor time, but for the last column. The exit
status is 1 where a reader did not survive an input.
"""

from __future__ import annotations

import argparse
import faulthandler
import gc
import logging
import multiprocessing
import os
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from checks import print_rows
from mutations import spoilt
from sound_files import MAPS, SUFFIXES, TEXT, sound_files

LONGEST = 10.0
"""Seconds of processor time that one input may take, with the processes that its reader starts."""
PATIENCE = 60.0
"""How many times longer a process is waited for: it may share a machine with many others, at the lowest priority."""
MEMORY = 6 * 2**30
Outcome = Literal["read", "refused", "traceback", "hang", "crash"]


@dataclass
class Tally:
    """What became of the inputs of one reader."""

    reader: str
    inputs: int = 0
    outcomes: dict[str, int] = field(default_factory=dict[str, int])
    slowest: float = 0.0
    outside: int = 0
    seconds: float = 0.0
    kept: list[str] = field(default_factory=list[str])

    @property
    def sound(self) -> bool:
        """Whether nothing happened that must not."""
        bad = sum(self.outcomes.get(name, 0) for name in ("traceback", "hang", "crash"))
        return bad == 0 and self.outside == 0 and self.slowest <= LONGEST


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a row a reader; 1 where one did not survive an input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("readers", nargs="*", metavar="READER", help=", ".join(SUFFIXES))
    parser.add_argument("--inputs", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("results/fuzz"))
    options = parser.parse_args(arguments)
    if unknown := set(options.readers) - SUFFIXES.keys():
        parser.error(f"unknown reader {', '.join(unknown)}; available: {', '.join(SUFFIXES)}")
    tallies = [fuzz(name, options.inputs, options.seed, options.keep) for name in options.readers or SUFFIXES]
    print_rows(HEADER, [row(tally) for tally in tallies])
    return int(not all(tally.sound for tally in tallies))


HEADER = ("reader", "inputs", "read", "refused", "tracebacks", "hangs", "crashes", "outside", "slowest s", "seconds")


def row(tally: Tally) -> tuple[str, ...]:
    """Return a row of the table."""
    counts = (tally.outcomes.get(name, 0) for name in ("read", "refused", "traceback", "hang", "crash"))
    return (
        tally.reader,
        *(str(count) for count in (tally.inputs, *counts, tally.outside)),
        f"{tally.slowest:.2f}",
        f"{tally.seconds:.0f}",
    )


def fuzz(reader: str, inputs: int, seed: int, keep: Path) -> Tally:
    """Give spoilt files to one reader, each in turn."""
    tally, began = Tally(reader), time.perf_counter()
    with tempfile.TemporaryDirectory() as place:
        sandbox = Path(place)
        sources = sound_files(reader, sandbox / "sound")
        for name in ("work", "temporary"):
            (sandbox / name).mkdir()
        before = _listing(sandbox)
        while tally.inputs < inputs:
            _shift(tally, sources, sandbox, seed, inputs, keep)
        tally.outside = len(_listing(sandbox) - before)
    tally.seconds = time.perf_counter() - began
    print("  ".join(row(tally)), file=sys.stderr, flush=True)
    return tally


def _listing(sandbox: Path) -> set[str]:
    """Return all files of the sandbox but those of the folder that readers may use, and of the working folder.

    Temporary files are among them: what a reader leaves there stays.
    """
    inside = {str(path) for path in sandbox.rglob("*") if "work" not in path.relative_to(sandbox).parts[:1]}
    return inside | {str(path) for path in Path.cwd().iterdir()}


def _shift(tally: Tally, sources: Sequence[bytes], sandbox: Path, seed: int, inputs: int, keep: Path) -> None:
    """Let a process read inputs until all are done or one of them ends it."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there, tally.reader, sources, sandbox, seed, tally.inputs, inputs))
    process.start()
    there.close()
    first = True
    while tally.inputs < inputs:
        answer: tuple[Outcome, float, str] = ("hang", LONGEST, "")
        try:
            if here.poll(PATIENCE * LONGEST * (4.0 if first else 1.0)):
                answer = here.recv()
        except EOFError:
            answer = ("crash", 0.0, "")
        first = False
        _count(tally, answer, sources, seed, keep)
        if answer[0] in ("hang", "crash"):
            break
    process.kill()
    process.join()


def _count(tally: Tally, answer: tuple[Outcome, float, str], sources: Sequence[bytes], seed: int, keep: Path) -> None:
    outcome, seconds, story = answer
    tally.outcomes[outcome] = tally.outcomes.get(outcome, 0) + 1
    tally.slowest = max(tally.slowest, seconds)
    if outcome in ("traceback", "hang", "crash") or seconds > LONGEST:
        keep.mkdir(parents=True, exist_ok=True)
        name = f"{tally.reader}-{tally.inputs}-{outcome}"
        (keep / f"{name}{SUFFIXES[tally.reader]}").write_bytes(_input(tally.reader, sources, seed, tally.inputs))
        (keep / f"{name}.txt").write_text(story, encoding="utf-8")
        tally.kept.append(name)
    tally.inputs += 1


def _input(reader: str, sources: Sequence[bytes], seed: int, number: int) -> bytes:
    return spoilt(sources, np.random.default_rng([seed, number]), reader in TEXT)


def _work(pipe: Any, reader: str, sources: Sequence[bytes], sandbox: Path, seed: int, first: int, stop: int) -> None:
    """Read inputs one after another and tell what became of each."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.chdir(sandbox / "work")
    tempfile.tempdir = str(sandbox / "temporary")
    read = READERS[reader]
    faulthandler.disable()
    logging.disable()
    gc.collect()
    gc.freeze()
    path = sandbox / "work" / f"input.{reader}{SUFFIXES[reader]}"
    for number in range(first, stop):
        path.write_bytes(_input(reader, sources, seed, number))
        pipe.send(_read(read, path))
    pipe.close()


def _read(read: Callable[[Path], None], path: Path) -> tuple[Outcome, float, str]:
    from friction_ocp.errors import FrictionOcpError

    began, said = sum(os.times()[:4]), StringIO()
    outcome: Outcome = "read"
    story = ""
    try:
        with redirect_stderr(said), redirect_stdout(said):
            read(path)
    except FrictionOcpError as error:
        outcome = "refused" if error.findings else "traceback"
    except (Exception, SystemExit):
        outcome, story = "traceback", traceback.format_exc()
    if "Traceback" in said.getvalue():
        outcome, story = "traceback", said.getvalue()
    return outcome, sum(os.times()[:4]) - began, story


def _problem(path: Path) -> None:
    from friction_ocp.problem_file.load import load_problem

    load_problem(path)


def _map(path: Path) -> None:
    from friction_ocp.recording.import_map import load_import_map

    load_import_map(path)


def _recording(path: Path) -> None:
    from friction_ocp.recording.hdf5 import read_recording

    read_recording(path)


def _static(path: Path) -> None:
    from friction_ocp.recording.hdf5 import read_static_points

    read_static_points(path)


def _foreign(path: Path) -> None:
    """List a file, then import the series that a sound file has."""
    from friction_ocp.recording.import_recording import import_recording, inspect_file

    inspect_file(path)
    map_path = path.with_name("map.yaml")
    map_path.write_text(MAPS[path.with_suffix("").suffix.lstrip(".")], encoding="utf-8")
    import_recording(path, map_path)


READERS: Mapping[str, Callable[[Path], None]] = {
    name: {"problem": _problem, "map": _map, "recording": _recording, "static": _static}.get(name, _foreign)
    for name in SUFFIXES
}


if __name__ == "__main__":
    raise SystemExit(main())
