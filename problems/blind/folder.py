"""Files of a case, each written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from blind.machines import Document, Machine
from blind.recording import as_recording
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.whole_file import whole_file

Recorded = Mapping[str, Mapping[str, np.ndarray]]
"""Channels by recording."""


def problem_text(document: Document, train: Sequence[str], validation: Sequence[str]) -> str:
    """Return the text of a problem file about these recordings."""
    content: dict[str, Any] = {"format": "friction-ocp-problem/1", **document}
    content["recordings"] = {"train": [f"{name}.h5" for name in train]}
    if validation:
        content["recordings"]["validation"] = [f"{name}.h5" for name in validation]
    return yaml.safe_dump(content, sort_keys=False, width=120)


def write_recordings(folder: Path, machine: Machine, recorded: Recorded) -> list[Path]:
    """Write recordings; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.h5" for name in recorded]
    for path, channels in zip(paths, recorded.values(), strict=True):
        write_recording(as_recording(machine, path.stem, channels), path)
    return paths


def write_problem(folder: Path, machine: Machine, document: Document, train: Recorded, validation: Recorded) -> Path:
    """Write the recordings and, last, the problem file; return its path."""
    write_recordings(folder, machine, {**train, **validation})
    path = folder / "problem.yaml"
    write_text(path, problem_text(document, list(train), list(validation)))
    return path


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file."""
    write_text(path, json.dumps(content, indent=1) + "\n")
