"""A problem file that lists static points: read, checked, fitted alone, and reported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from problem_workshop import Workshop

from friction_ocp.cli import DONE, main
from friction_ocp.problem_file.document import dump_document
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_static_points
from friction_ocp.recording.static_points import StaticPoints

TRUTH = {"load.friction.tau_c": 0.05, "load.friction.viscous": 0.02}
SPEED = np.linspace(-3.0, 3.0, 12)
CONTENT: dict[str, Any] = {
    "format": "friction-ocp-problem/1",
    "drive": {
        "motor": {"torque_constant": 0.5},
        "shafts": [
            {
                "name": "load",
                "inertia": 0.01,
                "friction": {"law": "coulomb_viscous", "tau_c": {"guess": 0.5, "min": 0}, "viscous": {"guess": 0.5}},
            }
        ],
    },
    "channels": {},
    "recordings": {"train": ["curve.h5"]},
}


def write_curve(folder: Path, name: str = "curve.h5", **columns: Any) -> None:
    """Write the exact friction of the truth as currents, each with a standard error of 1 mA."""
    current = (np.sign(SPEED) * TRUTH["load.friction.tau_c"] + TRUTH["load.friction.viscous"] * SPEED) / 0.5
    values = {"current": current, "std_error": np.full(SPEED.size, 1e-3), **columns}
    units = {"speed": "rad/s", "current": "A", "torque": "N m", "std_error": "A", "position": "rad"}
    kept = {key: value for key, value in values.items() if value is not None}
    own = {key: units[key] for key in ("speed", *kept)}
    write_static_points(StaticPoints("curve", SPEED, own, **kept), folder / name)


def write(folder: Path, content: dict[str, Any]) -> Path:
    path = folder / "static.yaml"
    path.write_text(dump_document(content), encoding="utf-8")
    return path


def test_a_file_of_points_alone_is_identified_and_reported(tmp_path: Path) -> None:
    """Without a recording the command fits, and page and figure show the points with their errors."""
    write_curve(tmp_path)
    folder = tmp_path / "out"
    assert main(["identify", str(write(tmp_path, CONTENT)), "--out", str(folder)]) == DONE
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    exact = 1e-6
    for name, wanted in TRUTH.items():
        assert result["parameters"][name]["value"] == pytest.approx(wanted, rel=exact)
    points = result["fit"]["static"]["curve"]
    assert points["noise_ratio"] < 1e-2 and points["split"] == "train" and points["noise_source"] == "std_error"
    assert points["predicted"] == pytest.approx(points["measured"], abs=1e-8)
    assert "Static points" in (folder / "report.html").read_text(encoding="utf-8")
    assert (folder / "figures" / "points-curve.png").stat().st_size > 5000
    assert (folder / "fitted.yaml").exists()


def test_points_stand_among_recordings(workshop: Workshop) -> None:
    """A list may mix both; each keeps its place in the file, and validation may hold points too."""
    write_curve(workshop.folder)
    write_curve(workshop.folder, "other.h5")
    lists = {"train": ["curve.h5", "sweep.h5"], "validation": ["other.h5"]}
    problem = load_problem(workshop.problem(lambda content: content.update(recordings=lists)))
    assert [use.place for use in problem.static] == ["recordings.train[0]"]
    assert [use.place for use in problem.train] == ["recordings.train[1]"]
    assert [use.name for use in problem.static_validation] == ["other"]


FAULTS: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "no scatter": ({"std_error": None, "current": np.zeros(12)}, {}, "the scatter of the points is not known"),
    "a current without a motor": ({}, {"motor": None}, "there is a /current, and the drive has no motor"),
    "a scatter of zero": ({"std_error": np.zeros(12)}, {}, "a standard error is not positive"),
    "a shaft along a line": ({}, {"motion": "linear"}, "/speed is in rad/s, but shaft 'load' turns in m/s"),
    "an unstated torque constant": ({}, {"motor": {"torque_constant": 1.0}}, "the torque constant is 1 N m/A"),
    "gravity without an angle": ({}, {"gravity": {"torque": 1.0}}, "there is no /position"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_points_that_cannot_be_of_this_drive_are_told(workshop: Workshop, name: str) -> None:
    """What the drive cannot have, and what leaves the points without meaning, is found with its place."""
    columns, changes, expected = FAULTS[name]
    write_curve(workshop.folder, **columns)

    def spoil(content: dict[str, Any]) -> None:
        content.clear()
        content.update(json.loads(json.dumps(CONTENT)))
        if "motor" in changes:
            content["drive"]["motor"] = changes["motor"]
        content["drive"]["shafts"][0] |= {key: value for key, value in changes.items() if key != "motor"}

    found = [message for message in workshop.messages(workshop.problem(spoil)) if expected in message]
    assert len(found) == 1 and "recordings.train[0]" in found[0]
