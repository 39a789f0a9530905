"""What of long logs a search goes by."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from diagnosis_cases import CURRENT_NOISE, ENCODER_STEP, STEP, axis, diagnosed, write_case
from plant import Plant, Trajectory, steps_and_multisine

from friction_ocp.diagnosis.excerpts import FEWEST_SAMPLES, PARTS, excerpts, samples_of
from friction_ocp.diagnosis.footing import FOLDS, training_pieces
from friction_ocp.errors import FrictionOcpError
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording

SECONDS, RATE, MOTION = 60.0, 200.0, (31.0, 34.0)
"""Of a log that rests but for a while, s and Hz."""
STRIBECK: dict[str, Any] = {"law": "stribeck", "tau_s": 0.16, "omega_s": 1.5, "delta": 1.0}
"""What the model lacks."""


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """Return a problem of two recordings of 2,000 samples each."""
    return load_problem(write_case(tmp_path_factory.mktemp("excerpts"), axis()))


def model_by(problem: Problem, samples: float) -> Model:
    """Return the model of a search that goes by so many samples."""
    return prepare(replace(problem, diagnosis={"samples": samples}))


def resting(problem: Problem) -> Problem:
    """Return the problem with a log that rests, moves for three seconds and rests in the place of the first one."""
    time = np.arange(0.0, SECONDS, 1.0 / RATE)
    moves = (time > MOTION[0]) & (time < MOTION[1])
    rng, since = np.random.default_rng(0), 2.0 * np.pi * (time - MOTION[0])
    angle = np.where(moves, np.sin(since), 0.0)
    values = {
        "position": np.round(angle / ENCODER_STEP) * ENCODER_STEP,
        "current": np.where(moves, np.sin(since + 1.0), 0.0) + CURRENT_NOISE * rng.standard_normal(time.size),
    }
    first = problem.train[0]
    channels = {key: replace(first.recording.channels[key], time=time, values=values[key]) for key in values}
    return replace(problem, train=(replace(first, recording=replace(first.recording, channels=channels)),))


def test_short_logs_are_used_whole(problem: Problem) -> None:
    """Nothing changes as long as there are not too many samples; the only recording is cut into pieces as ever."""
    model = prepare(problem)
    assert excerpts(model) is model.train
    assert excerpts(model_by(problem, float("inf")))[0].grid.time.size == model.train[0].grid.time.size
    alone = prepare(replace(problem, train=problem.train[:1]))
    assert len(training_pieces(alone)) == FOLDS


def test_pieces_show_what_there_is(problem: Problem) -> None:
    """As many samples as asked for, some of every recording, as they were recorded; the same ones each time."""
    model = model_by(problem, FEWEST_SAMPLES)
    found = excerpts(model)
    assert FEWEST_SAMPLES / 2 < sum(item.grid.time.size for item in found) <= FEWEST_SAMPLES
    assert {item.name for item in found} == {"a", "b"}
    for item in found:
        whole = next(each for each in model.train if each.name == item.name)
        at = np.searchsorted(whole.grid.time, item.grid.time)
        assert np.array_equal(whole.grid.time[at], item.grid.time) and np.all(np.diff(at) == 1)
        assert np.array_equal(whole.measured[at], item.measured, equal_nan=True)
    assert all(np.diff([item.grid.time[0] for item in found if item.name == name]).min(initial=1) > 0 for name in "ab")
    again = excerpts(model_by(problem, FEWEST_SAMPLES))
    assert [item.grid.time[0] for item in again] == [item.grid.time[0] for item in found]


def test_rest_tells_little(problem: Problem) -> None:
    """Of a minute with three seconds of motion all of that is among the pieces, and some of every part of the log."""
    model = model_by(resting(problem), 2400)
    time = model.train[0].grid.time
    assert time.size == int(SECONDS * RATE)
    found = excerpts(model)
    assert sum(item.grid.time.size for item in found) <= 2400
    held = np.concatenate([item.grid.time for item in found])
    moving = time[(time > MOTION[0]) & (time < MOTION[1])]
    assert np.all(np.isin(moving, held))
    assert np.unique((PARTS * held / SECONDS).astype(int)).size == PARTS


@pytest.mark.parametrize("samples", [0, FEWEST_SAMPLES - 1, "all", True, float("nan")])
def test_as_many_samples_as_there_cannot_be(problem: Problem, samples: Any) -> None:
    """The error says what may be stated."""
    with pytest.raises(FrictionOcpError, match=r"diagnosis\.samples: this is .*1000 or more"):
        samples_of(replace(problem, diagnosis={"samples": samples}))


def long_log(plant: Plant, seconds: float) -> Recording:
    """Run a plant on a current that goes slow and fast, again and again."""
    rng = np.random.default_rng(4)
    steps = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 20.0), seconds, rng)
    time = np.arange(0.0, seconds, STEP)
    current = Trajectory(time, np.interp(time, np.asarray(steps.time), np.asarray(steps.value)), "zero")
    run = plant.simulate(seconds, {"motor.current": current}, rng)
    units = {"position": "rad", "current": "A"}
    return Recording("a", {key: Channel(key, *run.channels[key], unit) for key, unit in units.items()})


@pytest.mark.slow
def test_a_diagnosis_of_a_long_log_goes_by_parts_of_it(tmp_path: Path) -> None:
    """What is missing is found from a part, the result says from which, and the gap is that of whole recordings."""
    plant = axis(**STRIBECK)
    path = write_case(tmp_path, plant, effects=("stribeck",))
    write_recording(long_log(plant, 8.0), tmp_path / "a.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["diagnosis"]["samples"] = 2000
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    result = diagnosed(path)
    assert [item["effect"] for item in result["accepted"]] == ["stribeck"] and result["verdict"] == "explained"
    searched = result["searched"]
    assert searched["of"] == 6002 and 1000 < searched["samples"] <= 2000
    assert {item["recording"] for item in searched["pieces"]} == {"a", "b"}
    assert all(item["to"] > item["from"] for item in searched["pieces"])
    assert any("`samples` under `diagnosis:`" in line for line in result["assumptions"])
    assert result["gap"]["evaluated_on"] == ["c.h5"]
