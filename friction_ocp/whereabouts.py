"""Where files that a result names lie now: as named, from a folder above the result, or beside the problem file."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path


def problem_place(named: Path, digest: str, result: Path) -> Path:
    """Return where the problem file of a result lies, or where it was said to lie."""
    return _best([named, *_above(named, result)], digest)


def recording_places(recordings: Mapping[str, str], result: Path, named: Path, place: Path) -> dict[str, Path]:
    """Return where recordings lie, by their names; they and the problem file were `named` from one folder.

    `recordings` has their SHA-256; a file that has it is taken before others. The problem file is at `place` now.
    """
    found: dict[str, Path] = {}
    for name, digest in recordings.items():
        file = Path(name)
        beside = Path(os.path.normpath(place.parent / os.path.relpath(file, named.parent)))
        known = [file, beside, *_above(file, result)]
        found[name] = _best(known, digest)
    return found


def _above(named: Path, result: Path) -> list[Path]:
    return [folder / named for folder in result.resolve().parents]


def _best(places: list[Path], digest: str) -> Path:
    """Return the first place of a file with this SHA-256, else of any file, else the first of all."""
    there = [path for path in places if path.is_file()]
    return next((path for path in there if _digest(path) == digest), (there or places)[0])


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
