"""The noise of a current whose loop follows the counts of an encoder."""

from __future__ import annotations

from pathlib import Path

import pendulum
import pytest
import yaml

from friction_ocp.estimation.drive_noise import input_floor
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.noise import noise_floor
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording

NOISE = 0.005
"""Of the current, A; the loop makes several times as much of the counts."""


def swung(folder: Path, **current: float) -> Model:
    """Return the model of two recorded swings; the problem states something of the `current`."""
    document = pendulum.document()
    document["channels"]["current"] |= current
    for seed, name in enumerate(("a", "b")):
        write_recording(pendulum.record(name, NOISE, 3.0 - 0.5 * seed, seed, feedback="angle"), folder / f"{name}.h5")
    document["recordings"] = {"train": ["a.h5", "b.h5"]}
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return prepare(load_problem(path))


def test_what_the_loop_throws_to_and_fro_is_no_noise(tmp_path: Path) -> None:
    """Only what its sensor adds is, which no motion knows of."""
    model = swung(tmp_path)
    (current,) = model.problem.drive.inputs
    signals = [use.recording.channels["current"] for use in model.problem.recordings]
    assert noise_floor(current, [(item.time, item.values) for item in signals]).std > 2.0 * NOISE
    floor = input_floor(model, current)
    assert floor.std == pytest.approx(NOISE, rel=0.1) and floor.source == "high_frequency"


def test_what_is_stated_is_believed(tmp_path: Path) -> None:
    model = swung(tmp_path, noise_std=0.3)
    (current,) = model.problem.drive.inputs
    assert input_floor(model, current).std == 0.3
