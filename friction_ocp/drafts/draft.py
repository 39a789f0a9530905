"""The draft as a problem file that passes the rules about files."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from friction_ocp.drafts.axis import Axis, constraints, drive_section, template
from friction_ocp.drafts.model_joint import axis_of_joint
from friction_ocp.drafts.recorded import Recorded, recordings_of
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.problem_file.check import check_file
from friction_ocp.problem_file.document import dump_document
from friction_ocp.problem_file.load import load_problem
from friction_ocp.problem_file.schema import FORMAT
from friction_ocp.whole_file import whole_file

MODELS = (".xml", ".mjcf", ".urdf")


def init(
    source: str | Path | Axis, recordings: str | Path = ".", path: str | Path = "problem.yaml", joint: str | None = None
) -> Recorded:
    """Write the first draft of a problem file, and return what the recordings of the folder measure.

    `source` is a template, a model in MJCF or URDF with a joint, or an axis. Raises FrictionOcpError where it is none,
    the folder has no recordings, or there is a file already.
    """
    axis = source if isinstance(source, Axis) else _axis(str(source), joint)
    recorded = recordings_of(Path(recordings), axis)
    axis = replace(axis, **recorded.sizes)
    write_draft(axis, recorded, Path(path))
    return recorded


def _axis(source: str, joint: str | None) -> Axis:
    if Path(source).suffix.lower() in MODELS:
        return axis_of_joint(Path(source), joint)
    if joint is not None:
        raise FrictionOcpError(Finding("init", "--joint stands beside a template", "a model in MJCF or URDF"))
    return template(source)


def write_draft(axis: Axis, recorded: Recorded, path: Path) -> None:
    """Write a problem file; raises FrictionOcpError if one is there, or if the draft would not pass `check`."""
    if path.exists():
        raise FrictionOcpError(Finding(str(path), "there is a file already", remedy="give another --out"))
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as staged:
        staged.write_text(draft_text(axis, recorded, path.parent), encoding="utf-8")
        if findings := check_file(load_problem(staged)):
            raise FrictionOcpError(findings)


def draft_text(axis: Axis, recorded: Recorded, folder: Path) -> str:
    """Return the text of a problem file in a folder."""
    listed = {
        kind: [os.path.relpath(item, folder) for item in items]
        for kind, items in (("train", recorded.train), ("validation", recorded.validation))
        if items
    }
    content: dict[str, Any] = {
        "format": FORMAT,
        "title": f"Friction of a {axis.kind}",
        "drive": drive_section(axis, recorded.driven_by),
        "channels": {name: dict(item) for name, item in recorded.channels.items()},
        "recordings": listed,
    }
    if needed := constraints(axis):
        content["constraints"] = needed
    return dump_document(content, _head(axis, recorded))


def _head(axis: Axis, recorded: Recorded) -> str:
    lines = [
        f"Asked: the friction of a {axis.kind}.",
        "",
        "A draft: numbers are typical, not yours. A plain number is taken as known, {guess, min, max} is fitted: state",
        "what you know (ratio, torque constant, inertias), correct the rest, and run friction-ocp check.",
        *axis.notes,
    ]
    if recorded.left_out:
        lines.append(f"Channels of the recordings that are not used: {', '.join(recorded.left_out)}.")
    lines += [f"Not read: {finding}" for finding in recorded.unread]
    return "\n".join(" ".join(line.split()) for line in lines)
