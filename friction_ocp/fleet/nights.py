"""What is to be fitted: recordings, the machine that each is of, and when it was made."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.recording.hdf5 import read_recording
from friction_ocp.recording.recording import Recording

MACHINE, STARTED = "machine", "started"
"""Attributes of a recording that are looked for where no others are named."""


@dataclass(frozen=True)
class Night:
    """One recording of one machine."""

    path: Path
    machine: str
    started: str
    """ISO 8601, or empty."""
    sha256: str
    set: Mapping[str, float]


def find_recordings(places: Iterable[Path]) -> list[Path]:
    """Return files as given, and every .h5 file below the folders among them, each once."""
    found: list[Path] = []
    findings: list[Finding] = []
    for place in places:
        inside = sorted(place.rglob("*.h5")) if place.is_dir() else [place]
        if not inside:
            findings.append(Finding(str(place), "there is no recording in this folder", "files that end in .h5"))
        found += inside
    if findings:
        raise FrictionOcpError(findings)
    return list({path.resolve(): path for path in found}.values())


def nights_of(problem: Problem, paths: Sequence[Path], machine: str = "", started: str = "") -> list[Night]:
    """Read what the recordings say about themselves; raises everything that is wrong with any of them.

    The machine is named by an attribute of the recordings, else by their folder; the time by an attribute, else the
    order of their names counts.
    """
    read: list[tuple[Path, str, Mapping[str, str]]] = []
    findings: list[Finding] = []
    for path in paths:
        try:
            recording = read_recording(path)
        except FrictionOcpError as error:
            findings += error.findings
        else:
            read.append((path, recording.sha256, recording.attributes))
            findings += _wrong_time(recording, started or STARTED)
    attributes = [(path, stated) for path, _, stated in read]
    findings += _missing(attributes, machine or MACHINE, required=bool(machine))
    findings += _missing(attributes, started or STARTED, required=bool(started))
    if findings:
        raise FrictionOcpError(findings)
    machines = _machines(read, machine or MACHINE)
    found = [
        Night(path, name, stated.get(started or STARTED, ""), sha256, numbers_of(problem, path))
        for (path, sha256, stated), name in zip(read, machines, strict=True)
    ]
    return list({night.sha256: night for night in found}.values())


def _machines(read: Sequence[tuple[Path, str, Mapping[str, str]]], attribute: str) -> list[str]:
    if all(attribute in stated for _, _, stated in read):
        return [stated[attribute] for _, _, stated in read]
    folders = [path.resolve().parent for path, _, _ in read]
    names = Counter(folder.name for folder in set(folders))
    return [folder.name if names[folder.name] == 1 else folder.as_posix() for folder in folders]


def _missing(read: Sequence[tuple[Path, Mapping[str, str]]], attribute: str, required: bool) -> list[Finding]:
    without = [path for path, stated in read if not stated.get(attribute, "").strip()]
    if not without or (len(without) == len(read) and not required):
        return []
    what = f"the recording has no attribute '{attribute}'"
    return [Finding(str(path), what, "the same attribute in all recordings", "add it to the file") for path in without]


def _wrong_time(recording: Recording, attribute: str) -> list[Finding]:
    text = recording.attributes.get(attribute, "").strip()
    try:
        days(text or "2000-01-01")
    except ValueError:
        what = f"attribute '{attribute}' is '{text}'"
        return [Finding(str(recording.path), what, "a time as in 2026-03-01T21:30:00Z")]
    return []


def days(text: str) -> float:
    """Return days since 1970 of an ISO 8601 time, in UTC where it names no zone; NaN of nothing."""
    if not text.strip():
        return math.nan
    time = datetime.fromisoformat(text.strip())
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp() / 86400.0


def numbers_of(problem: Problem, path: Path) -> Mapping[str, float]:
    """Return what a problem states as known in a recording: what stands beside it, else what stands beside all."""
    for use in problem.train + problem.validation:
        if use.recording.path is not None and use.recording.path.resolve() == path.resolve():
            return dict(use.set)
    stated = [dict(use.set) for use in problem.train]
    if any(other != stated[0] for other in stated[1:]):
        where = f"{problem.path or problem.title}: recordings.train"
        what = f"the numbers in `set` differ between recordings, and {path} is none of them"
        raise FrictionOcpError(Finding(where, what, "one `set` for all, or every recording listed with its own"))
    return stated[0] if stated else {}
