"""From a problem file to a problem: read, refuse with everything that is wrong, or build."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import Any, TypeVar, cast

from friction_ocp.drive.parts import Drive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.pieces import Span, hull, piece_of
from friction_ocp.estimation.problem import Problem, RecordingUse, StaticUse
from friction_ocp.problem_file.check import check, check_file, check_rest
from friction_ocp.problem_file.document import Document, read_document
from friction_ocp.problem_file.salvage import read_section, salvage
from friction_ocp.problem_file.schema import ProblemSection
from friction_ocp.recording.hdf5 import read_either
from friction_ocp.recording.recording import Recording
from friction_ocp.recording.static_points import StaticPoints

Use = RecordingUse | StaticUse
_NO_ENDS = "correct `from` and `to`, or leave them out"
AnyUse = TypeVar("AnyUse", RecordingUse, StaticUse)


@dataclass(frozen=True)
class _Entry:
    """A recording as the file lists it."""

    kind: str
    index: int
    file: str
    set: Mapping[str, float]
    span: Span

    @property
    def place(self) -> str:
        return f"recordings.{self.kind}[{self.index}]"


def load_problem(path: str | Path, text: str | None = None) -> Problem:
    """Read a problem file and its recordings; with `text` as if that stood in the file.

    Raises FrictionOcpError with everything that is wrong with the file, and, once anything is, with the recordings
    too. What only a fit needs, and what is merely doubtful, is left to `check`.
    """
    path = Path(path)
    document = read_document(path, text)
    section, faults = read_section(document.content)
    uses, findings = _read_recordings(document)
    findings = [*(fault.finding(str(path)) for fault in faults), *findings]
    rest = section or salvage(document.content, faults)
    if rest is None:
        raise FrictionOcpError(findings)
    problem = _build(rest, uses, document)
    if findings:
        raise FrictionOcpError([*findings, *check_rest(problem, complete=section is not None)])
    if check_file(problem):
        raise FrictionOcpError([finding for finding in check(problem) if finding.severity == "error"])
    return problem


def _build(section: ProblemSection, uses: list[tuple[_Entry, Use]], document: Document) -> Problem:
    drive = section.build_drive()
    uses = _in_pieces(uses, drive, document.path)
    return Problem(
        title=section.title or document.path.stem,
        drive=drive,
        train=_of_kind(uses, "train", RecordingUse),
        validation=_of_kind(uses, "validation", RecordingUse),
        static=_of_kind(uses, "train", StaticUse),
        static_validation=_of_kind(uses, "validation", StaticUse),
        estimation=section.estimation.build(),
        constraints=tuple(section.constraints),
        question=document.head,
        path=document.path,
        text=document.text,
        diagnosis=section.diagnosis.model_dump(exclude_unset=True),
        limits=section.limits.model_dump(exclude_unset=True),
    )


def _in_pieces(uses: list[tuple[_Entry, Use]], drive: Drive, problem: Path) -> list[tuple[_Entry, Use]]:
    """Cut recordings to what the file uses of them."""
    spans = dict[Path, list[Span]]()
    for entry, _ in uses:
        spans.setdefault(recording_path(problem, entry.file), []).append(entry.span)
    cut = list[tuple[_Entry, Use]]()
    for entry, use in uses:
        pieces = spans[recording_path(problem, entry.file)]
        if isinstance(use, RecordingUse) and not all(span.is_all for span in pieces):
            use = piece_of(use, drive, entry.span, hull(pieces))
        cut.append((entry, use))
    return cut


def _of_kind(uses: list[tuple[_Entry, Use]], kind: str, form: type[AnyUse]) -> tuple[AnyUse, ...]:
    return tuple(use for entry, use in uses if entry.kind == kind and isinstance(use, form))


def _read_recordings(document: Document) -> tuple[list[tuple[_Entry, Use]], list[Finding]]:
    """Read every recording and all static points that the file lists, each file once."""
    findings: list[Finding] = []
    uses: list[tuple[_Entry, Use]] = []
    known: dict[Path, Recording | StaticPoints | FrictionOcpError] = {}
    for entry in _entries(document.content):
        path = recording_path(document.path, entry.file)
        if path not in known:
            known[path] = _read(path)
        recording = known[path]
        place = f"{document.path}: {entry.place}"
        if isinstance(recording, Recording):
            findings += _outside(recording, entry, place)
            uses.append((entry, RecordingUse(recording, entry.set, entry.place)))
        elif isinstance(recording, StaticPoints):
            if not entry.span.is_all:
                findings.append(Finding(f"{place}: {path}", "static points have no time", remedy=_NO_ENDS))
            uses.append((entry, StaticUse(recording, entry.set, entry.place)))
        else:
            findings += [
                Finding(f"{place}: {item.where}", item.what, item.allowed, item.remedy) for item in recording.findings
            ]
    return uses, findings


def _outside(recording: Recording, entry: _Entry, place: str) -> list[Finding]:
    """Return that nothing was recorded in the piece that is asked for."""
    timed = [channel for channel in recording.channels.values() if channel.time.size]
    if entry.span.is_all or not timed or any(entry.span.holds(channel) for channel in timed):
        return []
    first, last = (float(end(channel.time[at] for channel in timed)) for end, at in ((min, 0), (max, -1)))
    what = "nothing of it was recorded in the piece that `from` and `to` ask for"
    return [Finding(f"{place}: {recording.path}", what, f"it lasts from {first:.6g} s to {last:.6g} s", _NO_ENDS)]


def _read(path: Path) -> Recording | StaticPoints | FrictionOcpError:
    try:
        return read_either(path)
    except FrictionOcpError as error:
        return error


def recording_path(problem: Path, file: str) -> Path:
    """Return the path of a recording that a problem file names."""
    return Path(os.path.normpath(problem.parent / file))


def _entries(content: Mapping[str, Any]) -> Iterator[_Entry]:
    """Yield the recordings that are listed, past all entries that are none; the schema complains about those."""
    listed: Any = content.get("recordings")
    for kind in ("train", "validation"):
        entries: Any = cast(dict[str, Any], listed).get(kind) if isinstance(listed, dict) else None
        for index, entry in enumerate(cast(list[Any], entries) if isinstance(entries, list) else []):
            keys = cast(dict[str, Any], entry if isinstance(entry, dict) else {"file": entry})
            file, numbers = keys.get("file"), keys.get("set", {})
            if isinstance(file, str):
                yield _Entry(kind, index, file, _numbers(numbers), span_of(keys))


def span_of(entry: Mapping[str, Any]) -> Span:
    """Return the piece that an entry of a recording asks for: all, where it makes no sense and the schema complains."""
    ends = {key: end for key, end in _numbers(entry).items() if key in ("from", "to") and isfinite(end)}
    span = Span(ends.get("from", -inf), ends.get("to", inf))
    return span if span.begin < span.end else Span()


def _numbers(value: Any) -> Mapping[str, float]:
    items = cast(dict[str, Any], value).items() if isinstance(value, dict) else ()
    return {key: float(item) for key, item in items if isinstance(item, (int, float))}
