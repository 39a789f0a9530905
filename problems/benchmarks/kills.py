"""Kill -9 at random moments: what a command that was killed and begun again ends with.

python problems/benchmarks/kills.py [--kills N] [--seed N]

`diagnose` and `batch` are run undisturbed, then killed at moments drawn evenly over their duration, half of the kills
each; the same command is then run to its end in the same folder. Its result must be that of the undisturbed run, and
no file may be left half written: every JSON, HDF5 and SQLite file of the folder is opened, before the second run and
after it. The exit status is 1 otherwise.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "diagnosis"))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "fleet"))

import diagnosis_cases
import simulated_fleet
from checks import Check, print_rows, tell_status

KILLS, SEED = 50, 20261102
MACHINES, NIGHTS = 3, 8
TIMES = frozenset({"seconds", "created", "provenance"})
"""What differs between equal runs."""


@dataclass(frozen=True)
class Kill:
    """One kill and what came of it."""

    command: str
    after: float
    """Seconds."""
    share: float
    """Of the duration of the undisturbed run."""
    kept: int
    """Tasks that had ended and were on disk."""
    corrupt: tuple[str, ...]
    """Files that cannot be opened."""
    same: bool
    """Whether the run that followed reached the undisturbed result."""


def run_kills(kills: int, seed: int, told: Callable[[Kill], None] = lambda kill: None) -> list[Kill]:
    """Kill both commands, in turn."""
    rng = np.random.default_rng(seed)
    found: list[Kill] = []
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        commands = {"diagnose": _diagnose(folder), "batch": _batch(folder)}
        undisturbed = {name: _undisturbed(command, folder / name) for name, command in commands.items()}
        for number in range(kills):
            name = ("diagnose", "batch")[number % 2]
            seconds, result = undisturbed[name]
            share = float(rng.uniform())
            found.append(_killed(name, commands[name], folder / f"{name}-{number}", share, seconds, result))
            told(found[-1])
            shutil.rmtree(folder / f"{name}-{number}")
    return found


def _diagnose(folder: Path) -> list[str]:
    (folder / "drive").mkdir()
    drive = diagnosis_cases.axis(law="stribeck", tau_s=0.15, omega_s=6.0)
    return ["diagnose", str(diagnosis_cases.write_case(folder / "drive", drive)), "--jobs", "1"]


def _batch(folder: Path) -> list[str]:
    change = simulated_fleet.Change(1, 0.3)
    files = simulated_fleet.write_fleet(folder / "nights", MACHINES, NIGHTS, (change,))
    problem = simulated_fleet.write_axis(folder / "axis.yaml", files[0])
    return ["batch", str(problem), str(folder / "nights"), "--jobs", "1"]


def _start(command: Sequence[str], out: Path) -> subprocess.Popen[bytes]:
    whole = [sys.executable, "-m", "friction_ocp", *command, "--out", str(out)]
    return subprocess.Popen(whole, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def _undisturbed(command: Sequence[str], out: Path) -> tuple[float, Any]:
    """Return duration and result of the second of two runs, for which compiled models are there already."""
    for _ in range(2):
        shutil.rmtree(out, ignore_errors=True)
        began = time.perf_counter()
        assert _start(command, out).wait() == 0
        seconds = time.perf_counter() - began
    return seconds, _result(out)


def _killed(name: str, command: Sequence[str], out: Path, share: float, seconds: float, expected: Any) -> Kill:
    process = _start(command, out)
    time.sleep(share * seconds)
    with contextlib.suppress(ProcessLookupError):  # it may have ended already
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    corrupt, kept = list(_corrupt(out)), _kept(out)
    ended = _start(command, out).wait()
    corrupt += _corrupt(out)
    same = ended == 0 and _result(out) == expected
    return Kill(name, share * seconds, share, kept, tuple(corrupt), same)


def _result(out: Path) -> Any:
    return _without_times(json.loads((out / "result.json").read_text(encoding="utf-8")))


def _without_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_times(item) for key, item in value.items() if key not in TIMES}
    return [_without_times(item) for item in value] if isinstance(value, list) else value


def _kept(out: Path) -> int:
    """Return how many tasks are on disk."""
    store = out / "fits.sqlite"
    if not store.exists():
        return len(list((out / "tasks").glob("*.json")))
    with contextlib.closing(sqlite3.connect(store)) as connection:
        tables = {row[0] for row in connection.execute("SELECT name FROM sqlite_master")}
        return connection.execute("SELECT count(*) FROM fits").fetchone()[0] if "fits" in tables else 0


def _corrupt(out: Path) -> Iterator[str]:
    """Yield files that cannot be opened as what their names say; temporary ones are named so and belong to nobody."""
    for path in sorted(out.rglob("*")):
        if path.name.startswith(".") or not path.is_file():
            continue
        try:
            _open(path)
        except (OSError, ValueError, sqlite3.Error) as error:
            yield f"{path.relative_to(out)}: {error}"


def _open(path: Path) -> None:
    match path.suffix:
        case ".json":
            json.loads(path.read_text(encoding="utf-8"))
        case ".h5":
            with h5py.File(path) as file:
                file.visititems(lambda _, node: node[()] is None if isinstance(node, h5py.Dataset) else None)
        case ".sqlite":
            with contextlib.closing(sqlite3.connect(path)) as connection:
                if (found := connection.execute("PRAGMA integrity_check").fetchone()[0]) != "ok":
                    raise ValueError(found)
        case ".html" | ".svg":
            if not path.read_text(encoding="utf-8").rstrip().endswith(("</html>", "</svg>")):
                raise ValueError("cut off")


def table(kills: Sequence[Kill]) -> list[tuple[str, ...]]:
    """Return one row a command."""
    rows: list[tuple[str, ...]] = []
    for name in dict.fromkeys(kill.command for kill in kills):
        own = [kill for kill in kills if kill.command == name]
        rows.append(
            (
                name,
                str(len(own)),
                f"{min(kill.share for kill in own):.0%} to {max(kill.share for kill in own):.0%}",
                f"{min(kill.kept for kill in own)} to {max(kill.kept for kill in own)}",
                str(sum(len(kill.corrupt) for kill in own)),
                str(sum(kill.same for kill in own)),
            )
        )
    return rows


HEADER = ("command", "kills", "at, of its duration", "tasks on disk", "corrupt files", "same result")


def check(line: str, kills: int = KILLS, seed: int = SEED) -> Check:
    """Measure the line of the kills."""
    found = run_kills(kills, seed)
    rows = [", ".join(f"{head} {cell}" for head, cell in zip(HEADER, row, strict=True)) for row in table(found)]
    return Check(line, "\n".join(rows), all(kill.same and not kill.corrupt for kill in found))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print every kill and the table; 1 where a resume ended otherwise or a file was corrupt."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=KILLS)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args(arguments)

    def tell(kill: Kill) -> None:
        ended = "same result" if kill.same else "ANOTHER RESULT"
        told = f"{kill.command} killed after {kill.after:.1f} s, {kill.kept} tasks on disk: {ended}"
        print("; ".join([told, *kill.corrupt]), flush=True)

    found = run_kills(options.kills, options.seed, tell)
    print()
    print_rows(HEADER, table(found))
    held = all(kill.same and not kill.corrupt for kill in found)
    return tell_status([Check("every resume reaches the undisturbed result", f"{len(found)} kills", held)])


if __name__ == "__main__":
    raise SystemExit(main())
